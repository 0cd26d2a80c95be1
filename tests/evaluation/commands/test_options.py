"""What commands say of the work ahead."""

from __future__ import annotations

import pytest

from evaluation.commands.options import on_disk


@pytest.mark.parametrize(
    ("seconds", "said"), [(1.0, "about 26 MB"), (17.0, "about 442 MB"), (60.0, "about 1.6 GB")]
)
def test_the_size_of_a_recording_is_said_in_readable_units(seconds: float, said: str) -> None:
    assert on_disk(seconds) == said
    assert on_disk(2 * seconds, every=2) == said
