"""The sections of the configuration that each verb uses.

They are listed beside `airground.config` and `evaluation.setup.settings`, which are slow to import.
"""

from __future__ import annotations

SLAM = {"mav": "monocular_slam", "ground": "rgbd_slam"}
"""The section of each robot's SLAM."""
PIPELINE = (
    *SLAM.values(),
    "view_selection",
    "plane_sweep",
    "fusion",
    "ground_mapping",
    "height_maps",
    "localization",
    "refinement",
)
USED: dict[str, tuple[str, ...]] = {
    "run": (*PIPELINE, "oracle", "rerun"),
    "live": (*PIPELINE, "oracle"),
    "track": tuple(SLAM.values()),
    "reproduce": (*PIPELINE, "oracle", "reference", "protocol"),
    "sweep": (*PIPELINE, "oracle", "reference", "protocol"),
}


def unused(verb: str, section: str) -> str:
    """That a verb does not use a section, and which verbs do; empty if it does, or none does."""
    users = [name for name, used in USED.items() if section in used]
    if not users or verb in users:
        return ""
    return f"{verb} does not use section {section}, which is of: {', '.join(users)}"
