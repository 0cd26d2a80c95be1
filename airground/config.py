"""Every parameter of the pipeline: its unit, its default and the section it comes from.

The defaults are the preset `best`; `paper()` returns the constants as published.
"""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field

Positive = Annotated[float, Field(gt=0)]
Fraction = Annotated[float, Field(ge=0, le=1)]
Count = Annotated[int, Field(ge=1)]


class Section(BaseModel):
    """A frozen group of parameters that refuses keys it does not know."""

    model_config = ConfigDict(frozen=True, extra="forbid", use_attribute_docstrings=True)


class KeyframeSlam(Section):
    """Keyframe-based SLAM, one of these for each robot (Sec. IV)."""

    corners: Count = 250
    """Corners followed at a time."""
    corner_spacing_px: Count = 26
    """They are at least this far apart when chosen [px]."""
    corner_sigma_px: Positive = 0.7
    """Standard deviation of a corner's place [px]."""
    patch_px: Count = 17
    """Side of the patch around a corner that is compared [px]."""
    keyframe_parallax_px: Positive = 22.0
    """A frame becomes a keyframe when its points moved this far, turning apart [px] ..."""
    keyframe_share: Fraction = 0.6
    """... or when fewer than this share of the last keyframe's corners is left ..."""
    keyframe_interval_s: Positive = 0.5
    """... or, with an IMU, after this time: preintegration does not stay linear for ever [s]."""
    window: Count = 10
    """Keyframes that local bundle adjustment moves ..."""
    fixed_keyframes: Count = 12
    """... and older ones that saw the same points and hold them."""
    iterations: Count = 6
    """Most steps of local bundle adjustment."""
    min_parallax_deg: Positive = 1.0
    """Rays of a point must cross under this angle before it enters the map [deg]."""
    min_points: Count = 15
    """Fewer map points than this in an image, and tracking is lost."""
    reused_keyframes: Annotated[int, Field(ge=0, le=10)] = 3
    """Old keyframes whose points are looked for in a new one; 0 never returns to old points."""


class MonocularSlam(KeyframeSlam):
    """The MAV's SLAM: one camera and an IMU."""

    scale: Literal["tight", "filter"] = "tight"
    """Metric scale by preintegrated inertial factors in bundle adjustment, or by a Kalman
    filter beside visual odometry, as published."""


class RgbdSlam(KeyframeSlam):
    """The ground robot's SLAM: colour and depth."""

    keyframe_parallax_px: Positive = 40.0
    """A frame becomes a keyframe when its points moved this far, turning apart [px] ..."""
    depth_noise_per_m: Positive = 0.003
    """Standard deviation of inverse depth as measured [1/m]."""
    max_depth_m: Positive = 5.0
    """Depth beyond this does not start a point [m]."""


class ViewSelection(Section):
    """Which frames make a depth map, and which depth maps a surface (Sec. VIII-B)."""

    depth_map_radius_m: Positive = 0.12
    """Views within this distance of the reference view join its depth map [m]."""
    fusion_radius_m: Positive = 0.70
    """Depth maps within this distance of the first are fused [m]."""
    both_sides: bool = True
    """Also use the views before the reference, so that what one side hides the other sees."""
    max_views: Annotated[int, Field(ge=1, le=40)] = 8
    """At most this many views a depth map: a view joins when it is far enough from the
    others for this many to spread over the radius."""
    min_views: Count = 4
    """Fewer views than this make no depth map."""
    min_baseline_m: Positive = 0.06
    """Nor do views that all lie closer than this, across the line of sight [m]."""
    depth_map_spacing_m: Positive = 0.12
    """The next reference view is this far from the last [m]."""
    min_depth_m: Positive = 0.5
    """Nothing is reconstructed while the scene is closer than this (take-off) [m]."""


