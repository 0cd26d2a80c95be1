"""Encoding of PNG images: OpenCV reads them, whatever their size and kind."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from airground.io.png import decode_png
from airground.io.png_encoder import encode_png

SIDES = st.integers(1, 40)


@settings(deadline=None)  # the first example compiles
@given(st.integers(0, 2**32 - 1), SIDES, SIDES, st.sampled_from(["grey", "depth", "colour"]))
def test_opencv_and_our_decoder_read_what_was_encoded(
    seed: int, height: int, width: int, kind: str
) -> None:
    rng = np.random.default_rng(seed)
    dtype, top = (np.uint16, 65536) if kind == "depth" else (np.uint8, 256)
    shape = (height, width, 3) if kind == "colour" else (height, width)
    image = rng.integers(0, top, shape, dtype)
    packed = encode_png(image)
    read = cv2.imdecode(np.frombuffer(packed, np.uint8), cv2.IMREAD_UNCHANGED)
    assert read is not None
    assert read.dtype == image.dtype
    np.testing.assert_array_equal(read[..., ::-1] if kind == "colour" else read, image)
    np.testing.assert_array_equal(decode_png(packed), image)


def test_strided_images_are_encoded_as_they_look() -> None:
    image = np.arange(600, dtype=np.uint16).reshape(20, 30)[::2, ::-3]
    np.testing.assert_array_equal(decode_png(encode_png(image)), image)


def test_noise_is_packed_to_about_its_entropy() -> None:
    """Steps between pixels with noise of 2 grey levels have 3.55 bits each; ISA-L needs 4.06."""
    rng = np.random.default_rng(0)
    image = np.rint(rng.normal(128, 2, (480, 752))).astype(np.uint8)
    bits = 8 * len(encode_png(image)) / image.size
    assert 3.5 < bits < 4.2


@pytest.mark.parametrize(
    "image",
    [np.zeros((2, 2), np.float32), np.zeros((2, 2, 4), np.uint8), np.zeros((2, 2, 3), np.uint16)],
)
def test_other_kinds_are_refused(image: np.ndarray) -> None:
    with pytest.raises(ValueError, match="not encoded here"):
        encode_png(image)
