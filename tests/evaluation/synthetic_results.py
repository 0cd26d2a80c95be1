"""Made-up results with the shape of real ones, to develop and test reports on."""

from __future__ import annotations

import numpy as np

from airground.core.belief import Belief, CostMap, HeightMap
from airground.core.camera import PinholeCamera
from airground.core.cloud import PointCloud
from airground.core.se3 import SE3
from airground.core.surface import AerialSurface, DepthMap
from airground.core.trajectory import Trajectory
from evaluation.measure.showcase import LocalizationStep, Showcase
from evaluation.setup.condition import Condition
from evaluation.setup.published import TABLE_I
from evaluation.table.row_writer import RowWriter
from evaluation.table.rows import LIVE_STAGE, ResultTable, Row

BEST = Condition("best", "oracle exact", "nominal", "known")
DRIFT = Condition("best", "oracle with drift", "nominal", "known")
SEARCHED = Condition("best", "oracle exact", "nominal", "search")
LITERAL = Condition("paper_literal", "oracle exact", "nominal", "known")
PAPER = Condition("paper", "oracle exact", "nominal", "known")
CONDITIONS = (BEST, DRIFT, SEARCHED, LITERAL, PAPER)
SCENES = ("indoor_a", "indoor_b", "indoor_c")

TYPICAL_MS = {
    "add_frame": 9,
    "depth_map": 30,
    "ground_map": 6,
    "distance_field": 12,
    "fusion": 190,
    "ray_cast": 8,
    "height_map": 3,
    "cost_map": 5,
    "particles": 2,
    "icp": 210,
    "augmentation": 15,
}


def make_table(
    seed: int = 0, conditions: tuple[Condition, ...] = CONDITIONS, sequences: int = 7
) -> ResultTable:
    """Three scenes of two flights each, and a control scene that never converges."""
    rng = np.random.default_rng(seed)
    rows: list[Row] = []
    for condition in conditions:
        # The sigma as printed hardly localizes; everything else mostly does.
        success = 0.2 if condition == LITERAL else 0.8 if condition == PAPER else 0.97
        for scene in SCENES:
            for flight in range(2):
                rows += _flight(rng, condition, scene, flight, success, sequences)
        rows += _flight(rng, condition, "flat", 0, 0.0, 3, claims=False)
        if condition == BEST:
            rows += [row for scene in SCENES for row in _negatives(condition, scene)]
    return ResultTable.from_rows(rows)


def _flight(
    rng: np.random.Generator,
    condition: Condition,
    scene: str,
    flight: int,
    success: float,
    sequences: int,
    claims: bool = True,
) -> list[Row]:
    rows: list[Row] = []

    def add(stage: str, metric: str, value: float, unit: str, **where: object) -> None:
        rows.append(
            Row(scene, 7, flight, condition, stage, metric, float(value), unit, **where)  # type: ignore[arg-type]
        )

    add("run", "recorded_s", 60.0, "s")
    add("run", "processing_s", 40 + rng.random(), "s")
    add("run", "peak_memory_mib", 900 + 50 * rng.random(), "MiB")
    for stage in TABLE_I:
        if stage.metric in TYPICAL_MS:
            for _ in range(12):
                duration = TYPICAL_MS[stage.metric] * rng.lognormal(0, 0.2)
                add("timing", stage.metric, duration, "ms")
    for index in range(6):
        add("surface", "error_median_m", 0.0035 * rng.lognormal(0, 0.2), "m", trial=index)
        add("surface", "error_p90_m", 0.017 * rng.lognormal(0, 0.2), "m", trial=index)
        add("surface", "completeness", rng.uniform(0.75, 0.9), "", trial=index)
    for sequence in range(sequences):
        works, lost = rng.random() < success, rng.random() < 0.02
        for iteration in range(1, 13):
            where = {"sequence": sequence, "iteration": iteration}
            if lost and iteration > 9:
                note = "the flight gave no further aerial map"
                add("localization", "error_m", np.nan, "m", **where, note=note)
                add("localization", "converged", 0, "", **where, note=note)
                continue
            error = 0.03 * rng.lognormal(0, 0.5) + (0 if works else rng.uniform(0.4, 2.5))
            if works and iteration < 3 and rng.random() < 0.15:
                error += 1.2
            spread = (0.8 / iteration if works else 1.2) * rng.lognormal(0, 0.3)
            converged = claims and spread < 0.15
            note = "" if converged else "particles are spread over more than 0.15 m"
            add("localization", "error_m", error, "m", **where)
            add("localization", "spread_m", spread, "m", **where)
            add("localization", "squared_mahalanobis", 2 * (error / spread) ** 2, "", **where)
            add("localization", "converged", converged, "", **where, note=note)
    for trial in range(12):
        fails = rng.random() < 0.03
        drift = 5 if condition.poses == "oracle with drift" else 1
        start_m = np.linalg.norm(rng.normal(0, 0.2, 3))
        start_deg = np.linalg.norm(rng.normal(0, 3, 3))
        end_m = 0.2 * rng.random() + 0.1 if fails else drift * 0.003 * rng.lognormal(0, 0.4)
        end_deg = 4 * rng.random() + 2 if fails else drift * 0.12 * rng.lognormal(0, 0.4)
        for name, metres, degrees in (
            ("before", start_m, start_deg),
            ("after", end_m, end_deg),
            ("from_truth", drift * 0.0028, drift * 0.11),
        ):
            add("refinement", f"{name}_translation_m", metres, "m", trial=trial)
            add("refinement", f"{name}_rotation_deg", degrees, "deg", trial=trial)
        note = "only 21 % of the aerial points lie on the ground map (at least 35 %)"
        add("refinement", "accepted", not fails, "", trial=trial, note=note if fails else "")
    return rows


def _negatives(condition: Condition, scene: str) -> list[Row]:
    """Cases without a place to find: of 24 localizations one is claimed, of 3 refinements none."""
    rows = []
    for stage in ("no_overlap", "wrong_map"):
        for sequence in range(2):
            for iteration in range(1, 13):
                claimed = float(stage == "wrong_map" and sequence == 1 and iteration == 12)
                where = (scene, 7, 0, condition, stage)
                rows.append(Row(*where, "converged", claimed, "", sequence, iteration))
        for trial in range(3):
            rows.append(Row(scene, 7, 0, condition, stage, "accepted", 0.0, "", trial=trial))
    return rows


def heap(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Height [m] of a made-up heap of boxes."""
    rng = np.random.default_rng(3)
    z = np.zeros(np.broadcast(x, y).shape)
    for _ in range(45):
        cx, cy = rng.uniform(-2.0, 2.0, 2)
        turn, a, b, top = rng.uniform(0, np.pi), *rng.uniform(0.12, 0.32, 2), rng.uniform(0.1, 0.6)
        u = np.cos(turn) * (x - cx) + np.sin(turn) * (y - cy)
        v = -np.sin(turn) * (x - cx) + np.cos(turn) * (y - cy)
        z = np.maximum(z, np.where((np.abs(u) < a) & (np.abs(v) < b), top, 0))
    return z


def make_showcase(seed: int = 0, scale: int = 1) -> Showcase:
    """One made-up flight over `heap`; `scale` divides the image size."""
    rng = np.random.default_rng(seed)
    width, height = 376 // scale, 240 // scale
    camera = PinholeCamera(width, height, 210 / scale, 210 / scale, width / 2, height / 2)
    rays = camera.rays()
    down = np.diag([1.0, -1.0, -1.0])

    def depth_from(eye: np.ndarray) -> np.ndarray:
        depth = np.full((height, width), eye[2])
        for _ in range(6):
            points = eye + (rays * depth[..., None]) @ down.T
            depth = eye[2] - heap(points[..., 0], points[..., 1])
        return depth

    def noisy(depth: np.ndarray, sigma: float, holes: float) -> tuple[np.ndarray, np.ndarray]:
        error = rng.normal(0, sigma, depth.shape) + 0.1 * (rng.random(depth.shape) < 0.03)
        error[rng.random(depth.shape) < holes] = np.nan
        return (depth + error).astype(np.float32), error.astype(np.float32)

    eyes = [np.array([0.1 * i, 0.05 * i, 2.2]) for i in range(4)]
    texture = (110 + 60 * rng.random((height, width))).astype(np.uint8)
    maps, errors = [], []
    for eye in eyes:
        depth, error = noisy(depth_from(eye), 0.012, 0.15)
        image = np.clip(texture + 80 * (depth_from(eye) < 2.1), 0, 255).astype(np.uint8)
        maps.append(DepthMap(0, camera, SE3(down, eye), depth, image, 14))
        errors.append(error)
    fused, surface_error = noisy(depth_from(eyes[0]), 0.004, 0.1)
    points = (eyes[0] + (rays * fused[..., None]) @ down.T).reshape(-1, 3)
    seen = np.isfinite(points).all(axis=1)
    grey = np.repeat(maps[0].image.reshape(-1, 1), 3, axis=1)
    aerial = PointCloud(points[seen].astype(np.float32), grey[seen])
    surface = AerialSurface(9, 0, camera, SE3(down, eyes[0]), fused, aerial, 6)
    aerial_heights, ground_heights, steps = _localization(rng)
    return Showcase(
        scene="synthetic",
        condition=BEST.label(),
        depth_maps=tuple(maps),
        depth_errors=tuple(errors),
        surface=surface,
        surface_error=surface_error,
        aerial_heights=aerial_heights,
        ground_heights=ground_heights,
        steps=steps,
        ground_cloud=_ground_cloud(rng, 40000 // scale**2),
        aerial_cloud=aerial,
        mav_path=_path(np.array([0.0, 0.0, 2.2]), 1.2, down),
        ground_path=_path(
            np.array([0.0, 0.0, 0.7]), 2.4, np.array([[0, 0, -1.0], [1, 0, 0], [0, -1, 0]])
        ),
        mav_image=texture,
        ground_image=np.repeat(texture[..., None], 3, axis=2),
    )


def _localization(
    rng: np.random.Generator,
) -> tuple[HeightMap, HeightMap, tuple[LocalizationStep, ...]]:
    true_u = np.array([0.6, -0.3])
    cells = 25.0
    axis = np.arange(-75, 76) / cells
    x, y = np.meshgrid(axis, axis, indexing="ij")
    ground = heap(x, y)
    ground[(x < -1.5) & (y > 1.0) | (rng.random(x.shape) < 0.1)] = np.nan
    small = np.arange(-20, 21) / cells
    sx, sy = np.meshgrid(small, 0.7 * small, indexing="ij")
    aerial = heap(sx + true_u[0], sy + true_u[1])
    aerial[np.hypot(sx, sy) > 0.85] = np.nan
    steps = []
    for number in range(3):
        u = true_u + 0.1 * number
        costs = 1 - np.exp(-((x - u[0]) ** 2 + (y - u[1]) ** 2) / 0.05)
        costs -= 0.6 * np.exp(-((x + 1) ** 2 + (y - 1) ** 2) / 0.05)
        costs += 0.1 * rng.random(x.shape)
        costs[np.hypot(x, y) > 2.8] = np.nan
        spread = (0.5, 0.15, 0.04)[number]
        particles = np.column_stack([u + spread * rng.normal(size=(200, 2)), np.zeros(200)])
        covariance = np.cov(particles[:, :2].T)
        estimate = np.append(particles[:, :2].mean(axis=0), 0.0)
        belief = Belief(
            number, particles, estimate, covariance, 0.1, 0.0, SE3.identity(), number > 1, "", 0.8
        )
        cost_map = CostMap(costs.astype(np.float32), np.array([-3.0, -3.0]), cells, 0.0, "ncc")
        steps.append(LocalizationStep(cost_map, belief, u))
    origin = np.array([small[0], small[0]])
    return (
        HeightMap(aerial.astype(np.float32), origin, cells),
        HeightMap(ground.astype(np.float32), np.array([-3.0, -3.0]), cells),
        tuple(steps),
    )


def _ground_cloud(rng: np.random.Generator, count: int) -> PointCloud:
    xy = rng.uniform(-2.5, 2.5, (count, 2))
    z = heap(xy[:, 0], xy[:, 1]) * rng.uniform(0, 1, count) ** 0.2
    points = np.column_stack([xy, z])[np.hypot(xy[:, 0], xy[:, 1]) > 0.6]
    colours = np.repeat(rng.integers(60, 220, (len(points), 1)), 3, axis=1).astype(np.uint8)
    return PointCloud(points.astype(np.float32), colours)


def _path(centre: np.ndarray, radius: float, rotation: np.ndarray) -> Trajectory:
    turns = np.linspace(0, 4.5, 120)
    poses = [
        SE3(
            SE3.from_heading(t).rotation @ rotation,
            centre + radius * np.array([np.cos(t), np.sin(t), 0]),
        )
        for t in turns
    ]
    return Trajectory.from_poses(list(range(120)), poses)


def live_rows(mav_dropped: int = 0, survived: bool = True) -> ResultTable:
    """Four images of each robot in a live run of 10 s."""
    out = RowWriter("tiny", 0, 0, BEST)
    for name, slow_ms in (("mav", 250.0), ("ground", 60.0)):
        for posed_ms in (20.0, 20.0, 20.0, slow_ms):
            out.add(LIVE_STAGE, f"{name}_posed_ms", posed_ms, "ms")
            out.add(LIVE_STAGE, f"{name}_mapped_ms", posed_ms + 10, "ms")
        dropped = mav_dropped if name == "mav" else 0
        counts = {"images": 4 + dropped, "dropped": dropped, "lost": 2, "shed": 0, "late": 0}
        for metric, value in counts.items():
            out.add(LIVE_STAGE, f"{name}_{metric}", value, "")
        out.add(LIVE_STAGE, f"{name}_survived", survived or name == "ground", "")
        out.add(LIVE_STAGE, f"{name}_sent_bytes", 2_500_000, "B")
        out.add(LIVE_STAGE, f"{name}_peak_memory_mib", 300, "MiB")
    out.add(LIVE_STAGE, "mapper_peak_memory_mib", 500, "MiB")
    out.add(LIVE_STAGE, "recorded_s", 10.0, "s")
    out.add(LIVE_STAGE, "rate", 1.0, "")
    return ResultTable.from_rows(out.rows)