class PlaneSweep(Section):
    """Depth maps from many close views (Sec. V)."""

    hypotheses: Count = 100
    """Depth planes, evenly spaced in inverse depth."""
    window_px: Count = 3
    """Side of the window over which the photometric error is averaged [px, half resolution]."""
    truncation: Annotated[float, Field(gt=0, le=100)] = 40.0
    """Absolute intensity difference above which a sample counts no more [grey levels]."""
    one_side_penalty: Positive = 1.0
    """With both sides: cost above which the views of the better side decide alone, the
    other being blocked by an edge [grey levels]."""
    smoothing: Literal["none", "semiglobal"] = "semiglobal"
    """Whether costs are joined along image rows and columns before the winner is picked."""
    step_penalty: Positive = 0.5
    """Semi-global: cost of moving by one plane between neighbours [grey levels]."""
    jump_penalty: Annotated[float, Field(gt=0, le=25)] = 5.0
    """Semi-global: cost of moving farther [grey levels] ..."""
    edge_levels: Positive = 5.0
    """... halved where the image changes by this much [grey levels]."""
    max_curvature_sigma_m: Positive = 0.1
    """Depth is dropped where the cost's minimum is so flat that its deviation exceeds this [m]."""


class Fusion(Section):
    """Distance fields in a histogram and their TV-L1 fusion (Sec. V, Eq. 1)."""

    voxels: tuple[Count, Count, Count] = (376, 240, 150)
    """Size of the volume of interest [voxels]."""
    truncation_m: Positive = 0.06
    """Distance at which the field reaches -1 or 1 [m]."""
    bins: Annotated[int, Field(ge=2, le=8)] = 8
    """Histogram bins over [-1, 1]."""
    data_weight: Positive = 0.26
    """Lambda of Eq. 1."""
    iterations: Count = 8
    """Primal-dual steps."""
    min_observations: Count = 2
    """A surface point needs at least this many depth maps to count."""
    min_depth_maps: Count = 3
    """Fewer depth maps than this are not fused."""


class GroundMapping(Section):
    """The ground robot's map from RGB-D frames and poses (Sec. IV)."""

    keyframe_distance_m: Positive = 0.05
    """A frame joins the map once the camera moved this far [m] ..."""
    keyframe_angle_deg: Positive = 3.0
    """... or turned this far [deg]."""
    keyframes_a_view: Count = 2
    """No more than this many keyframes are as near to each other as that, however often the
    robot comes back, so that the map grows with what was seen and not with time."""
    max_depth_m: Positive = 4.0
    """Depth beyond this is too noisy to keep [m]."""
    voxel_m: Positive = 0.02
    """Side of a voxel of the distance field, and of the augmented map [m]."""
    truncation_m: Positive = 0.08
    """The distance field ends this far from the surface [m]."""
    min_keyframes: Count = 3
    """A surface that fewer keyframes saw is noise."""
    follow_distance_m: Positive = 0.002
    """The map is fused anew once SLAM moved one of its keyframes this far [m] ..."""
    follow_angle_deg: Positive = 0.05
    """... or turned it this much [deg]."""


class HeightMaps(Section):
    """Gravity-aligned height maps (Sec. VI-A)."""

    cells_per_m: Positive = 25.0
    """Resolution [cells/m]."""
    dilate_holes: bool = True
    """Fill holes by the highest of the 3 x 3 neighbours."""


