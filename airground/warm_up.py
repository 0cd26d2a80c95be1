"""Compiles the kernels of all stages before the first frame arrives."""

from __future__ import annotations

import numpy as np

from airground.config import Config
from airground.dense.warm_up import warm_up_dense
from airground.ground_map.warm_up import warm_up_ground_map
from airground.localization.warm_up import warm_up_localization
from airground.refinement.warm_up import warm_up_refinement
from airground.slam.warm_up import warm_up_slam


def warm_up(config: Config, rng: np.random.Generator) -> None:
    """Compile tracking and mapping.

    Args:
        config: Configuration that will run.
        rng: Source of the data to compile with.
    """
    warm_up_slam(rng)
    warm_up_mapping(config, rng)


def warm_up_mapping(config: Config, rng: np.random.Generator) -> None:
    """Compile everything above tracking; arguments as in `warm_up`."""
    warm_up_dense(config)
    warm_up_ground_map()
    warm_up_localization(config, rng)
    warm_up_refinement(config)
