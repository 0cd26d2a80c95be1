"""What baselines claim of a whole recording, with or without truth: submissions to a benchmark."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from airground.config import Config
from airground.core.events import Sighted
from airground.core.se3 import SE3
from evaluation.measure.baselines.interface import Baseline, Given
from evaluation.measure.baselines.measure import why_not_run
from evaluation.measure.baselines.table import BASELINES
from evaluation.run.claim_log import BASELINE_CLAIMS, claimed_poses, newest_image
from evaluation.run.onlooker import Seen
from evaluation.table.answer_file import write_answers
from evaluation.table.tracking_log import Tracked


def without_truth() -> list[Baseline]:
    """The baselines that can answer without truth, from which priors and nearby images are made."""
    return [one for one in BASELINES if one.prior == "none" and not one.views]


class BaselineClaims:
    """An onlooker that has each baseline answer each aerial map. A claim holds until the next one
    of that baseline, as the pipeline's does.

    Args:
        config: Parameters that the baselines read.
        seed: Seed of all random numbers.
        baselines: Those that are asked, if they are installed; all `without_truth` by default.

    Attributes:
        missing: Why a baseline is not asked, by its name.
    """

    def __init__(
        self, config: Config, seed: int, baselines: Sequence[Baseline] | None = None
    ) -> None:
        self._config, self._seed = config, seed
        known = without_truth() if baselines is None else baselines
        reasons = {one.name: why_not_run(one) for one in known}
        self.missing = {name: reason for name, reason in reasons.items() if reason}
        self._asked = [one for one in known if not reasons[one.name]]
        self._claimed: dict[str, list[tuple[int, SE3]]] = {one.name: [] for one in self._asked}
        self._maps = 0

    def see(self, seen: Seen) -> None:
        """Ask at each aerial map."""
        if not isinstance(seen.event, Sighted):
            return
        for baseline in self._asked:
            rng = np.random.default_rng([self._seed, 5, self._maps])
            answer = baseline.locate(Given(seen.event.sighting, self._config, rng))
            if answer.claimed and answer.T_ground_mav is not None:
                self._claimed[baseline.name].append((newest_image(seen), answer.T_ground_mav))
        self._maps += 1

    def write(self, folder: Path, tracked: Mapping[str, Tracked]) -> None:
        """Write the claims of each baseline into the folder of a run."""
        (folder / BASELINE_CLAIMS).mkdir()
        for name, claimed in self._claimed.items():
            claims = claimed_poses(claimed, tracked)
            if claims:
                write_answers(folder / BASELINE_CLAIMS / f"{name}.tum", claims)
