"""The drop list of a live run, with which a run offline gives the same bytes."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Literal, Self

from pydantic import BaseModel, ConfigDict, Field

from airground.core.cloud import Source
from airground.core.messages import MavImage
from airground.errors import InputError
from airground.io.recording import Recording
from airground.link.frame_codec import as_received
from airground.tracking import TrackedFrame, without
from evaluation.setup.checked_json import read_checked

SCHEMA: Literal[1] = 1


class _Part(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid", populate_by_name=True)


class Stamps(_Part):
    """Stamps of images of each robot [ns]."""

    mav: frozenset[int] = frozenset()
    ground: frozenset[int] = frozenset()

    def by_robot(self) -> dict[Source, frozenset[int]]:
        """The stamps by robot."""
        return {Source.MAV: self.mav, Source.GROUND: self.ground}


class DropList(_Part):
    """Contents of `dropped.json`.

    Attributes:
        recording: Fingerprint of the recording.
        dropped: Images that did not reach their tracker.
        unmapped: Images that were tracked, but did not reach the mapper.
        jpeg_quality: JPEG quality of the MAV's images at the mapper; None if not compressed.
    """

    schema_: Literal[1] = Field(alias="schema")
    recording: str
    dropped: Stamps = Stamps()
    unmapped: Stamps = Stamps()
    jpeg_quality: Annotated[int, Field(ge=1, le=100)] | None = None

    @classmethod
    def read(cls, path: Path, recording: Recording) -> Self:
        """Read a list that was made with this recording; raises InputError if the file is missing,
        malformed, or of another recording."""
        made = read_checked(cls, path, "list of drops")
        if made.recording != fingerprint(recording):
            raise InputError(
                f"{path}: was made with another recording than {recording.path}; "
                "give the one that live played"
            )
        return made

    def write(self, path: Path) -> None:
        """Write with sorted stamps, so that the same list gives the same bytes."""
        content = self.model_dump(by_alias=True)
        for kind in ("dropped", "unmapped"):
            content[kind] = {robot: sorted(stamps) for robot, stamps in content[kind].items()}
        path.write_text(json.dumps(content, indent=1) + "\n", encoding="utf-8")

    def received(self, frames: Iterable[TrackedFrame]) -> Iterator[TrackedFrame]:
        """Tracked frames that reached the mapper, compressed as they reached it."""
        for frame in without(frames, self.unmapped.by_robot()):
            if self.jpeg_quality is not None and isinstance(frame.image, MavImage):
                yield replace(frame, image=as_received(frame.image, self.jpeg_quality))
            else:
                yield frame


def fingerprint(recording: Recording) -> str:
    """Digest that identifies a recording."""
    digests = json.dumps(recording.header.digests, sort_keys=True)
    return hashlib.sha256(digests.encode()).hexdigest()


def nothing_dropped(recording: Recording) -> DropList:
    """The empty list, of a run offline."""
    return DropList(schema=SCHEMA, recording=fingerprint(recording))
