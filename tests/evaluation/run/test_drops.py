"""The drop list of a live run: written, read back, and refused."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from airground.errors import InputError
from airground.io.recording import Recording
from evaluation.run.drops import DropList, Stamps, fingerprint
from tests.io.recordings import MAV_STAMPS, write_recording


@pytest.fixture
def recording(tmp_path: Path) -> Recording:
    return Recording.open(write_recording(tmp_path / "recording"))


def drop_list(recording: Recording) -> DropList:
    return DropList(
        schema=1,
        recording=fingerprint(recording),
        dropped=Stamps(mav=frozenset(MAV_STAMPS[1:3].tolist())),
        unmapped=Stamps(mav=frozenset(MAV_STAMPS[3:].tolist())),
        jpeg_quality=80,
    )


def test_it_is_read_back_as_written(recording: Recording, tmp_path: Path) -> None:
    made = drop_list(recording)
    path = tmp_path / "dropped.json"
    made.write(path)
    assert DropList.read(path, recording) == made
    assert json.loads(path.read_text())["dropped"] == {
        "mav": MAV_STAMPS[1:3].tolist(),
        "ground": [],
    }


def test_a_list_of_another_recording_is_refused(recording: Recording, tmp_path: Path) -> None:
    path = tmp_path / "dropped.json"
    other = drop_list(recording).model_copy(update={"recording": "0" * 64})
    other.write(path)
    with pytest.raises(InputError, match=r"dropped\.json: was made with another recording"):
        DropList.read(path, recording)


@pytest.mark.parametrize(
    ("text", "named"),
    [
        ("[]", "the file"),
        ("{", "the file"),
        ('{"schema": 2, "recording": "x"}', "schema"),
        ('{"schema": 1, "recording": "x", "jpeg_quality": 0}', "jpeg_quality"),
    ],
)
def test_a_malformed_list_is_refused(
    text: str, named: str, recording: Recording, tmp_path: Path
) -> None:
    path = tmp_path / "dropped.json"
    path.write_text(text)
    with pytest.raises(InputError, match=named):
        DropList.read(path, recording)


def test_a_missing_file_is_named(recording: Recording, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"nowhere\.json: cannot be read"):
        DropList.read(tmp_path / "nowhere.json", recording)
