"""JSON files that this program writes and reads back, checked against a model."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, TypeVar

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, ValidationError

from airground.errors import InputError
from airground.io.input_files import TEXT_LIMIT, read_text

Model = TypeVar("Model", bound=BaseModel)


def read_checked(model: type[Model], path: Path, kind: str) -> Model:
    """Read a file and check it against a model; errors call it by its `kind`, as "summary".

    Raises:
        InputError: The file is missing, no JSON, or not of that form: one line that names the
            file and the first entry that is wrong.
    """
    try:
        return model.model_validate_json(read_text(path, TEXT_LIMIT))
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror})") from error
    except UnicodeDecodeError as error:
        raise InputError(f"{path}: cannot be read ({error})") from error
    except ValidationError as error:
        first = error.errors()[0]
        where = ".".join(map(str, first["loc"])) or "the file"
        raise InputError(f"{path}: no {kind}: {where}: {first['msg']}") from error


Share = Annotated[float, Field(ge=0, le=1)]
Number = Annotated[float, Field(allow_inf_nan=False)] | None
"""Null where nothing was measured, or where failures make it infinite."""
Amount = Annotated[float, Field(ge=0, allow_inf_nan=False)]
Count = Annotated[int, Field(ge=0)]


class Part(BaseModel):
    """A table of the file that refuses unknown keys."""

    model_config = ConfigDict(frozen=True, extra="forbid", populate_by_name=True)


def number(value: float) -> float | None:
    """A value as the file can hold it."""
    return float(value) if np.isfinite(value) else None
