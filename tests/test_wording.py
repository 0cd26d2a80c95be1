"""Plain English: some words are for people only, not for programs and data."""

from __future__ import annotations

import re
import subprocess

from tests.sources import ROOT

WORDS = re.compile(
    r"(?<![a-z])(nobody|somebody|everybody|told|lived|wanting)(?![a-z])", re.IGNORECASE
)
HISTORY = {"CHANGELOG.md", "docs/diary.md"}
NAMING_THE_WORDS = {"tests/test_wording.py", "tests/test_docs.py"}
KINDS = (".py", ".md", ".toml", ".j2", ".css", ".js", ".yml", ".yaml", ".txt", ".cff")


def test_programs_and_data_are_not_written_of_as_people() -> None:
    wrong = [
        f"{file}:{number}: {line.strip()}"
        for file in written()
        for number, line in enumerate((ROOT / file).read_text(encoding="utf-8").splitlines(), 1)
        if WORDS.search(line)
    ]
    assert wrong == []


def written() -> list[str]:
    """Files with code or prose that git does not ignore, and scripts."""
    command = ["git", "ls-files", "--cached", "--others", "--exclude-standard"]
    listed = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True)
    return [
        file
        for file in listed.stdout.splitlines()
        if (file.endswith(KINDS) or file.startswith(("scripts/", ".ci/")) or file == "Makefile")
        and file not in HISTORY | NAMING_THE_WORDS
        and (ROOT / file).is_file()
    ]
