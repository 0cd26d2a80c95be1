"""Every parameter of the pipeline: its unit, its default and the section it comes from.

The defaults are the preset `best`. `paper()` returns the constants as published, and
`paper_literal()` the same with sigma read in square metres.
"""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field

Positive = Annotated[float, Field(gt=0)]
Fraction = Annotated[float, Field(ge=0, le=1)]
Count = Annotated[int, Field(ge=1)]
PresetName = Literal["best", "paper", "paper_literal"]


class Section(BaseModel):
    """A frozen group of parameters that rejects unknown keys."""

    model_config = ConfigDict(frozen=True, extra="forbid", use_attribute_docstrings=True)


class KeyframeSlam(Section):
    """Keyframe-based SLAM, one section for each robot (Sec. IV)."""

    corners: Count = 250
    """Largest number of corners followed at a time."""
    corner_spacing_px: Count = 26
    """Least distance between newly chosen corners [px]."""
    corner_sigma_px: Positive = 0.7
    """Standard deviation of a corner's position [px]."""
    patch_px: Count = 17
    """Side of the patch that is compared around a corner [px]."""
    keyframe_parallax_px: Positive = 22.0
    """Median motion of the corners since the last keyframe, without that by turning, from which
    on a frame becomes a keyframe [px]."""
    keyframe_share: Fraction = 0.6
    """Share of the last keyframe's corners below which a frame becomes a keyframe."""
    keyframe_interval_s: Positive = 0.5
    """Longest time between keyframes with an IMU [s]; preintegration is linear only for a while."""
    window: Count = 10
    """Number of newest keyframes that local bundle adjustment moves."""
    fixed_keyframes: Count = 12
    """Number of older keyframes with the same points, which stay fixed in that adjustment."""
    iterations: Count = 6
    """Largest number of steps of local bundle adjustment."""
    min_parallax_deg: Positive = 1.0
    """Least angle between the rays of a point that enters the map [deg]."""
    min_points: Count = 15
    """Number of map points in an image below which tracking is lost."""
    reused_keyframes: Annotated[int, Field(ge=0, le=10)] = 3
    """Number of old keyframes whose points are searched in a new one; 0 for none."""


class MonocularSlam(KeyframeSlam):
    """The MAV's SLAM: one camera and an IMU."""

    scale: Literal["tight", "filter"] = "tight"
    """Metric scale by preintegrated inertial factors in bundle adjustment, or by a Kalman
    filter beside visual odometry, as published."""


class RgbdSlam(KeyframeSlam):
    """The ground robot's SLAM: colour and depth."""

    keyframe_parallax_px: Positive = 40.0
    """Median motion of the corners since the last keyframe, without that by turning, from which
    on a frame becomes a keyframe [px]."""
    depth_noise_per_m: Positive = 0.003
    """Standard deviation of measured inverse depth [1/m]."""
    max_depth_m: Positive = 5.0
    """Largest depth that starts a point [m]."""


class ViewSelection(Section):
    """The frames of a depth map, and the depth maps of a surface (Sec. VIII-B)."""

    depth_map_radius_m: Positive = 0.12
    """Largest distance of a depth map's views from its reference view [m]."""
    fusion_radius_m: Positive = 0.70
    """Largest distance of a surface's depth maps from the first of them [m]."""
    both_sides: bool = True
    """Whether to use the views before the reference too: they see what the later ones do not."""
    max_views: Annotated[int, Field(ge=1, le=40)] = 8
    """Largest number of views per depth map; they are spread evenly over the radius."""
    min_views: Count = 4
    """Least number of views of a depth map."""
    min_baseline_m: Positive = 0.06
    """Least baseline of a depth map's farthest view, across the line of sight [m]."""
    depth_map_spacing_m: Positive = 0.12
    """Distance between reference views [m]."""
    max_scale_sigma: Positive = 0.02
    """Standard deviation of the MAV's metric scale from which on depth maps are made, as a share;
    poses are given out earlier."""
    min_depth_m: Positive = 0.5
    """Least distance of the scene for a reconstruction [m]; below it the MAV takes off or lands."""


class PlaneSweep(Section):
    """Depth maps from many close views (Sec. V)."""

    hypotheses: Count = 100
    """Depth planes, evenly spaced in inverse depth."""
    window_px: Count = 3
    """Side of the window over which the photometric error is averaged [px at half resolution]."""
    truncation: Annotated[float, Field(gt=0, le=100)] = 40.0
    """Largest absolute intensity difference of a sample [grey levels]."""
    one_side_penalty: Positive = 1.0
    """With both sides: cost difference from which on the better side decides alone, because an
    edge hides the scene from the other [grey levels]."""
    smoothing: Literal["none", "semiglobal"] = "semiglobal"
    """Smoothing of the costs along image rows and columns before the best plane is chosen."""
    step_penalty: Positive = 0.5
    """Semi-global smoothing: cost of one plane between neighbouring pixels [grey levels]."""
    jump_penalty: Annotated[float, Field(gt=0, le=25)] = 5.0
    """Semi-global smoothing: cost of more than one plane between neighbours [grey levels]."""
    edge_levels: Positive = 5.0
    """Semi-global smoothing: intensity difference of neighbours at which the cost of a jump is
    halved [grey levels]."""
    max_curvature_sigma_m: Positive = 0.1
    """Largest standard deviation of a depth, by the curvature of its cost [m]."""


class Fusion(Section):
    """Distance fields in a histogram and their TV-L1 fusion (Sec. V, Eq. 1)."""

    voxels: tuple[Count, Count, Count] = (376, 240, 150)
    """Size of the volume of interest: columns, rows, planes [voxels]."""
    truncation_m: Positive = 0.06
    """Distance at which the field reaches -1 or 1 [m]."""
    bins: Annotated[int, Field(ge=2, le=8)] = 8
    """Histogram bins over [-1, 1]."""
    data_weight: Positive = 0.26
    """Lambda of Eq. 1."""
    iterations: Count = 8
    """Number of primal-dual steps."""
    min_observations: Count = 2
    """Least number of depth maps that see a surface point."""
    min_depth_maps: Count = 3
    """Least number of depth maps of a surface."""


class GroundMapping(Section):
    """The ground robot's map from RGB-D frames and poses (Sec. IV)."""

    keyframe_distance_m: Positive = 0.05
    """Distance from the last keyframe from which on a frame becomes a keyframe [m]."""
    keyframe_angle_deg: Positive = 3.0
    """Turn from the last keyframe from which on a frame becomes a keyframe [deg]."""
    keyframes_a_view: Count = 2
    """Largest number of keyframes within that distance and turn, so that the map grows with the
    space and not with time."""
    max_depth_m: Positive = 4.0
    """Largest depth to keep [m]; farther away it is too noisy."""
    voxel_m: Positive = 0.02
    """Side of a voxel of the distance field, and of the augmented map [m]."""
    truncation_m: Positive = 0.08
    """Distance from the surface at which the distance field ends [m]."""
    min_keyframes: Count = 3
    """Least number of keyframes that see a surface point; with fewer it counts as noise."""
    follow_distance_m: Positive = 0.002
    """Correction of a keyframe's position from which on the map is fused anew [m]."""
    follow_angle_deg: Positive = 0.05
    """Correction of a keyframe's rotation from which on the map is fused anew [deg]."""


class HeightMaps(Section):
    """Gravity-aligned height maps (Sec. VI-A)."""

    cells_per_m: Positive = 25.0
    """Resolution of height maps [cells/m]."""
    dilate_holes: bool = True
    """Whether holes are filled with the highest of their 3 x 3 neighbours."""


class Localization(Section):
    """Cost map and Monte Carlo localization (Sec. VI)."""

    cost: Literal["zmssd", "ncc", "likelihood", "channels"] = "channels"
    """Cost of a hypothesis: Eq. 2; one minus the normalized correlation of the heights; minus the
    logarithm of how much likelier the heights are if they correlate so than if not at all; or the
    same of the area where they agree, in channels of 0.1 m above the floor."""
    patch_m: Positive = 0.15
    """With `likelihood` and `channels`: side of a patch whose heights count as one measurement [m].
    """
    sigma: Positive = 1.0
    """Sigma of Eq. 5, in units of the cost (m^2 for zmssd, none for the others)."""
    sigma_units: Literal["cost", "minmax"] = "cost"
    """Units of sigma: those of the cost, or the range of the costs that are compared (at first
    those of the whole cost map, then those of the particles)."""
    min_overlap: Fraction = 0.15
    """Smallest overlap, as a fraction of the aerial map's filled cells."""
    search_radius_m: Positive = 4.5
    """Half the side of the square searched around the ground robot [m]."""
    particles: Annotated[int, Field(ge=2)] = 200
    """M of Eq. 4."""
    motion_noise_m: Positive = 0.03
    """Standard deviation of the motion model per axis [m] (Eq. 6)."""
    heading: Literal["known", "search"] = "known"
    """Heading: known from the magnetometers, or searched as a third dimension of u."""
    headings: Count = 360
    """Number of headings over the full circle, if searched."""
    heading_noise_deg: Positive = 1.0
    """Standard deviation of the heading's motion model, if searched [deg]."""
    joint_maps: Count = 4
    """So many newest aerial surfaces are laid over the ground map as one: for the reported pose,
    and if the heading is searched for all of localization."""
    estimate: Literal["mean", "mode"] = "mode"
    """Reported pose: mean of all particles; or of those around the densest place, moved to the
    nearby position and heading, known or searched, where the heights fit best."""
    redrawn_fraction: Fraction = 0.5
    """Share of the particles that each update draws from the current cost map."""
    min_mode_share: Fraction = 0.6
    """With `mode`: least share of the particles around the reported position."""
    converged_spread_m: Positive = 0.15
    """Largest standard deviation of these particles (with `mean`: of all) for a claim [m]."""
    min_claimed_overlap: Fraction = 0.3
    """Smallest overlap for a claim, as a fraction of the newest aerial map's filled cells alone,
    also where several are laid over the ground map as one."""
    min_relief_m: Positive = 0.03
    """Least standard deviation of the heights over the overlap for a claim [m]."""
    min_correlation: Fraction = 0.4
    """Least correlation of the heights at the estimate for a claim."""
    min_evidence: Annotated[float, Field(ge=0)] = 12.0
    """With `likelihood` and `channels`: least logarithm of the likelihood ratio at the estimate for
    a claim [nat], against independent heights as they are in the overlap. Some 10 000 places and
    headings differ by 0.3 m or more, so one of them reaches ln 10 000 = 9 by chance. `min_lead`
    asks more where others reach more."""
    min_lead: Annotated[float, Field(ge=0)] = 6.0
    """With `likelihood` and `channels`: how much likelier the estimate must be than any place that
    is 0.5 m or 15 deg off, for a claim [nat]."""
    min_agreement: Fraction = 0.2
    """Least agreement of the heights beyond chance for a claim (Cohen's kappa,
    core/agreement.py), also of the newest aerial map's alone where several are laid as one."""
    max_self_similarity: Fraction = 0.8
    """Largest correlation of the aerial map with itself, and of the ground map with itself, shifted
    to another place, for a claim."""

    @property
    def in_nat(self) -> bool:
        """Whether costs are logarithms of likelihood ratios."""
        return self.cost in ("likelihood", "channels")

    @property
    def maps_together(self) -> int:
        """Number of newest aerial surfaces that particles see as one: with a known heading one,
        since the particles alone join them well."""
        return self.joint_maps if self.heading == "search" else 1


