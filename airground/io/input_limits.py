"""How much larger inputs may be than usual: one factor for all limits, from the environment."""

from __future__ import annotations

import math
import os

from airground.errors import InputError

INPUT_LIMITS = "AIRGROUND_INPUT_LIMITS"
"""Environment variable, so that worker processes have it too; multiplies every limit of size."""
LARGEST_FACTOR = 1024
"""Settings of 4 GiB, bags of an exbibyte: no input is larger."""


def raised(limit: int) -> int:
    """A limit of size as the user has raised it.

    Raises:
        InputError: The environment variable is no number from 1 to 1024.
    """
    text = os.environ.get(INPUT_LIMITS) or "1"
    try:
        factor = float(text)
    except ValueError:
        factor = math.nan
    if not 1 <= factor <= LARGEST_FACTOR:
        raise InputError(
            f"{INPUT_LIMITS}: expected a number from 1 to {LARGEST_FACTOR}, got '{text[:60]}'"
        )
    return int(limit * factor)


def how_to_raise(size: int, limit: int) -> str:
    """End of a refusal that says by which factor an input of `size` may pass; empty where by none.
    `limit` is the usual limit."""
    factor = math.ceil(size / limit)
    return f" ({INPUT_LIMITS}={factor} allows it)" if factor <= LARGEST_FACTOR else ""
