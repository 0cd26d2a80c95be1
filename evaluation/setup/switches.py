"""Parameters that change something only where another one has a certain value."""

from __future__ import annotations

from collections.abc import Collection

from airground.config import Config

SEARCHED = ("localization.heading", "search")
IN_NAT = ("localization.cost", ("likelihood", "channels"))
MODE = ("localization.estimate", "mode")
BOTH_SIDES = ("view_selection.both_sides", True)
SEMIGLOBAL = ("plane_sweep.smoothing", "semiglobal")
LOCAL_SEARCH = ("refinement.local_search", True)

SWITCH_OF: dict[str, tuple[str, str | bool | tuple[str, ...]]] = {
    "localization.headings": SEARCHED,
    "localization.heading_noise_deg": SEARCHED,
    "localization.joint_maps": MODE,
    "localization.patch_m": IN_NAT,
    "localization.min_evidence": IN_NAT,
    "localization.min_lead": IN_NAT,
    "localization.min_mode_share": MODE,
    "plane_sweep.one_side_penalty": BOTH_SIDES,
    "plane_sweep.step_penalty": SEMIGLOBAL,
    "plane_sweep.jump_penalty": SEMIGLOBAL,
    "plane_sweep.edge_levels": SEMIGLOBAL,
    "refinement.local_search_radius_m": LOCAL_SEARCH,
    "refinement.local_search_angle_deg": LOCAL_SEARCH,
    "refinement.local_search_cells_per_m": LOCAL_SEARCH,
    "refinement.local_search_tolerance_m": LOCAL_SEARCH,
}
"""The parameter that switches another one on, and with which value or values."""


def switched_off(config: Config, name: str, varied: Collection[str] = ()) -> str:
    """Why the parameter SECTION.NAME changes nothing; empty if it may.

    `varied` are parameters that have several values: what they switch is on for some.
    """
    if name not in SWITCH_OF or SWITCH_OF[name][0] in varied:
        return ""
    switch, on = SWITCH_OF[name]
    section, _, key = switch.partition(".")
    value = getattr(getattr(config, section), key)
    if value in on if isinstance(on, tuple) else value == on:
        return ""
    return f"{name} changes nothing without {condition_of(name)}"


def condition_of(name: str) -> str:
    """What switches a parameter of `SWITCH_OF` on, as `--set` takes it."""
    switch, on = SWITCH_OF[name]
    if isinstance(on, tuple):
        return f"{switch}={' or '.join(on)}"
    return f"{switch}={str(on).lower() if isinstance(on, bool) else on}"