class Refinement(Section):
    """Point-to-plane ICP and what it needs to converge (Sec. VII). On wide and on sparse maps all
    lengths are multiplied by one factor (`extent_m`, `spacing_m`)."""

    extent_m: Positive = 10.0
    """Extent of the aerial surface up to which lengths hold; beyond, they grow with it [m]."""
    spacing_m: Positive = 0.06
    """Median distance of neighbouring points, after `voxel_m`, up to which lengths hold as given;
    beyond, they grow with it [m]."""
    local_search: bool = True
    """Whether the height maps around the start are searched before ICP."""
    local_search_radius_m: Positive = 0.6
    """Half the side of that search [m]."""
    local_search_angle_deg: Annotated[float, Field(ge=0, le=180)] = 16.0
    """Largest turn of that search to either side, in steps of 4 deg [deg]."""
    local_search_cells_per_m: Positive = 25.0
    """Resolution of that search [cells/m]."""
    local_search_tolerance_m: Positive = 0.3
    """Largest difference of heights that counts in that search; larger ones count as this [m]."""
    level_prior: bool = True
    """Whether only the heading of a prior's rotation is kept: both maps are gravity-aligned."""
    voxel_m: Positive = 0.03
    """Side of the cubes over which clouds are averaged before ICP [m]."""
    max_distance_m: Positive = 0.1
    """Largest distance of correspondences in the first step [m]."""
    final_distance_m: Positive = 0.05
    """Largest distance of correspondences in the last steps [m]."""
    trim: Fraction = 0.75
    """Share of the closest correspondences that is kept in the last steps."""
    iterations: Count = 30
    """Largest number of ICP steps."""
    min_inliers: Fraction = 0.35
    """Least share of the aerial points over the ground map that lie on it."""
    min_agreement: Fraction = 0.2
    """Least agreement of the maps beyond chance (Cohen's kappa, core/agreement.py)."""
    near_claim: bool = True
    """Whether an alignment is refused that leads away from the place that localization claims."""


class Config(Section):
    """The whole pipeline."""

    preset: PresetName = "best"
    monocular_slam: MonocularSlam = MonocularSlam()
    rgbd_slam: RgbdSlam = RgbdSlam()
    view_selection: ViewSelection = ViewSelection()
    plane_sweep: PlaneSweep = PlaneSweep()
    fusion: Fusion = Fusion()
    ground_mapping: GroundMapping = GroundMapping()
    height_maps: HeightMaps = HeightMaps()
    localization: Localization = Localization()
    refinement: Refinement = Refinement()


PRINTED_SIGMA = 0.08
"""Sigma of Eq. 5 as printed, without a unit (Sec. VI-B)."""
PAPER_SIGMA = 0.001
"""Sigma of Eq. 5 [m^2] with which the paper's success rates come out together: the printed
number in square decimetres is 0.0008 m^2, in square metres the filter never converges
(docs/reproduce_the_paper.md)."""


def paper() -> Config:
    """The constants as published; what the paper leaves open stays at our defaults."""
    return _as_published("paper", PAPER_SIGMA)


def paper_literal() -> Config:
    """The constants as published, with sigma read in the unit of the cost [m^2]."""
    return _as_published("paper_literal", PRINTED_SIGMA)


def _as_published(preset: PresetName, sigma: float) -> Config:
    return Config(
        preset=preset,
        monocular_slam=MonocularSlam(scale="filter"),
        view_selection=ViewSelection(
            both_sides=False, max_views=16, min_views=5, max_scale_sigma=0.03
        ),
        plane_sweep=PlaneSweep(hypotheses=200, window_px=5, smoothing="none"),
        fusion=Fusion(min_observations=1),
        height_maps=HeightMaps(cells_per_m=50.0),
        localization=Localization(
            cost="zmssd",
            sigma=sigma,
            search_radius_m=3.0,
            min_overlap=0.5,
            joint_maps=1,
            estimate="mean",
            redrawn_fraction=0.0,
        ),
        refinement=Refinement(
            local_search=False, level_prior=False, max_distance_m=0.3, near_claim=False
        ),
    )


PRESETS = {"best": Config, "paper": paper, "paper_literal": paper_literal}
