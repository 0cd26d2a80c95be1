"""How fast whole recordings are made: `airground simulate`, its start included."""

from __future__ import annotations

import resource
import subprocess
import sys
import time

from airground.core.scratch_folder import ScratchFolder
from airground.errors import AirgroundError
from airground.io.recording import Recording
from evaluation.bench.report import RecordingSpeed

SCENE = "indoor_a"
DURATION_S = 60.0
RECORDED = {"recording": "nominal", "recording_real": "real"}
"""Rows that make a whole recording: preset of its sensors."""
_COMMAND = "import sys; from evaluation.cli import main; sys.exit(main(sys.argv[1:]))"


def record_anew(
    name: str, threads: int, scene: str = SCENE, duration_s: float = DURATION_S
) -> RecordingSpeed:
    """Make the recording of a row in `RECORDED`, as a user would, and remove it again.

    Raises:
        AirgroundError: It could not be made.
    """
    with ScratchFolder() as folder:
        out = folder.path / scene
        options = ["--sensors", RECORDED[name], "--duration-s", f"{duration_s:g}"]
        options += ["--threads", str(threads), "--out", str(out)]
        command = [sys.executable, "-c", _COMMAND, "simulate", scene, *options]
        before, started = _processor_s(), time.perf_counter()
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        wall_s, cpu_s = time.perf_counter() - started, _processor_s() - before
        if done.returncode:
            raise AirgroundError(f"recording {scene}: {done.stderr.strip().splitlines()[-1]}")
        recording = Recording.open(out)
        images = recording.header.frames.mav + recording.header.frames.ground
        size = sum(file.stat().st_size for file in out.rglob("*") if file.is_file())
    recorded_s = recording.duration_s
    return RecordingSpeed(
        scene=scene,
        sensors=RECORDED[name],
        threads=threads,
        recorded_s=recorded_s,
        wall_s=wall_s,
        cpu_s=cpu_s,
        recorded_s_a_second=recorded_s / wall_s,
        cpu_ms_an_image=1e3 * cpu_s / images,
        mib_a_minute=size / 2**20 * 60 / recorded_s,
    )


def _processor_s() -> float:
    """Processor time of all processes that this one has started and that have ended [s]."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime
