"""From a scene to a recording on disk: simulate, store, then render what the sensors see."""

from __future__ import annotations

import errno
import os
import shutil
import tempfile
from collections import defaultdict
from collections.abc import Callable
from pathlib import Path

import mujoco
import numpy as np
from numpy.typing import NDArray

from airground.core.messages import ImuSamples, MagneticSamples
from airground.errors import AirgroundError, InputError
from airground.io import recording_writer
from airground.io.calibration import CalibrationTable
from airground.io.header import FrameCounts, Header
from sim.geometry.edges import find_edges
from sim.recording.frame_pool import make_frames
from sim.recording.frames import FramePlan
from sim.recording.render import with_cameras
from sim.recording.truth import write_truth
from sim.robots.motion import RATE_HZ, Motion, Robot, simulate_motion
from sim.robots.robot_motion import RobotMotion
from sim.scene import Scene
from sim.sensors.imu import measure_imu
from sim.sensors.magnetometer import measure_field
from sim.sensors.miscalibration import CAMERA_RATE_HZ, MAGNETOMETER_RATE_HZ, calibrate
from sim.sensors.presets import SensorPreset
from sim.world.world import build_world

# The cameras share no trigger; no exposure may reach beyond the motion.
FIRST_IMAGE_NS: dict[Robot, int] = {"mav": 50_000_000, "ground": 55_000_000}
_MARGIN_NS = 20_000_000

Progress = Callable[[int, int], None]
"""Consumer of progress: frames rendered, frames in all."""


def record(
    scene: Scene,
    seed: int,
    preset: SensorPreset,
    out: Path,
    duration_s: float | None = None,
    workers: int | None = None,
    *,
    flight: int = 0,
    progress: Progress | None = None,
) -> Path:
    """Record one flight over a scene; the same arguments give the same bytes.

    Args:
        scene: The scene of the world.
        seed: Decides the heap and, with `flight`, motion and noise.
        preset: Quality of the sensors.
        out: The folder to make; it must not exist.
        duration_s: Cuts the recording short; the scene's own length if None.
        workers: Number of processes that render; one per usable core if None.
        flight: Another flight over the same heap.
        progress: Consumer of the rendering's progress.

    Returns:
        `out`. On any failure nothing is left behind.

    Raises:
        AirgroundError: One line on what was wrong.
    """
    workers = len(os.sched_getaffinity(0)) if workers is None else workers
    if workers < 1:
        raise InputError(f"workers must be at least 1, got {workers}")
    if seed < 0 or flight < 0:
        raise InputError(f"seed and flight must not be negative, got {seed} and {flight}")
    out = Path(out)
    if out.exists():
        raise InputError(f"{out}: already exists; name a folder that does not")
    temporary = None
    try:
        out.parent.mkdir(parents=True, exist_ok=True)
        temporary = Path(
            tempfile.mkdtemp(prefix=f".{out.name}.", suffix=".partial", dir=out.parent)
        )
        temporary.chmod(0o755)
        _fill(temporary, scene, seed, flight, preset, duration_s, workers, progress)
        temporary.rename(out)
    except OSError as error:
        if error.errno == errno.ENOSPC:
            raise AirgroundError(f"{out}: the disk is full; nothing was recorded") from None
        raise AirgroundError(f"{out}: cannot be recorded: {error}") from None
    finally:
        if temporary is not None:
            shutil.rmtree(temporary, ignore_errors=True)
    return out


def _fill(
    root: Path,
    scene: Scene,
    seed: int,
    flight: int,
    preset: SensorPreset,
    duration_s: float | None,
    workers: int,
    progress: Progress | None,
) -> None:
    """Write a whole recording into an empty folder."""
    header, plan = write_all_but_images(root, scene, seed, flight, preset, duration_s)
    store_model(plan, scene, seed)
    digests = _render(plan, workers, progress)
    plan.model.unlink()
    plan.edges.unlink()
    recording_writer.finish(root, header, digests)


