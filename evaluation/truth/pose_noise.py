"""How wrong an oracle's poses are."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class PoseNoise:
    """How wrong an oracle's poses are.

    Attributes:
        drift_mav_m: RMS of the MAV's slow position error after SE3 alignment [m].
        drift_ground_m: RMS of the ground robot's drift after SE3 alignment [m].
        white_m: Standard deviation of independent position noise per axis and frame [m].
        white_deg: The same of the orientation, per axis [deg].
    """

    drift_mav_m: float = 0.0
    drift_ground_m: float = 0.0
    white_m: float = 0.0
    white_deg: float = 0.0

    def describe(self) -> str:
        """For captions: "exact poses", or what was added to them."""
        parts = []
        if self.drift_mav_m or self.drift_ground_m:
            parts.append(
                f"drift {self.drift_mav_m * 100:g} cm (MAV) and "
                f"{self.drift_ground_m * 100:g} cm (ground) RMS"
            )
        if self.white_m or self.white_deg:
            parts.append(f"noise {self.white_m * 1000:g} mm and {self.white_deg:g} deg a frame")
        return "oracle poses, " + (" and ".join(parts) or "exact")


EXACT = PoseNoise()

PAPER_DRIFT = PoseNoise(drift_mav_m=0.012, drift_ground_m=0.038)
"""What the paper measured for its SLAM (Fig. 9, 10)."""
