"""What every part of `summary.json` is made of."""

from __future__ import annotations

from typing import Annotated

import numpy as np
from pydantic import BaseModel, ConfigDict, Field

Share = Annotated[float, Field(ge=0, le=1)]
Number = Annotated[float, Field(allow_inf_nan=False)] | None
"""Null where nothing was measured, or where failures make it infinite."""
Count = Annotated[int, Field(ge=0)]


class Part(BaseModel):
    """A table of the file that refuses keys it does not know."""

    model_config = ConfigDict(frozen=True, extra="forbid", populate_by_name=True)


def number(value: float) -> float | None:
    """A value as the file can hold it."""
    return float(value) if np.isfinite(value) else None
