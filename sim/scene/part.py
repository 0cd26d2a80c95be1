"""What all tables of a scene file share: checks of single values, and refusal of unknown keys."""

from __future__ import annotations

from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field

Positive = Annotated[float, Field(gt=0)]
NonNegative = Annotated[float, Field(ge=0)]
Fraction = Annotated[float, Field(ge=0, le=1)]
Point = tuple[float, float]
Colour = tuple[NonNegative, NonNegative, NonNegative]

MAX_HEAP_HEIGHT_M = 1.1
"""Least height of the MAV's flight, above any heap of any seed [m]."""


class Part(BaseModel):
    """A frozen table of a scene file that refuses keys it does not know."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)
