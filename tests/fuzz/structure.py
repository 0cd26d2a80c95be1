"""Ways to damage what a file holds: its tables, arrays, columns and pixels."""

from __future__ import annotations

import io
import json
import math
import tomllib
from collections.abc import Callable
from typing import Any

import cv2
import numpy as np
import pandas as pd
import tomli_w

from tests.fuzz.damage import Rng, flip_bytes

ODD_VALUES: list[Any] = [
    *(None, True, False, -1, 0, 1, 2**31, 2**63, 10**400, -(2**63), 0.5, -0.5, 1e308, -1e308),
    *(
        math.nan,
        math.inf,
        -math.inf,
        1e-308,
        "",
        "x",
        "nan",
        "../../x",
        "a\0b",
        "é" * 300,
        "\x1b[2J",
    ),
    *([], [[]], [1], {}, {"a": {}}, [[[[[1]]]]], ["x"] * 500, [math.nan] * 3),
]
Path = tuple[Any, ...]


def places(value: Any, at: Path = ()) -> list[Path]:
    """Every place in nested tables and lists."""
    inner: Any = value.items() if isinstance(value, dict) else ()
    if isinstance(value, list):
        inner = enumerate(value)
    return [at, *(place for key, one in inner for place in places(one, (*at, key)))]


def damage_tree(tree: Any, rng: Rng) -> Any:
    """One entry left out, doubled, renamed, or given an odd value."""
    everywhere = places(tree)[1:]
    if not everywhere:
        return ODD_VALUES[int(rng.integers(len(ODD_VALUES)))]
    *way, last = everywhere[int(rng.integers(len(everywhere)))]
    parent = tree
    for step in way:
        parent = parent[step]
    value = parent[last]
    match int(rng.integers(6)):
        case 0:
            del parent[last]
        case 1 if isinstance(parent, dict):
            parent[f"{last}2"] = value
        case 1:
            parent.insert(last, value)
        case 2 if isinstance(parent, dict):
            parent[str(last).upper() + "\x1b"] = parent.pop(last)
        case 3 if isinstance(value, int | float) and not isinstance(value, bool):
            parent[last] = value * float(rng.choice([-1, 1e6, 1e-6, 1e30, 2]))
        case 3 if isinstance(value, list):
            parent[last] = value * int(rng.choice([0, 2, 50]))
        case _:
            parent[last] = ODD_VALUES[int(rng.integers(len(ODD_VALUES)))]
    return tree


def damage_json(data: bytes, rng: Rng) -> bytes:
    return json.dumps(damage_tree(json.loads(data), rng)).encode()


def damage_toml(data: bytes, rng: Rng) -> bytes:
    tree = damage_tree(tomllib.loads(data.decode()), rng)
    try:
        return tomli_w.dumps(tree).encode()
    except (TypeError, ValueError, AttributeError):  # there is no null in TOML
        return flip_bytes(data, rng)


def damage_array(array: np.ndarray, rng: Rng) -> np.ndarray:
    """Odd values, another shape or another type."""
    array = np.array(array)
    flat = array.reshape(-1)
    match int(rng.integers(8)):
        case 0 if array.dtype.kind == "f" and array.size:
            flat[int(rng.integers(array.size))] = rng.choice([np.nan, np.inf, 1e30, -1e30, 1e-30])
        case 1 if array.dtype.kind == "f":
            flat[:] = rng.choice([np.nan, np.inf, 0.0, 1e30])
        case 2 if array.dtype.kind in "iu" and array.size:
            info = np.iinfo(array.dtype)
            flat[int(rng.integers(array.size))] = rng.choice(np.array([info.min, info.max, 0, 1]))
        case 3 if array.ndim:
            return array[: int(rng.integers(0, len(array) + 1))]
        case 4:
            return array[..., None]
        case 5:
            return array.astype(str(rng.choice(["f2", "f8", "i1", "u8", "U5", "S3", "c16", "?"])))
        case 6 if array.ndim:
            return array[::-1]
        case 7:
            return array.T
    return np.zeros((0, 3))


def damage_npz(data: bytes, rng: Rng) -> bytes:
    """One array left out, renamed or damaged."""
    with np.load(io.BytesIO(data), allow_pickle=False) as stored:
        arrays = {name: stored[name] for name in stored.files}
    name = list(arrays)[int(rng.integers(len(arrays)))]
    match int(rng.integers(8)):
        case 0:
            del arrays[name]
        case 1:
            arrays[f"{name}x"] = arrays.pop(name)
        case _:
            arrays[name] = _quiet(arrays[name], rng)
    out = io.BytesIO()
    np.savez(out, **arrays)
    return out.getvalue()


def _quiet(array: np.ndarray, rng: Rng) -> np.ndarray:
    with np.errstate(all="ignore"):
        try:
            return damage_array(array, rng)
        except ValueError:  # text is no number
            return np.zeros(())


def damage_parquet(data: bytes, rng: Rng) -> bytes:
    """One column left out, of another type or with odd values; rows doubled or left out."""
    frame = pd.read_parquet(io.BytesIO(data))
    column = str(rng.choice(frame.columns))
    some = rng.random(len(frame)) < float(rng.choice([0.001, 0.1, 1.0]))
    match int(rng.integers(9)):
        case 0:
            frame = frame.drop(columns=column)
        case 1:
            frame = frame.rename(columns={column: f"{column}2"})
        case 2:
            frame[column] = frame[column].astype(str)
        case 3:
            frame = pd.concat([frame, frame[some]])
        case 4:
            frame = frame[~some]
        case 5:
            frame["value"] = frame["value"].mask(
                some, float(rng.choice([np.nan, np.inf, -1e300, -1]))
            )
        case 6:
            number = str(rng.choice(["seed", "flight", "sequence", "iteration", "trial", "time_s"]))
            odd = float(rng.choice([-1, 1e18, 2**40, 0, 7.5, np.nan]))
            frame[number] = frame[number].astype(float).mask(some, odd)
        case 7:
            words = str(rng.choice(["scene", "stage", "metric", "unit", "note", "preset"]))
            frame[words] = frame[words].mask(some, str(rng.choice(["", "x", "\x1b[2J", "é" * 500])))
        case _:
            frame = frame.sample(frac=1.0, random_state=int(rng.integers(2**31)))
    out = io.BytesIO()
    frame.to_parquet(out, index=False)
    return out.getvalue()


def damage_image(data: bytes, rng: Rng) -> bytes:
    """Another size, number of channels or depth of bits, or pixels that are all alike."""
    pixels = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_UNCHANGED)
    match int(rng.integers(6)):
        case 0:
            pixels = pixels[:, : max(1, pixels.shape[1] // 2)]
        case 1:
            pixels = pixels[0] if pixels.ndim == 3 else np.dstack([pixels] * 4)
        case 2:
            pixels = (pixels.astype(np.uint16) * 257) if pixels.dtype == np.uint8 else pixels >> 8
        case 3:
            pixels = pixels.astype(np.uint8)
        case 4:
            pixels = np.full_like(pixels, int(rng.choice([0, 255])))
        case _:
            pixels = np.full_like(pixels, np.iinfo(pixels.dtype).max)
    return cv2.imencode(".png", np.ascontiguousarray(pixels))[1].tobytes()


BY_SUFFIX: dict[str, tuple[str, Callable[[bytes, Rng], bytes]]] = {
    ".json": ("entries", damage_json),
    ".toml": ("entries", damage_toml),
    ".npz": ("arrays", damage_npz),
    ".parquet": ("columns of a table", damage_parquet),
    ".png": ("pixels", damage_image),
}
