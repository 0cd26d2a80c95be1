"""Ways to damage a file: its bytes, its text, its place on disk."""

from __future__ import annotations

import os
import re
from collections.abc import Callable
from pathlib import Path

import numpy as np

Rng = np.random.Generator
Damage = Callable[[bytes, Rng], bytes]

NUMBER = re.compile(rb"[-+]?\d+\.?\d*(?:[eE][-+]?\d+)?")
ODD_NUMBERS = [
    *(b"nan", b"inf", b"-inf", b"1e300", b"-1e300", b"1e-300", b"-1", b"0", b"-0.0", b"1e999"),
    *(b"9" * 19, b"9" * 400, b"-9223372036854775808", b"18446744073709551616", b"4294967296"),
    *(b"", b"0x10", b"1_000", b"1,5", b"one", "١٢".encode(), b"1e", b".", b"--3", b"3.5.1"),
]
ODD_TEXTS = [
    *(b"", b"\0", b"../../../../etc/passwd", b"/dev/zero", b"x" * 5000, b"\xff\xfe", b"\n", b"\r"),
    *("ключ".encode(), "\u202e".encode(), b"\x1b[31mred", b"'", b'"', b"%s%n", b"{}", b"*", b"#"),
]
BOMBS = [b"[" * 50_000, b"{" * 50_000, b"a." * 20_000 + b"b = 1\n", b"- " * 20_000, b"((" * 20_000]


def pick(rng: Rng, among: list[bytes]) -> bytes:
    return among[int(rng.integers(len(among)))]


def flip_bytes(data: bytes, rng: Rng) -> bytes:
    """A few bytes anywhere get other values."""
    changed = bytearray(data)
    for place in rng.integers(0, max(len(data), 1), int(rng.integers(1, 9))):
        if data:
            changed[place] ^= int(rng.integers(1, 256))
    return bytes(changed)


def flip_head(data: bytes, rng: Rng) -> bytes:
    """One of the first 64 bytes, where sizes and kinds stand."""
    return flip_bytes(data[:64], rng) + data[64:]


def cut(data: bytes, rng: Rng) -> bytes:
    return data[: int(rng.integers(0, max(len(data), 1)))]


def remove_middle(data: bytes, rng: Rng) -> bytes:
    start, end = sorted(rng.integers(0, len(data) + 1, 2).tolist())
    return data[:start] + data[end:]


def repeat_middle(data: bytes, rng: Rng) -> bytes:
    start, end = sorted(rng.integers(0, len(data) + 1, 2).tolist())
    return data[:end] + data[start:]


def append_noise(data: bytes, rng: Rng) -> bytes:
    return data + rng.bytes(int(rng.integers(1, 2000)))


def only_noise(data: bytes, rng: Rng) -> bytes:
    return rng.bytes(int(rng.integers(0, 3000)))


def as_utf16(data: bytes, rng: Rng) -> bytes:
    """Another encoding, or a byte order mark, as editors on other systems write."""
    text = data.decode("utf-8", "replace")
    encoded = [text.encode("utf-16"), b"\xef\xbb\xbf" + data, text.encode("cp500", "replace")]
    return pick(rng, [*encoded, data.replace(b"\n", b"\r"), data.replace(b"\n", b"\r\n")])


def odd_number(data: bytes, rng: Rng) -> bytes:
    """One number becomes another that is out of range, or none."""
    found = list(NUMBER.finditer(data))
    if not found:
        return flip_bytes(data, rng)
    one = found[int(rng.integers(len(found)))]
    value = pick(rng, [*ODD_NUMBERS, b"-" + one[0], one[0] + b"000000", b"0.000001" + one[0]])
    return data[: one.start()] + value + data[one.end() :]


def odd_text(data: bytes, rng: Rng) -> bytes:
    """Text put somewhere, in place of what stood there or beside it."""
    start = int(rng.integers(0, len(data) + 1))
    end = start + int(rng.choice([0, 1, 10]))
    return data[:start] + pick(rng, ODD_TEXTS) + data[end:]


