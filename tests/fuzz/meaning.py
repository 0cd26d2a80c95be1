"""What was read of an input as one digest, to compare it with that of another one."""

from __future__ import annotations

import hashlib
from collections.abc import Iterable, Mapping
from dataclasses import fields, is_dataclass
from datetime import date
from enum import Enum
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import BaseModel


def meaning(value: object) -> str:
    """Digest of arrays, tables, data types and numbers in any nesting; paths count for nothing.
    TypeError for anything else."""
    digest = hashlib.sha256()
    _add(digest, value)
    return digest.hexdigest()


def _add(digest: Any, value: object) -> None:
    digest.update(type(value).__name__.encode())
    if isinstance(value, np.ndarray):
        digest.update(f"{value.dtype} {value.shape}".encode())
        digest.update(np.ascontiguousarray(value).tobytes())
    elif isinstance(value, BaseModel):
        _add(digest, dict(value))
    elif is_dataclass(value) and not isinstance(value, type):
        _add(digest, {one.name: getattr(value, one.name) for one in fields(value)})
    elif isinstance(value, str | bytes | int | float | None | date | Enum | np.generic):
        digest.update(repr(value).encode())
    elif isinstance(value, Path):
        return
    elif isinstance(value, Mapping):
        for name in sorted(value, key=repr):
            _add(digest, [name, value[name]])
    elif isinstance(value, set | frozenset):
        _add(digest, sorted(map(repr, value)))
    elif isinstance(value, Iterable):
        for one in value:
            _add(digest, one)
        digest.update(b"end")
    else:
        raise TypeError(f"no digest of {type(value)}")
