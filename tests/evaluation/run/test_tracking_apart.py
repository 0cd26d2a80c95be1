"""Tracking in other processes equals tracking here, and the death of a process is an error."""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from airground.config import Config
from airground.core.messages import GroundImage, MavImage
from airground.errors import AirgroundError
from airground.io.recording import Recording
from airground.tracking import TrackedFrame
from evaluation.run import tracking_apart
from evaluation.run.drops import Stamps, nothing_dropped
from evaluation.run.tracking import TrackingHere, TrackingTask
from evaluation.run.tracking_apart import TrackingApart
from evaluation.setup.setups import Setup
from sim.recording.truth import Truth


def task(path: Path, dropped: tuple[int, ...] = ()) -> TrackingTask:
    recording = Recording.open(path)
    left_out = Stamps(mav=frozenset(dropped))
    drops = nothing_dropped(recording).model_copy(update={"dropped": left_out})
    setup = Setup(Config(), "slam, exact mav")
    return TrackingTask(recording, Truth.open(path), setup, 3, drops)


def content(frame: TrackedFrame) -> list[object]:
    """Contents of a frame, arrays as bytes."""
    image, pose = frame.image, frame.pose
    arrays = [image.image] if isinstance(image, MavImage) else [image.colour, image.depth]
    if pose.T_map_camera is not None:
        arrays.append(pose.T_map_camera.matrix())
    if pose.covariance is not None:
        arrays.append(pose.covariance)
    if frame.trajectory is not None:
        arrays += [frame.trajectory.stamps_ns, frame.trajectory.translations]
    rest = (frame.robot, frame.stamp_ns, pose.tracking, pose.corrected, frame.north_rad)
    return [*rest, *((array.shape, array.dtype, array.tobytes()) for array in arrays)]


def test_frames_and_report_equal_those_of_tracking_here(
    small: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(tracking_apart, "FRAMES_AHEAD", 5)  # slots are used again
    dropped = (int(Recording.open(small).mav.camera_stamps[4]),)
    here = TrackingHere(task(small, dropped))
    wanted = [content(frame) for frame in here.frames()]
    report = here.report()
    with TrackingApart(task(small, dropped)) as apart:
        apart.wait_until_ready()
        found = [content(frame) for frame in apart.frames()]
        other_report = apart.report()
    assert len(wanted) == 2 * 21 - 1
    assert found == wanted
    assert other_report.ground is not None
    assert report.ground is not None
    assert other_report.ground.translations.tobytes() == report.ground.translations.tobytes()
    for robot, one in report.tracked.items():
        other = other_report.tracked[robot]
        assert other.slam == one.slam == (robot == "ground")
        assert len(other.front_end.durations_ms) == len(one.front_end.durations_ms)
        assert [stamp for stamp, _ in other.final_poses()] == [s for s, _ in one.final_poses()]
    assert other_report.peak_memory_mib > 50
    assert other_report.processor_s > 0


def test_tracking_processes_do_not_import_large_libraries() -> None:
    """Each import would cost some 100 MiB in each of two processes."""
    script = (
        "import sys; import evaluation.run.tracking_apart\n"
        "print(sorted({'open3d', 'mujoco', 'pandas', 'evo', 'matplotlib'} & set(sys.modules)))"
    )
    done = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, check=True
    )
    assert done.stdout.strip() == "[]"


def test_frames_can_be_kept(small: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """An image that was handed over keeps its pixels when its slot is used again."""
    monkeypatch.setattr(tracking_apart, "FRAMES_AHEAD", 2)
    with TrackingApart(task(small)) as apart:
        apart.wait_until_ready()
        frames = []
        for frame in apart.frames():
            if not frames:
                time.sleep(1.0)  # tracking would be far ahead, if it did not wait for a free slot
            frames.append(frame)
    recording = Recording.open(small)
    for frame in frames:
        if isinstance(frame.image, GroundImage):
            stored = recording.ground.image_at(frame.stamp_ns)
            assert frame.image.colour.tobytes() == stored.colour.tobytes()
            assert frame.image.depth.tobytes() == stored.depth.tobytes()
        else:
            stored_grey = recording.mav.image_at(frame.stamp_ns).image
            assert frame.image.image.tobytes() == stored_grey.tobytes()


@pytest.mark.slow
@pytest.mark.subject(but={"airground/slam": "the process dies or fails whatever it tracks"})
def test_an_unreadable_image_raises_the_same_error(small: Path, tmp_path: Path) -> None:
    broken = tmp_path / "broken"
    shutil.copytree(small, broken)
    sorted((broken / "mav0" / "cam0" / "data").iterdir())[9].write_bytes(b"no picture")
    with pytest.raises(AirgroundError) as here:
        list(TrackingHere(task(broken), ahead=0).frames())
    with TrackingApart(task(broken)) as apart:
        apart.wait_until_ready()
        with pytest.raises(AirgroundError) as there:
            list(apart.frames())
    assert str(there.value) == str(here.value)
    assert ".png" in str(here.value)


@pytest.mark.slow
@pytest.mark.subject(but={"airground/slam": "the process dies or fails whatever it tracks"})
@pytest.mark.parametrize("robot", [0, 1])
def test_a_death_raises_an_error_and_all_processes_end_with_the_block(
    small: Path, robot: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    # No process finishes its 21 images before it is killed: each waits for a free slot.
    monkeypatch.setattr(tracking_apart, "FRAMES_AHEAD", 2)
    with TrackingApart(task(small)) as apart:
        apart.wait_until_ready()
        pids = apart.pids
        frames = apart.frames()
        next(frames)
        os.kill(pids[robot], signal.SIGKILL)
        with pytest.raises(AirgroundError, match="its process died"):
            list(frames)
    assert len(pids) == 2
    assert not any(Path(f"/proc/{pid}").exists() for pid in pids)


@pytest.mark.slow
@pytest.mark.subject(but={"airground/slam": "the process dies whatever it would track"})
def test_a_death_before_the_start_is_the_same_error(small: Path) -> None:
    with TrackingApart(task(small)) as apart:
        apart.wait_until_ready()
        os.kill(apart.pids[1], signal.SIGKILL)
        os.waitid(os.P_PID, apart.pids[1], os.WEXITED | os.WNOWAIT)
        with pytest.raises(AirgroundError, match="airground-mav: its process died"):
            list(apart.frames())
