"""Some damaged inputs, always the same; `python -m tests.fuzz` tries thousands."""

from __future__ import annotations

import pytest

from tests.fuzz.campaign import outcomes

COUNT, SEED = 200, 1


@pytest.mark.slow
def test_damaged_inputs_are_refused_in_one_line_or_work() -> None:
    found = [one for one in outcomes(SEED, range(COUNT)) if one.is_finding]
    assert found == []