def nest(data: bytes, rng: Rng) -> bytes:
    """Brackets without end in place of a number or at a line's start."""
    found = [m.span() for m in NUMBER.finditer(data)] + [(0, 0), (len(data), len(data))]
    start, end = found[int(rng.integers(len(found)))]
    return data[:start] + pick(rng, BOMBS) + data[end:]


def shuffle_lines(data: bytes, rng: Rng) -> bytes:
    """Lines doubled, left out, exchanged, emptied or joined."""
    lines = data.splitlines(keepends=True)
    if not lines:
        return data
    i, j = rng.integers(0, len(lines), 2).tolist()
    match int(rng.integers(6)):
        case 0:
            lines.insert(j, lines[i])
        case 1:
            del lines[i]
        case 2:
            lines[i], lines[j] = lines[j], lines[i]
        case 3:
            lines[i] = b"\n"
        case 4:
            lines[i] = lines[i].rstrip()
        case _:
            lines = lines[: min(i, j)] + lines[max(i, j) :]
    return b"".join(lines)


def shift_columns(data: bytes, rng: Rng) -> bytes:
    """Columns exchanged, doubled or left out in one line or in all."""
    separator = b"," if b"," in data else b" "
    lines = data.splitlines()
    if not lines:
        return data
    only = None if rng.random() < 0.5 else int(rng.integers(len(lines)))
    width = max(len(line.split(separator)) for line in lines)
    i, j = rng.integers(0, width, 2).tolist()
    kind = int(rng.integers(4))
    for n, line in enumerate(lines):
        cells = line.split(separator)
        if only not in (None, n) or max(i, j) >= len(cells):
            continue
        if kind == 0:
            cells[i], cells[j] = cells[j], cells[i]
        elif kind == 1:
            cells.insert(i, cells[j])
        elif kind == 2:
            del cells[i]
        else:
            cells[i] = pick(rng, ODD_NUMBERS)
        lines[n] = separator.join(cells)
    return b"\n".join(lines) + b"\n"


BYTES: dict[str, Damage] = {
    "flipped bytes": flip_bytes,
    "flipped head": flip_head,
    "cut": cut,
    "piece removed": remove_middle,
    "piece repeated": repeat_middle,
    "noise appended": append_noise,
    "noise alone": only_noise,
}
TEXT: dict[str, Damage] = {
    "encoding": as_utf16,
    "odd number": odd_number,
    "odd text": odd_text,
    "nesting": nest,
    "lines": shuffle_lines,
    "columns": shift_columns,
}


SPARSE = [3 << 20, 200 << 20, 1000 << 20, 7 << 30, 9 << 30]
"""Sizes of sparse files, below and above the limits of `SECURITY.md` [byte]."""


def make_sparse(path: Path, data: bytes, rng: Rng) -> None:
    """A file that takes no room on disk: of zeros, or with zeros after what it held."""
    path.write_bytes(data if rng.random() < 0.5 else b"")
    os.truncate(path, int(rng.choice(SPARSE)))


def replace_place(path: Path, rng: Rng) -> None:
    """What stands at a file's path becomes something else; `path` is removed before."""
    data = b"" if path.is_dir() else path.read_bytes()
    if path.is_dir():
        for inner in path.iterdir():
            inner.unlink()
        path.rmdir()
    else:
        path.unlink()
    outside = path.parent / f"{path.name}.elsewhere"
    match int(rng.integers(9)):
        case 0:
            path.touch()
        case 1:
            path.mkdir()
        case 2:
            os.mkfifo(path)
        case 3:
            path.symlink_to("/dev/zero")
        case 4:
            path.symlink_to(path.name)
        case 5:
            path.symlink_to(outside)
        case 6:
            make_sparse(path, data, rng)
        case 7:
            path.symlink_to(path.parent)
        case _:
            pass  # missing
