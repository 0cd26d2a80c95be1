"""A submission on disk: one file of answers for each recording, or runs of such files."""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from pydantic import Field, StringConstraints, ValidationError

from airground.errors import InputError
from airground.io.folder_links import check_links
from airground.io.input_files import read_toml_text
from evaluation.setup.checked_json import Part
from evaluation.table.answer_file import ENDINGS, Answers, read_answers

ABOUT = "submission.toml"
RUN = re.compile(r"run([1-9]\d?)")
Line = Annotated[str, StringConstraints(max_length=200, pattern=r"^[^\n\r]*$")]


class About(Part):
    """Contents of `submission.toml`: a name in place of the folder's, who made it, and how."""

    name: Annotated[Line, Field(min_length=1)] | None = None
    by: Line = ""
    description: Line = ""


@dataclass(frozen=True)
class Submission:
    """What a method says of a benchmark.

    Attributes:
        name: Its name in tables.
        about: What else it states of itself.
        runs: For each run of the method, the answers by the recording's name; recordings
            without a file are left out.
    """

    name: str
    about: About
    runs: Sequence[Mapping[str, Answers]]


def read_submission(folder: Path, recordings: Collection[str]) -> Submission:
    """Read a folder with a file `NAME.tum` (or .txt, .csv) per recording, or with folders `run1`,
    `run2`, ... of such files.

    Raises:
        InputError: Names the file, and what would be right.
    """
    if not folder.is_dir():
        raise InputError(f"{folder}: no such folder; expected one file of poses per recording")
    check_links(folder)
    about = _about(folder / ABOUT)
    runs = sorted(
        (path for path in folder.iterdir() if path.is_dir() and RUN.fullmatch(path.name)),
        key=lambda path: int(path.name[len("run") :]),
    )
    if runs and _files(folder):
        raise InputError(f"{folder}: holds runs and files of poses; expected one or the other")
    found = [_run(run, recordings) for run in runs or [folder]]
    if not any(found):
        raise InputError(f"{folder}: holds no file of poses (NAME.tum, NAME.txt or NAME.csv)")
    return Submission(about.name or folder.resolve().name, about, found)


def _run(folder: Path, recordings: Collection[str]) -> dict[str, Answers]:
    answers: dict[str, Answers] = {}
    for file in _files(folder):
        if file.stem not in recordings:
            known = ", ".join(sorted(recordings)[:4])
            raise InputError(f"{file}: is named like no recording; these are {known}, ...")
        if file.stem in answers:
            raise InputError(f"{file}: another file of recording {file.stem} lies beside it")
        answers[file.stem] = read_answers(file)
    return answers


def _files(folder: Path) -> list[Path]:
    return sorted(path for path in folder.iterdir() if path.suffix in ENDINGS)


def _about(file: Path) -> About:
    if not file.exists():
        return About()
    try:
        return About.model_validate(read_toml_text(file))
    except ValidationError as error:
        first = error.errors()[0]
        where = ".".join(map(str, first["loc"])) or "the file"
        raise InputError(f"{file}: {where}: {first['msg']}") from None
    except (OSError, ValueError) as error:
        reason = error.strerror if isinstance(error, OSError) else f"no TOML: {error}"
        raise InputError(f"{file}: cannot be read ({reason})") from None
