"""A simulated flight as a recording: stored on disk, or rendered while it is read."""

from __future__ import annotations

import errno
import os
import shutil
from collections import defaultdict
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path

import mujoco
import numpy as np
from numpy.typing import NDArray

from airground.core.freed_memory import hand_back_memory
from airground.core.messages import ImuSamples, MagneticSamples
from airground.core.scratch_folder import ScratchFolder
from airground.errors import AirgroundError, InputError
from airground.io import recording_writer
from airground.io.header import FrameCounts, Header
from airground.io.images import metric_depth
from airground.io.lens import Lens
from airground.io.recording import Recording
from airground.io.registration import Registration
from sim.geometry.edges import find_edges
from sim.partial_folder import partial_folder
from sim.recording.bodies_in_view import add_bodies
from sim.recording.carried_lamp import CarriedLamp
from sim.recording.depth_camera import depth_tiles
from sim.recording.drone_shadow import DroneShadow
from sim.recording.frame_pool import FrameServer, FrameWorkers, frame_workers, make_frames
from sim.recording.frames import FramePlan, WorldFiles
from sim.recording.light_meter import meter_camera, meter_name, with_exposure
from sim.recording.render import with_cameras
from sim.recording.truth import write_truth
from sim.recording.view_tiles import tiles_of
from sim.robots.carried import carried_back
from sim.robots.motion import RATE_HZ, ROBOTS, STEP_NS, Motion, Robot, simulate_motion
from sim.robots.moving_bodies import moving_bodies, read_bodies
from sim.robots.robot_motion import RobotMotion
from sim.scene import Scene
from sim.sensors.faults import Fault, faulty_field, faulty_imu, of_robot, placed
from sim.sensors.faulty_frames import FaultyFrames
from sim.sensors.imu import measure_field, measure_imu
from sim.sensors.miscalibration import MAGNETOMETER_RATE_HZ, calibrate
from sim.sensors.presets import CAMERA_RATE_HZ, SensorPreset
from sim.world.world import World, build_world, flight_world, painted, unlit_world

# The cameras share no trigger; no exposure may reach beyond the motion.
FIRST_IMAGE_NS: dict[Robot, int] = {"mav": 50_000_000, "ground": 55_000_000}
_MARGIN_NS = 20_000_000
_OF_FAULTS = 3
"""Number of the generator of faults; 1 and 2 are those of the cameras."""

Progress = Callable[[int, int], None]
"""Consumer of progress: frames rendered, frames in all."""


@dataclass(frozen=True)
class Flight:
    """What a recording is made from; `record` explains the fields (`sensors` is its preset).

    `dials` are stated in the header; scene and preset have been turned already.
    """

    scene: Scene
    seed: int
    flight: int
    sensors: SensorPreset
    duration_s: float | None = None
    dials: Mapping[str, float] | None = None
    robots: tuple[Robot, ...] = ROBOTS


