"""The lists of a TUM RGB-D folder: which colour image belongs to which depth image, and when."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from airground.core.arrays import I64
from airground.errors import RecordingError
from airground.io.frame_numbers import are_frame_numbers
from airground.io.image_files import listed_files
from airground.io.plausibility import CAMERA_STEP_S, check_stamp_unit
from airground.io.tum import read_associations, read_image_list

MAX_DIFFERENCE_NS = 20_000_000
"""Largest difference between the stamps of colour and depth [ns], as in TUM's `associate.py`."""
COLOUR, DEPTH, PAIRS = "rgb.txt", "depth.txt", "associations.txt"


@dataclass(frozen=True, eq=False)
class Frames:
    """Stamps (N,) of frames [ns], with their N colour and N depth files."""

    stamps_ns: I64
    colour: tuple[Path, ...]
    depth: tuple[Path, ...]


def is_tum_folder(path: Path) -> bool:
    return (path / COLOUR).is_file() or (path / PAIRS).is_file()


def read_frames(path: Path) -> Frames:
    """The frames of a folder, by `rgb.txt` and `depth.txt` or else by `associations.txt`.

    Images of the two lists are paired by `associate`, at most 20 ms apart. A frame has the stamp of
    its colour image. Images without a partner are left out.

    Raises:
        RecordingError: Names the list and what is wrong in it.
    """
    if not (path / COLOUR).is_file():
        stamps, colour_names, depth_names = read_associations(path / PAIRS)
        _check_unit(stamps, path / PAIRS)
        colour = listed_files(path, colour_names, path / PAIRS)
        return Frames(stamps, tuple(colour), tuple(listed_files(path, depth_names, path / PAIRS)))
    colour_stamps, colour_names = _image_list(path / COLOUR)
    depth_stamps, depth_names = _image_list(path / DEPTH)
    i, j = associate(colour_stamps, depth_stamps, MAX_DIFFERENCE_NS)
    if len(i) == 0:
        raise RecordingError(
            f"{path / DEPTH}: no depth image is within 20 ms of a colour image of "
            "rgb.txt; both must be stamped by the same clock"
        )
    colour = listed_files(path, colour_names, path / COLOUR)
    depth = listed_files(path, depth_names, path / DEPTH)
    return Frames(colour_stamps[i], tuple(colour[k] for k in i), tuple(depth[k] for k in j))


def associate(first_ns: I64, second_ns: I64, max_difference_ns: int) -> tuple[I64, I64]:
    """Pair stamps one to one, the nearest pairs first (as TUM's `associate.py` does).

    Args:
        first_ns, second_ns: (N,) and (M,) stamps [ns], strictly increasing.
        max_difference_ns: Largest difference within a pair [ns].

    Returns:
        (P,) indices into each, in order of time.
    """
    low = np.searchsorted(second_ns, first_ns - max_difference_ns, side="left")
    high = np.searchsorted(second_ns, first_ns + max_difference_ns, side="right")
    counts = high - low
    i = np.repeat(np.arange(len(first_ns)), counts)
    # Within each run of equal i, j counts up from its low.
    j = np.arange(counts.sum()) - np.repeat(np.cumsum(counts) - counts, counts)
    j += np.repeat(low, counts)
    taken_i, taken_j = np.zeros(len(first_ns), bool), np.zeros(len(second_ns), bool)
    pairs = []
    for k in np.lexsort((j, i, np.abs(first_ns[i] - second_ns[j]))):
        if not (taken_i[i[k]] or taken_j[j[k]]):
            taken_i[i[k]] = taken_j[j[k]] = True
            pairs.append((i[k], j[k]))
    pairs.sort()
    table = np.array(pairs, np.int64).reshape(-1, 2)
    return table[:, 0], table[:, 1]


def _image_list(path: Path) -> tuple[I64, list[str]]:
    stamps, names = read_image_list(path)
    _check_unit(stamps, path)
    return stamps, names


def _check_unit(stamps_ns: I64, path: Path) -> None:
    if not are_frame_numbers(stamps_ns):
        check_stamp_unit(stamps_ns, path, "seconds", CAMERA_STEP_S)
