"""Looks over the machine: what works, what is missing, and what to do about it."""

from __future__ import annotations

import os
import platform
import shutil
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from enum import Enum
from pathlib import Path

from airground.core.scratch_folder import ScratchFolder
from evaluation.setup.environment import usable_cores
from evaluation.setup.system_libraries import SYSTEM_LIBRARIES

MIN_MEMORY_GIB = 4.0
MIN_DISK_GIB = 4.0

MUJOCO_FRAME = """
import mujoco, numpy as np
from airground.core.camera import PinholeCamera
from airground.core.se3 import SE3
from sim.recording.render import Renderer, with_cameras
spec = mujoco.MjSpec()
spec.worldbody.add_geom(type=mujoco.mjtGeom.mjGEOM_BOX, size=[.1, .1, .1])
spec.worldbody.add_light(pos=[0, 0, 3])
camera = PinholeCamera(80, 60, 70.0, 70.0, 40.0, 30.0)
looking_down = SE3(np.diag([1.0, -1.0, -1.0]), np.array([0.0, 0.0, 1.0]))
with Renderer(with_cameras(spec, {"c": camera})) as renderer:
    picture, depth = renderer.draw("c", looking_down)
assert picture.max() > 0, "the picture is black"
assert abs(depth[30, 40] - 0.9) < 1e-3, f"depth of the box is {depth[30, 40]} m instead of 0.9 m"
"""

PYRENDER_FRAME = """
import numpy as np, pyrender, trimesh
scene = pyrender.Scene(ambient_light=[1.0, 1.0, 1.0])
scene.add(pyrender.Mesh.from_trimesh(trimesh.creation.box((.2, .2, .2))))
pose = np.eye(4)
pose[2, 3] = 1.0
scene.add(pyrender.PerspectiveCamera(yfov=1.0), pose=pose)
renderer = pyrender.OffscreenRenderer(80, 60)
colour, depth = renderer.render(scene)
centre = float(depth[30, 40])
assert abs(centre - 0.9) < 1e-2, f"depth of the box is {centre} m instead of 0.9 m"
renderer.delete()
"""

NUMBA_LOOP = """
import numba, numpy as np
@numba.njit(parallel=True)
def total(values):
    result = 0.0
    for i in numba.prange(len(values)):
        result += values[i]
    return result
assert total(np.ones(1000)) == 1000
print(numba.threading_layer(), numba.get_num_threads(), "threads")
"""


class Health(Enum):
    """How bad a finding is."""

    FINE = "ok"
    POOR = "poor"
    BROKEN = "missing"


@dataclass(frozen=True)
class Finding:
    """One thing that was looked at, what was found, and what to do about it; empty when fine."""

    what: str
    health: Health
    detail: str
    remedy: str = ""


def examine() -> list[Finding]:
    """Look at everything; takes some seconds, since pictures are rendered."""
    return [
        python(),
        cores(),
        memory(),
        disk(Path.cwd()),
        *libraries(),
        *rendering(),
        threading(),
    ]


def show(findings: list[Finding]) -> None:
    """Print a table and, below, what to do."""
    from rich.console import Console
    from rich.table import Table

    colours = {Health.FINE: "green", Health.POOR: "yellow", Health.BROKEN: "red"}
    table = Table(box=None, pad_edge=False, header_style="bold")
    for heading in ("what", "", "found"):
        table.add_column(heading, overflow="fold")
    for f in findings:
        colour = colours[f.health]
        table.add_row(f.what, f"[{colour}]{f.health.value}[/{colour}]", f.detail)
    console = Console(soft_wrap=False)
    console.print(table)
    for finding in findings:
        if finding.health != Health.FINE:
            console.print(f"{finding.what}: {finding.remedy}", markup=False, highlight=False)


def python() -> Finding:
    return Finding("python", Health.FINE, f"{platform.python_version()} on {platform.machine()}")


def cores() -> Finding:
    return Finding("cores", Health.FINE, f"{usable_cores()} of {os.cpu_count()}")


def memory() -> Finding:
    gib = os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE") / 2**30
    remedy = f"have at least {MIN_MEMORY_GIB:g} GiB of memory"
    return _found("memory", gib >= MIN_MEMORY_GIB, f"{gib:.1f} GiB", remedy, Health.POOR)


def disk(folder: Path) -> Finding:
    gib = shutil.disk_usage(folder).free / 2**30
    remedy = f"free {MIN_DISK_GIB:g} GiB: a minute of recording takes about 2 GiB"
    detail = f"{gib:.1f} GiB free in {folder}"
    return _found("disk", gib >= MIN_DISK_GIB, detail, remedy, Health.POOR)


def libraries() -> Iterator[Finding]:
    for library in SYSTEM_LIBRARIES:
        fine = library.present()
        detail = "found" if fine else f"needed by {library.needed_by}"
        remedy = f"install {library.package} (sudo apt-get install {library.package})"
        otherwise = Health.BROKEN if library.required else Health.POOR
        yield _found(library.soname, fine, detail, remedy, otherwise)


def rendering() -> Iterator[Finding]:
    """Render a frame each with EGL and OSMesa; one of the two suffices."""
    results = {
        (name, backend): _try(script, PYOPENGL_PLATFORM=backend)
        for name, script in (("mujoco", MUJOCO_FRAME), ("pyrender", PYRENDER_FRAME))
        for backend in ("egl", "osmesa")
    }
    for (name, backend), (works, said) in results.items():
        other = "osmesa" if backend == "egl" else "egl"
        if works:
            yield Finding(f"{name} with {backend}", Health.FINE, "renders")
        elif results[name, other][0]:
            remedy = f"not needed; PYOPENGL_PLATFORM={other} works"
            yield Finding(f"{name} with {backend}", Health.POOR, said, remedy)
        else:
            remedy = "install libegl1 libgl1 libgl1-mesa-dri, or libosmesa6"
            yield Finding(f"{name} with {backend}", Health.BROKEN, said, remedy)


def threading() -> Finding:
    works, said = _try(NUMBA_LOOP)
    return _found("numba", works, said, "install libgomp1, then the locked packages anew")


def _found(
    what: str, fine: bool, detail: str, remedy: str, otherwise: Health = Health.BROKEN
) -> Finding:
    return Finding(what, Health.FINE, detail) if fine else Finding(what, otherwise, detail, remedy)


def _try(script: str, **environment: str) -> tuple[bool, str]:
    """Whether a Python script runs, in a process of its own, and its last line."""
    with ScratchFolder() as scratch:
        file = scratch.path / "attempt.py"
        file.write_text(script, encoding="utf-8")
        try:
            done = subprocess.run(
                [sys.executable, str(file)],
                env={**os.environ, **environment},
                capture_output=True,
                text=True,
                timeout=120,
                check=False,
            )
        except subprocess.TimeoutExpired:
            return False, "no answer within two minutes"
    said = (done.stdout if done.returncode == 0 else done.stderr).strip().splitlines()
    if done.returncode < 0:
        return False, f"died of signal {-done.returncode}"
    return done.returncode == 0, said[-1] if said else ""