class Localization(Section):
    """Cost map and Monte Carlo localization (Sec. VI)."""

    cost: Literal["zmssd", "ncc"] = "ncc"
    """Eq. 2, or one minus the normalized correlation of the overlapping heights."""
    sigma: Positive = 0.05
    """Eq. 5, in units of the cost (m^2 for zmssd, none for ncc)."""
    sigma_units: Literal["cost", "minmax"] = "cost"
    """Whether sigma divides the cost itself, or the cost scaled to [0, 1] over what is
    compared: all of the map at first, the particles afterwards."""
    min_overlap: Fraction = 0.3
    """Smallest overlap, as a fraction of the aerial map's filled cells."""
    search_radius_m: Positive = 3.0
    """Half the side of the square searched around the ground robot [m]."""
    particles: Count = 200
    """M of Eq. 4."""
    motion_noise_m: Positive = 0.03
    """Standard deviation of the motion model per axis [m] (Eq. 6)."""
    heading: Literal["known", "search"] = "known"
    """Heading from the magnetometers, or searched as a third dimension of u."""
    headings: Count = 360
    """Headings tried over the full circle when searched."""
    heading_noise_deg: Positive = 1.0
    """Standard deviation of the heading's motion model when searched [deg]."""
    estimate: Literal["mean", "mode"] = "mode"
    """Report the mean of all particles, or of those around the densest place."""
    redrawn_fraction: Fraction = 0.1
    """Share of the particles drawn anew from the current cost map at each update."""
    min_mode_share: Fraction = 0.6
    """With `mode`, at least this share of the particles must be there ..."""
    converged_spread_m: Positive = 0.15
    """... and their standard deviation (with `mean`, that of all) must fall below this [m]."""
    min_relief_m: Positive = 0.03
    """Heights that deviate less than this over the overlap carry no structure [m]."""
    min_correlation: Fraction = 0.4
    """A belief is refused when heights at its estimate correlate less than this."""
    min_agreement: Fraction = 0.2
    """... or agree by less than this beyond chance (Cohen's kappa, core/agreement.py)."""


class Refinement(Section):
    """Point-to-plane ICP and what it needs to converge (Sec. VII)."""

    local_search: bool = True
    """Search the height maps around the start before ICP."""
    local_search_radius_m: Positive = 0.6
    """Half the side of that search [m]."""
    local_search_cells_per_m: Positive = 25.0
    """Its resolution [cells/m]."""
    level_prior: bool = True
    """Both maps are gravity-aligned: keep only the heading of a prior's rotation."""
    voxel_m: Positive = 0.03
    """Clouds are averaged over cubes of this side before ICP [m]."""
    max_distance_m: Positive = 0.3
    """Correspondences farther apart than this are ignored at first [m] ..."""
    final_distance_m: Positive = 0.05
    """... and than this at the end [m]."""
    trim: Fraction = 0.75
    """Share of the closest correspondences that is kept at the final distance."""
    iterations: Count = 30
    """Most ICP steps in all."""
    min_inliers: Fraction = 0.35
    """An alignment is refused when fewer aerial points than this lie on the ground map ..."""
    min_agreement: Fraction = 0.2
    """... or when they agree with it by less than this beyond chance (core/agreement.py)."""


class Config(Section):
    """The whole pipeline."""

    preset: Literal["paper", "best"] = "best"
    monocular_slam: MonocularSlam = MonocularSlam()
    rgbd_slam: RgbdSlam = RgbdSlam()
    view_selection: ViewSelection = ViewSelection()
    plane_sweep: PlaneSweep = PlaneSweep()
    fusion: Fusion = Fusion()
    ground_mapping: GroundMapping = GroundMapping()
    height_maps: HeightMaps = HeightMaps()
    localization: Localization = Localization()
    refinement: Refinement = Refinement()


def paper() -> Config:
    """The constants as published; what the paper leaves open stays at our defaults."""
    return Config(
        preset="paper",
        monocular_slam=MonocularSlam(scale="filter"),
        view_selection=ViewSelection(both_sides=False, max_views=16, min_views=5),
        plane_sweep=PlaneSweep(hypotheses=200, window_px=5, smoothing="none"),
        fusion=Fusion(min_observations=1),
        height_maps=HeightMaps(cells_per_m=50.0),
        localization=Localization(
            cost="zmssd", sigma=0.08, min_overlap=0.5, estimate="mean", redrawn_fraction=0.0
        ),
        refinement=Refinement(local_search=False, level_prior=False),
    )


PRESETS = {"best": Config, "paper": paper}
