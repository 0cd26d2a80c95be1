"""Checks that give an array its contract once, when it enters a data type."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, DTypeLike, NDArray


def read_only(
    value: ArrayLike, name: str, shape: Sequence[int | None], dtype: DTypeLike
) -> NDArray:
    """Return `value` as a contiguous array of `dtype` that nobody can write to.

    Args:
        value: Anything numpy can make an array of. An array that already fits is not
            copied; a read-only view of it is returned.
        name: How the array is called in the error message.
        shape: Expected shape; None leaves a dimension free.
        dtype: Element type of the result. Conversions that lose information raise.

    Raises:
        ValueError: The shape differs, or the conversion to `dtype` is not safe.
    """
    array = np.ascontiguousarray(value)
    if array.dtype != dtype:
        if not np.can_cast(array.dtype, dtype, casting="same_kind"):
            raise ValueError(f"{name}: expected {np.dtype(dtype)}, got {array.dtype}")
        array = array.astype(dtype)
    if array.shape != shape and not _fits(array.shape, shape):
        expected = "x".join("*" if n is None else str(n) for n in shape)
        raise ValueError(f"{name}: expected shape {expected}, got {array.shape}")
    view = array.view()
    view.flags.writeable = False
    return view


def _fits(shape: tuple[int, ...], expected: Sequence[int | None]) -> bool:
    """Whether each dimension is as long as expected, or may have any length."""
    return len(shape) == len(expected) and all(
        want is None or have == want for have, want in zip(shape, expected, strict=True)
    )
