"""Types of arrays, a check of their shape and type, and the kernels' fast-math flags.

`F64` is an array of 64-bit floats, `U8` one of unsigned bytes; docstrings give the shapes."""

from collections.abc import Sequence
from typing import TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

F32 = NDArray[np.float32]
F64 = NDArray[np.float64]
Floats = NDArray[np.floating]
"""Floats of either width."""
C64 = NDArray[np.complex64]
I8 = NDArray[np.int8]
I16 = NDArray[np.int16]
I32 = NDArray[np.int32]
I64 = NDArray[np.int64]
U8 = NDArray[np.uint8]
U16 = NDArray[np.uint16]
U32 = NDArray[np.uint32]
U64 = NDArray[np.uint64]
Mask = NDArray[np.bool_]

FAST = {"contract", "reassoc", "arcp", "nsz"}
"""Numba's fast-math flags for kernels: those that keep the meaning of NaN."""

Scalar = TypeVar("Scalar", bound=np.generic)


def read_only(
    value: ArrayLike, name: str, shape: Sequence[int | None], dtype: type[Scalar]
) -> NDArray[Scalar]:
    """Return `value` as a contiguous, read-only array of `dtype`.

    Args:
        value: Anything that numpy can make an array of; not copied where it fits already.
        name: Name of the array in the error message.
        shape: Expected shape; None leaves a dimension free.
        dtype: Element type of the result.

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


def freeze(owner: object, name: str, shape: Sequence[int | None], dtype: type[np.generic]) -> None:
    """Replace an attribute of a frozen data type by its `read_only` array."""
    object.__setattr__(owner, name, read_only(getattr(owner, name), name, shape, dtype))


def freeze_stamps(owner: object) -> None:
    """`freeze` for the (N,) attribute `stamps_ns`, which must strictly increase."""
    freeze(owner, "stamps_ns", (None,), np.int64)
    stamps_ns = vars(owner)["stamps_ns"]
    if (stamps_ns[1:] <= stamps_ns[:-1]).any():  # a difference could overflow
        raise ValueError("stamps_ns must strictly increase")


def _fits(shape: tuple[int, ...], expected: Sequence[int | None]) -> bool:
    """Whether each dimension is as long as expected, or may have any length."""
    return len(shape) == len(expected) and all(
        want is None or have == want for have, want in zip(shape, expected, strict=True)
    )