def record(
    scene: Scene,
    seed: int,
    preset: SensorPreset,
    out: Path,
    duration_s: float | None = None,
    workers: int | None = None,
    *,
    flight: int = 0,
    dials: Mapping[str, float] | None = None,
    robots: tuple[Robot, ...] = ROBOTS,
    progress: Progress | None = None,
) -> Path:
    """Record one flight over a scene; the same arguments give the same bytes.

    Args:
        scene: Scene of the world.
        seed: Decides the heap and, with `flight`, motion and noise.
        preset: Quality of the sensors.
        out: Folder to make; it must not exist. On any failure nothing is left behind.
        duration_s: Cuts the recording short; the scene's own length if None.
        workers: Number of processes that render; one per usable core if None.
        flight: Number of the flight over the same heap.
        dials: What has been turned in scene and preset, for the header.
        robots: Robots that are recorded; each one's bytes are the same with and without the other.
        progress: Consumer of the rendering's progress.

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
    what = Flight(scene, seed, flight, preset, duration_s, dials, robots)
    try:
        with partial_folder(out) as temporary, frame_workers(workers) as pool:
            header, plan, plain = write_all_but_images(temporary, what)
            plan = with_models(plan, plain)
            digests = _render(plan, pool, progress)
            for files in plan.world_files():
                files.model.unlink()
                files.edges.unlink()
            recording_writer.finish(temporary, header, digests)
            temporary.rename(out)
    except OSError as error:
        if error.errno == errno.ENOSPC:
            raise AirgroundError(f"{out}: the disk is full; nothing was recorded") from None
        raise AirgroundError(f"{out}: cannot be recorded: {error}") from None
    return out


@contextmanager
def rendered(flight: Flight, workers: int) -> Iterator[Recording]:
    """The recording that `record` would make, message by message the same.

    Its folder, with samples and truth but without images, lasts as long as the context.
    The workers' drawing stays a few frames ahead of the reader.

    Raises:
        AirgroundError: One line on what was wrong.
    """
    with (
        ScratchFolder() as folder,
        FrameWorkers(workers) as pool,
    ):
        root = folder.path
        try:
            header, plan, plain = write_all_but_images(root, flight)
            recording_writer.finish(root, header, {})
            plan = with_models(plan, plain)
        except OSError as error:
            raise AirgroundError(f"{root}: the flight cannot be prepared there: {error}") from None
        ground = header.calibration.ground
        images = _DrawnImages(
            FrameServer(plan, pool), ground.depth.units_per_m, ground.registration()
        )
        yield Recording.open(root, images)


@dataclass(frozen=True)
class _DrawnImages:
    """The images as they would be read from disk, where PNG loses nothing."""

    frames: FrameServer
    depth_units_per_m: float
    registration: Registration | None

    def mav(self, index: int) -> NDArray[np.uint8]:
        return self.frames.mav(index)

    def ground(self, index: int) -> tuple[NDArray[np.uint8], NDArray[np.float32]]:
        colour, depth_units = self.frames.ground(index)
        depth = metric_depth(depth_units, self.depth_units_per_m)
        return colour, depth if self.registration is None else self.registration.registered(depth)


def write_all_but_images(root: Path, flight: Flight) -> tuple[Header, FramePlan, World]:
    """Simulate a flight and write its samples, lists and truth into an empty folder.

    Returns the header, to be written last; the plan of the images, which needs `with_models`;
    and the ground robot's world, without pictures.
    """
    scene, preset, seeds = flight.scene, flight.sensors, (flight.seed, flight.flight)
    motion_rng, calibration_rng, mav_rng, ground_rng = np.random.default_rng(seeds).spawn(4)
    # Without pictures, so that an impossible flight is reported at once.
    world = build_world(scene, flight.seed, pictures=False)
    flown = flight_world(world, pictures=False)
    motion = simulate_motion(world, scene, int(motion_rng.integers(2**63)), flight.duration_s)
    faults = placed(preset.faults, motion.duration_s, np.random.default_rng([*seeds, _OF_FAULTS]))
    motion = _carried(motion, faults)
    sensors = calibrate(
        scene.mav.camera_f_px, motion.mav.mounting, motion.ground.mounting, preset, calibration_rng
    )
    taken = {
        robot: _within(motion, image_stamps(motion.stamps_ns, first)[:: preset.every], preset)
        for robot, first in FIRST_IMAGE_NS.items()
    }
    frames = {r: FaultyFrames.of(taken[r], of_robot(faults, r)) for r in flight.robots}
    bodies = moving_bodies(scene, world, motion)
    write_truth(root, world, flown, motion, sensors.true, faults, bodies)
    nominal = sensors.nominal
    rngs: dict[Robot, np.random.Generator] = {"mav": mav_rng, "ground": ground_rng}
    for robot, left in frames.items():
        if not len(left.stamps_ns):
            raise InputError(f"{scene.name}: no image of the {robot} is left by its faults")
        own = of_robot(faults, robot)
        samples = _samples(motion.stamps_ns, motion.robot(robot), preset, own, rngs[robot])
        if robot == "mav":
            recording_writer.write_mav(root, nominal.mav, left.stamps_ns, *samples)
        else:
            recording_writer.write_ground(root, nominal.ground, left.stamps_ns, *samples)
    plan = FramePlan(
        recording=root,
        worlds=_world_files(root, one=flown is world),
        motion=root / "truth/motion.npz",
        true=sensors.true,
        driver=sensors.driver,
        preset=preset,
        seeds=seeds,
        taken_ns=taken,
        frames=frames,
        unlit=_unlit_files(root) if scene.ground.lamp > 0 else None,
        lamp=CarriedLamp(scene.ground.lamp, scene.ground.lamp_beam_deg),
        shadows={r: DroneShadow(scene.light_of(r)) for r in ROBOTS} if scene.mav.shadow else {},
    )
    header = Header(
        scene=scene.name,
        seed=flight.seed,
        flight=flight.flight,
        sensors=preset.name,
        dials=dict(flight.dials) if flight.dials else None,
        duration_s=motion.duration_s,
        frames=FrameCounts(**{r: len(frames[r].stamps_ns) if r in frames else 0 for r in ROBOTS}),
        calibration=nominal,
        digests={},
    )
    return header, plan, world


def _world_files(root: Path, one: bool) -> dict[Robot, WorldFiles]:
    """Files of the world that each robot sees; the same if they see one world."""
    drive = WorldFiles(root / "world.mjb", root / "edges.npz")
    flight = WorldFiles(root / "world_mav.mjb", root / "edges_mav.npz")
    return {"mav": drive if one else flight, "ground": drive}


def _unlit_files(root: Path) -> WorldFiles:
    return WorldFiles(root / "world_unlit.mjb", root / "edges_unlit.npz")


def with_models(plan: FramePlan, plain: World) -> FramePlan:
    """Paint the worlds once for all processes, for pictures take long to make, and meter their
    light; the plan is then complete. What painting took of memory is handed back before drawing."""
    drive = painted(plain)
    _store_model(plan, plan.worlds["ground"], drive)
    if plan.worlds["mav"] != plan.worlds["ground"]:
        _store_model(plan, plan.worlds["mav"], flight_world(drive))
    if plan.unlit is not None:
        _store_model(plan, plan.unlit, unlit_world(drive))
    del drive
    hand_back_memory()
    return with_exposure(plan)


def _store_model(plan: FramePlan, files: WorldFiles, world: World) -> None:
    light = world.scene.light_of("mav" if files == plan.worlds["mav"] else "ground")
    lenses: dict[Robot, Lens] = {
        "mav": plan.true.mav.camera.lens(),
        "ground": plan.true.ground.camera.lens(),
    }
    tiles = [tile for robot, lens in lenses.items() for tile in tiles_of(robot, lens)]
    tiles += depth_tiles(plan.true.ground)
    cameras = {tile.name: tile.camera for tile in tiles}
    if plan.preset.exposure is not None:
        cameras |= {meter_name(robot): meter_camera(lens) for robot, lens in lenses.items()}
    spec = world.spec.copy()
    add_bodies(spec, read_bodies(plan.motion.parent), None if files == plan.unlit else light)
    model = with_cameras(spec, cameras)
    # MuJoCo only prints a warning when the disk is full.
    if shutil.disk_usage(plan.recording).free < mujoco.mj_sizeModel(model):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
    mujoco.mj_saveModel(model, str(files.model), None)
    find_edges((world.vertices, world.triangles), world.terrain).save(files.edges)


def image_stamps(motion_stamps_ns: NDArray[np.int64], first_ns: int) -> NDArray[np.int64]:
    """(N,) stamps of a camera, every 1/30 s to the nanosecond, as far as the motion goes."""
    last_ns = int(motion_stamps_ns[-1]) - _MARGIN_NS
    count = max(int((last_ns - first_ns) * 1e-9 * CAMERA_RATE_HZ) + 1, 0)
    if count == 0:
        raise InputError(f"duration_s must be at least {(first_ns + _MARGIN_NS) * 1e-9} s")
    return first_ns + np.rint(np.arange(count) * (1e9 / CAMERA_RATE_HZ)).astype(np.int64)


def _within(
    motion: Motion, stamps_ns: NDArray[np.int64], preset: SensorPreset
) -> NDArray[np.int64]:
    """The stamps whose rows, exposures and depth images end before the motion does."""
    readout_s = max(preset.mav_optics.readout_s, preset.ground_optics.readout_s)
    exposure_s = preset.image.exposure_s if preset.image else 0.0
    if preset.exposure is not None:
        exposure_s = max(exposure_s, preset.exposure.exposure_s[1])
    clock_ns = preset.calibration.time_offset_ns if preset.calibration else 0
    reach_ns = round((readout_s + exposure_s) * 0.5e9) + clock_ns + preset.depth_delay_ns
    return stamps_ns[stamps_ns + reach_ns <= motion.stamps_ns[-1]]


def _carried(motion: Motion, faults: Sequence[Fault]) -> Motion:
    """The motion with the ground robot carried back where a fault says so."""
    for fault in faults:
        if fault.kind == "carried":
            start, end = fault.start_ns // STEP_NS, fault.end_ns // STEP_NS
            back, step_s = round(fault.strength * RATE_HZ), STEP_NS * 1e-9
            ground = carried_back(motion.ground, start, end, back, step_s)
            motion = replace(motion, ground=ground)
    return motion


def _samples(
    stamps_ns: NDArray[np.int64],
    robot: RobotMotion,
    preset: SensorPreset,
    faults: Sequence[Fault],
    rng: np.random.Generator,
) -> tuple[ImuSamples, MagneticSamples]:
    ideal = ImuSamples(stamps_ns, robot.gyro_imu, robot.specific_force_imu)
    every = slice(None, None, round(RATE_HZ / MAGNETOMETER_RATE_HZ))
    field = measure_field(
        stamps_ns[every], robot.field_imu[every], robot.anomaly_imu[every], preset.magnetic, rng
    )
    imu = measure_imu(ideal, preset.imu, rng)
    return faulty_imu(imu, faults), faulty_field(field, faults)


def _render(
    plan: FramePlan, pool: FrameWorkers | None, progress: Progress | None
) -> dict[str, dict[str, str]]:
    """Make all frames; returns the digests of the images by folder and name."""
    digests: dict[str, dict[str, str]] = defaultdict(dict)
    done, total = 0, sum(len(frames.stamps_ns) for frames in plan.frames.values())
    for files in make_frames(plan, pool):
        for file in files:
            digests[file.folder][file.name] = file.digest
        done += len({file.name for file in files})
        if progress is not None:
            progress(done, total)
    return digests
