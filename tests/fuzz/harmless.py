"""Changes of a file that change nothing of what it says."""

from __future__ import annotations

import io
import json
import os
import tomllib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import tomli_w

from tests.fuzz.damage import Rng

Change = Callable[[bytes, Rng], bytes]
LINK = "read through a link"
KEPT = "kept"
"""Name of the file to which a link within the folder leads."""
_NUMBERS_FIRST = tuple(letter.encode() for letter in "#-0123456789")


def reordered(tree: Any, rng: Rng) -> Any:
    """Tables and lists as they are, the keys of tables in another order."""
    if isinstance(tree, dict):
        names = list(tree)
        rng.shuffle(names)
        return {name: reordered(tree[name], rng) for name in names}
    return [reordered(one, rng) for one in tree] if isinstance(tree, list) else tree


def keys_of_toml(data: bytes, rng: Rng) -> bytes:
    return tomli_w.dumps(reordered(tomllib.loads(data.decode()), rng)).encode()


def keys_of_json(data: bytes, rng: Rng) -> bytes:
    indent = [None, 1, 4][int(rng.integers(3))]
    return json.dumps(reordered(json.loads(data), rng), indent=indent).encode()


def line_ends(data: bytes, rng: Rng) -> bytes:
    return data if b"\r" in data else data.replace(b"\n", b"\r\n")


def newlines_at_the_end(data: bytes, rng: Rng) -> bytes:
    return data + b"\n" * int(rng.integers(1, 4))


def comment(data: bytes, rng: Rng) -> bytes:
    """At the end: a first line may have a meaning."""
    return data + (b"" if data.endswith(b"\n") else b"\n") + b"# 1, 2, 3\n"


def spaces(data: bytes, rng: Rng) -> bytes:
    """Around the numbers of a list, in one line or in all."""
    lines = data.split(b"\n")
    only = None if rng.random() < 0.5 else int(rng.integers(len(lines)))
    for number, line in enumerate(lines):
        if line and not line.startswith(b"#") and only in (None, number):
            lines[number] = line.replace(b",", b", ") if b"," in line else line.replace(b" ", b"  ")
    return b"\n".join(lines)


def packed_arrays(data: bytes, rng: Rng) -> bytes:
    out = io.BytesIO()
    with np.load(io.BytesIO(data), allow_pickle=False) as stored:
        names = list(stored.files)
        rng.shuffle(names)
        np.savez_compressed(out, **{name: stored[name] for name in names})
    return out.getvalue()


def packed_pixels(data: bytes, rng: Rng) -> bytes:
    pixels = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_UNCHANGED)
    level = [cv2.IMWRITE_PNG_COMPRESSION, int(rng.integers(10))]
    return cv2.imencode(".png", pixels, level)[1].tobytes()


TEXT: dict[str, Change] = {"line ends": line_ends, "newlines at the end": newlines_at_the_end}
COMMENTED: dict[str, Change] = TEXT | {"a comment": comment}
BY_SUFFIX: dict[str, dict[str, Change]] = {
    ".toml": COMMENTED | {"order of keys": keys_of_toml},
    ".json": TEXT | {"order of keys": keys_of_json},
    ".yaml": COMMENTED,
    ".npz": {"arrays packed": packed_arrays},
    ".png": {"pixels packed": packed_pixels},
}


def changes_of(path: Path, data: bytes) -> dict[str, Change]:
    """What may be done to a file by its kind; a list of numbers may have comments and spaces."""
    if path.suffix in (".csv", ".txt", ".tum") and data.startswith(_NUMBERS_FIRST):
        return COMMENTED | {"spaces": spaces}
    return BY_SUFFIX.get(path.suffix, {})


def put_behind_link(path: Path, folder: Path) -> None:
    """Move a file up in its recording, below `folder`, and leave a link to it in its place."""
    parts = path.relative_to(folder).parts
    kept = (folder / parts[0] if len(parts) > 1 else folder) / KEPT
    path.rename(kept)
    path.symlink_to(os.path.relpath(kept, path.parent))
