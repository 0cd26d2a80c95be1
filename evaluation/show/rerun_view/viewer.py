"""Rerun's own program: its viewer in a window or in a browser, on loopback only.
The SDK's servers (`serve_grpc`, `serve_web_viewer`, `spawn`) listen on every interface without an
option to change that. Rerun's program has one (`--bind`), so that program serves."""

from __future__ import annotations

import os
import socket
import subprocess
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from urllib.parse import quote

import rerun_cli

from airground.errors import AirgroundError, InputError
from evaluation.setup.output import check_new_file
from sim.partial_folder import whole_file

LOOPBACK = "127.0.0.1"
START_S = 30.0
"""Time in which a viewer must start to listen [s]."""
STAY_S = 3.0
"""A viewer listens before it draws; one that cannot draw ends within this time [s]."""
STOP_S = 5.0
"""Time to end after a request, before it is killed [s]."""


@dataclass(frozen=True)
class Ports:
    """Ports of a viewer: for its data (gRPC), and for the page of the web viewer."""

    data: int
    web: int

    @property
    def sink(self) -> str:
        """Address for the data of a running pipeline."""
        return f"rerun+http://{LOOPBACK}:{self.data}/proxy"

    @property
    def page(self) -> str:
        source = quote(f"rerun+http://localhost:{self.data}/proxy", safe="")
        return f"http://localhost:{self.web}/?url={source}"


def program() -> Path:
    """Rerun's program, which comes with its SDK.

    Raises:
        AirgroundError: The installation lacks it.
    """
    path = Path(os.environ.get("RERUN_CLI_PATH", Path(rerun_cli.__file__).with_name("rerun")))
    if not path.is_file():
        raise AirgroundError(f"{path}: rerun's program is missing; install rerun-sdk again")
    return path


def has_screen() -> bool:
    return bool(os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY"))


def show(file: Path) -> int:
    """Open a file in a window; returns the exit code once that is closed."""
    with _running(free_ports(), str(file)) as viewer:
        return viewer.wait()


@contextmanager
def serving(ports: Ports, file: Path | None = None) -> Iterator[subprocess.Popen[bytes]]:
    """Serve the web viewer while the block runs, with a file or with a pipeline's data.

    Raises:
        AirgroundError: The viewer does not start.
    """
    shown = () if file is None else (str(file),)
    web = ("--serve-web", "--web-viewer-port", str(ports.web))
    with _running(ports, *shown, *web) as server:
        _wait_until_open(server, ports.data)
        _wait_until_open(server, ports.web)
        yield server


@contextmanager
def window(ports: Ports, *options: str) -> Iterator[subprocess.Popen[bytes]]:
    """A window for a pipeline's data, which stays open after the block.

    Raises:
        AirgroundError: The viewer does not start, or cannot draw.
    """
    viewer = _start(ports, *options, "--expect-data-soon")
    try:
        _wait_until_open(viewer, ports.data)
        _see_it_stay(viewer)
        yield viewer
    except BaseException:
        _stop(viewer)
        raise


def save(file: Path, out: Path) -> None:
    """Copy a file with its layout, with its chunks joined so that it plays smoothly.

    Raises:
        InputError: `file` is no recording of rerun, or `out` exists or cannot be written.
    """
    check_new_file(out, "--save")
    with whole_file(out) as partial:
        _carry_out("rrd", "optimize", str(file), "-o", str(partial))
        verify(partial)


def verify(file: Path) -> None:
    """Check a file by rerun.

    Raises:
        InputError: The file does not pass.
    """
    _carry_out("rrd", "verify", str(file))


def free_ports() -> Ports:
    """Rerun's usual ports, or others where those are taken."""
    data = _free_port(9876)
    return Ports(data, _free_port(9090))


def _free_port(wanted: int) -> int:
    for port in (wanted, 0):
        with socket.socket() as probe:
            try:
                probe.bind((LOOPBACK, port))
            except OSError:
                continue
            return int(probe.getsockname()[1])
    raise AirgroundError("no free port on loopback")


@contextmanager
def _running(ports: Ports, *words: str) -> Iterator[subprocess.Popen[bytes]]:
    process = _start(ports, *words)
    try:
        yield process
    finally:
        _stop(process)


def _start(ports: Ports, *words: str) -> subprocess.Popen[bytes]:
    # Its log would mix with ours; its exit code reports a failure.
    return subprocess.Popen(
        [str(program()), *words, "--bind", LOOPBACK, "--port", str(ports.data)],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )


def _stop(process: subprocess.Popen[bytes]) -> None:
    process.terminate()
    try:
        process.wait(STOP_S)
    except subprocess.TimeoutExpired:
        process.kill()
        process.wait()


def _wait_until_open(process: subprocess.Popen[bytes], port: int) -> None:
    until = time.monotonic() + START_S
    while time.monotonic() < until:
        if process.poll() is not None:
            raise AirgroundError(f"rerun's viewer ended at once, with exit code {process.poll()}")
        with socket.socket() as probe:
            if probe.connect_ex((LOOPBACK, port)) == 0:
                return
        time.sleep(0.05)
    raise AirgroundError(f"rerun's viewer does not listen on port {port} after {START_S:.0f} s")


def _see_it_stay(process: subprocess.Popen[bytes]) -> None:
    try:
        code = process.wait(STAY_S)
    except subprocess.TimeoutExpired:
        return
    raise AirgroundError(
        f"rerun's viewer ended with exit code {code} when it was to draw; it needs a graphics "
        "driver with Vulkan (mesa-vulkan-drivers where there is no graphics card)"
    )


def _carry_out(*words: str) -> None:
    done = subprocess.run([str(program()), *words], capture_output=True, text=True, check=False)
    if done.returncode:
        lines = (done.stderr or done.stdout).strip().splitlines()
        reason = lines[-1] if lines else f"exit code {done.returncode}"
        raise InputError(f"rerun {' '.join(words[:2])} {words[2]}: {reason}")