def write_all_but_images(
    root: Path, scene: Scene, seed: int, flight: int, preset: SensorPreset, duration_s: float | None
) -> tuple[Header, FramePlan]:
    """Simulate a flight and write its samples, lists and truth into an empty folder.

    Returns:
        The header that is to be written last, and what the images are to be made from once
        `store_model` has stored the world.
    """
    motion_rng, calibration_rng, mav_rng, ground_rng = np.random.default_rng([seed, flight]).spawn(
        4
    )
    # Without pictures, so that an impossible flight is reported at once.
    world = build_world(scene, seed, pictures=False)
    motion = simulate_motion(world, scene, int(motion_rng.integers(2**63)), duration_s)
    sensors = calibrate(
        scene.mav.camera_f_px, motion.mav.mounting, motion.ground.mounting, preset, calibration_rng
    )
    stamps = {
        robot: image_stamps(motion.stamps_ns, first) for robot, first in FIRST_IMAGE_NS.items()
    }
    recording_writer.make_folders(root)
    write_truth(root, world, motion, sensors.true)
    nominal = sensors.nominal
    mav_samples = _samples(motion.stamps_ns, motion.mav, preset, mav_rng)
    ground_samples = _samples(motion.stamps_ns, motion.ground, preset, ground_rng)
    recording_writer.write_mav(root, nominal.mav, stamps["mav"], *mav_samples)
    recording_writer.write_ground(root, nominal.ground, stamps["ground"], *ground_samples)
    plan = FramePlan(
        recording=root,
        model=root / "world.mjb",
        edges=root / "edges.npz",
        motion=root / "truth/motion.npz",
        true=sensors.true,
        preset=preset,
        seeds=(seed, flight),
        stamps_ns=stamps,
    )
    return _header(scene, seed, flight, preset, motion, stamps, nominal), plan


def store_model(plan: FramePlan, scene: Scene, seed: int) -> None:
    """Build the world with its pictures once for all processes: they take long to make."""
    world = build_world(scene, seed)
    true = plan.true
    cameras = {"mav": true.mav.camera.pinhole(), "ground": true.ground.camera.pinhole()}
    model = with_cameras(world.spec, cameras)
    # MuJoCo only prints a warning when the disk is full.
    if shutil.disk_usage(plan.recording).free < mujoco.mj_sizeModel(model):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
    mujoco.mj_saveModel(model, str(plan.model), None)
    find_edges((world.vertices, world.triangles), world.terrain).save(plan.edges)


def image_stamps(motion_stamps_ns: NDArray[np.int64], first_ns: int) -> NDArray[np.int64]:
    """(N,) stamps of a camera, every 1/30 s to the nanosecond, as far as the motion goes."""
    last_ns = int(motion_stamps_ns[-1]) - _MARGIN_NS
    count = max(int((last_ns - first_ns) * 1e-9 * CAMERA_RATE_HZ) + 1, 0)
    if count == 0:
        raise InputError(f"duration_s must be at least {(first_ns + _MARGIN_NS) * 1e-9} s")
    return first_ns + np.rint(np.arange(count) * (1e9 / CAMERA_RATE_HZ)).astype(np.int64)


def _samples(
    stamps_ns: NDArray[np.int64], robot: RobotMotion, preset: SensorPreset, rng: np.random.Generator
) -> tuple[ImuSamples, MagneticSamples]:
    ideal = ImuSamples(stamps_ns, robot.gyro_imu, robot.specific_force_imu)
    every = slice(None, None, round(RATE_HZ / MAGNETOMETER_RATE_HZ))
    field = measure_field(
        stamps_ns[every], robot.field_imu[every], robot.anomaly_imu[every], preset.magnetic, rng
    )
    return measure_imu(ideal, preset.imu, rng), field


def _header(
    scene: Scene,
    seed: int,
    flight: int,
    preset: SensorPreset,
    motion: Motion,
    stamps: dict[Robot, NDArray[np.int64]],
    nominal: CalibrationTable,
) -> Header:
    return Header(
        scene=scene.name,
        seed=seed,
        flight=flight,
        sensors=preset.name,
        duration_s=motion.duration_s,
        frames=FrameCounts(mav=len(stamps["mav"]), ground=len(stamps["ground"])),
        calibration=nominal,
        digests={},
    )


def _render(plan: FramePlan, workers: int, progress: Progress | None) -> dict[str, dict[str, str]]:
    """Make all frames; returns the digests of the images by folder and name."""
    digests: dict[str, dict[str, str]] = defaultdict(dict)
    done, total = 0, sum(len(stamps) for stamps in plan.stamps_ns.values())
    for files in make_frames(plan, workers):
        for file in files:
            digests[file.folder][file.name] = file.digest
        done += len({file.name for file in files})
        if progress is not None:
            progress(done, total)
    return digests
