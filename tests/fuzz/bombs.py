"""Small files that claim, or inflate to, far more than they should hold."""

from __future__ import annotations

import io
import struct
import zipfile
import zlib
from collections.abc import Callable, Iterator
from functools import cache

import numpy as np

from airground.io.ros.inflating import zstd
from tests.fuzz.damage import Rng, flip_bytes

ZEROS_MIB = 300
"""What a bomb inflates to, far more than any input here holds."""


@cache
def deflated_zeros() -> bytes:
    return zlib.compress(bytes(ZEROS_MIB << 20), 1)


@cache
def zstd_zeros() -> bytes:
    return zstd.compress(bytes(ZEROS_MIB << 20))


def bomb_npz(data: bytes, rng: Rng) -> bytes:
    """One array claims or has a huge size, or its entry in the archive states another one."""
    with np.load(io.BytesIO(data), allow_pickle=False) as stored:
        arrays = {name: stored[name] for name in stored.files}
    chosen, kind = list(arrays)[int(rng.integers(len(arrays)))], int(rng.integers(3))
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w", zipfile.ZIP_DEFLATED, compresslevel=1) as archive:
        for name, array in arrays.items():
            member = io.BytesIO()
            if name == chosen and kind == 0:
                shape = (2 ** int(rng.integers(25, 61)), *array.shape[1:])
                header = {"descr": array.dtype.str, "fortran_order": False, "shape": shape}
                np.lib.format.write_array_header_1_0(member, header)
                member.write(array.tobytes())
            elif name == chosen and kind == 1:
                np.lib.format.write_array(member, np.zeros(ZEROS_MIB << 17))
            else:
                np.lib.format.write_array(member, array)
            archive.writestr(f"{name}.npy", member.getvalue())
    packed = out.getvalue()
    return _other_size(packed, rng) if kind == 2 else packed


def _other_size(archive: bytes, rng: Rng) -> bytes:
    """One entry of the archive's directory states another inflated size."""
    entries = [at for at in range(len(archive)) if archive.startswith(b"PK\x01\x02", at)]
    at = entries[int(rng.integers(len(entries)))] + 24
    size = int(rng.choice([0, 1, 200 << 20, 0xFFFFFFFE, 0xFFFFFFFF]))
    return archive[:at] + struct.pack("<I", size) + archive[at + 4 :]


def bomb_png(data: bytes, rng: Rng) -> bytes:
    """Another size or kind in a header that is whole, or data that inflate to too much."""
    chunks = list(_chunks(data))
    width, height, *rest = struct.unpack(">IIBBBBB", chunks[0][1])
    match int(rng.integers(4)):
        case 0:
            side = int(rng.choice([8193, 65_536, 2**31 - 1]))
            width, height = [(side, height), (width, side), (side, side)][int(rng.integers(3))]
        case 1:
            bits, colour = [(1, 3), (16, 2), (8, 6), (16, 6), (2, 0)][int(rng.integers(5))]
            rest = [bits, colour, 0, 0, int(rng.integers(2))]
        case 2:
            chunks = [one if one[0] != b"IDAT" else (one[0], deflated_zeros()) for one in chunks]
        case _:
            chunks.insert(1, (b"zTXt", b"Comment\0\0" + deflated_zeros()))
    chunks[0] = b"IHDR", struct.pack(">IIBBBBB", width, height, *rest)
    return data[:8] + b"".join(map(_png_chunk, chunks))


def _chunks(data: bytes) -> Iterator[tuple[bytes, bytes]]:
    at = 8
    while at + 12 <= len(data):
        length = int.from_bytes(data[at : at + 4], "big")
        yield data[at + 4 : at + 8], data[at + 8 : at + 8 + length]
        at += 12 + length


def _png_chunk(chunk: tuple[bytes, bytes]) -> bytes:
    body = b"".join(chunk)
    return struct.pack(">I", len(chunk[1])) + body + struct.pack(">I", zlib.crc32(body))


def bomb_mcap(data: bytes, rng: Rng) -> bytes:
    """The index states another size of a chunk, or leads to one that inflates to far more."""
    (summary,) = struct.unpack("<Q", data[-28:-20])
    records = list(_records(data[summary:-37]))
    indices = [number for number, (kind, _) in enumerate(records) if kind == 0x08]
    if not indices:
        return flip_bytes(data, rng)
    number = indices[int(rng.integers(len(indices)))]
    times, (mapping,) = records[number][1][:16], struct.unpack("<I", records[number][1][32:36])
    sizes = [0, 1, 1 << 20, 255 << 20, 1 << 30, 1 << 62, ZEROS_MIB << 20]
    size = int(rng.choice(sizes))
    if rng.random() < 0.4:
        records[number] = 0x08, records[number][1][:-8] + struct.pack("<Q", size)
        added = b""
    else:
        name = b"zstd"
        body = times + struct.pack("<QII", size, 0, len(name)) + name
        body += struct.pack("<Q", len(zstd_zeros())) + zstd_zeros()
        added = b"\x06" + struct.pack("<Q", len(body)) + body
        index = (
            times + struct.pack("<QQ", summary, len(added)) + records[number][1][32 : 36 + mapping]
        )
        index += (
            struct.pack("<QI", 0, len(name)) + name + struct.pack("<QQ", len(zstd_zeros()), size)
        )
        records[number] = 0x08, index
    packed = b"".join(bytes([kind]) + struct.pack("<Q", len(one)) + one for kind, one in records)
    footer = data[-37:-28] + struct.pack("<QQI", summary + len(added), 0, 0) + data[-8:]
    return data[:summary] + added + packed + footer


def _records(data: bytes) -> Iterator[tuple[int, bytes]]:
    at = 0
    while at + 9 <= len(data):
        (length,) = struct.unpack("<Q", data[at + 1 : at + 9])
        yield data[at], data[at + 9 : at + 9 + length]
        at += 9 + length


BOMBS: dict[str, Callable[[bytes, Rng], bytes]] = {
    ".npz": bomb_npz,
    ".png": bomb_png,
    ".mcap": bomb_mcap,
}
"""By the end of a file's name."""
