"""Which process of a command does what, read from `/proc`."""

from __future__ import annotations

import os
import signal
from enum import Enum
from pathlib import Path

DRIVERS = ("libEGL_", "libOSMesa", "libgallium", "swrast_dri")
"""Starts of the names of OpenGL's drivers, which a process loads when it opens a context. The
libraries before them (`libEGL.so`) are loaded with Open3D too, in processes that draw nothing."""


class Role(Enum):
    """What a process is for. Renderers are processes: of `simulate`, and of commands that render
    as they measure."""

    PARENT = "parent"
    WORKER = "worker"
    RENDERER = "renderer"
    GROUP = "all"
    """Not one process: a signal to all of them, as Ctrl-C sends it."""


def session(leader: int) -> list[int]:
    """Live processes of the session that a process leads."""
    found = []
    for path in Path("/proc").iterdir():
        if path.name.isdigit():
            try:
                state, _, _, number = (
                    path.joinpath("stat").read_text().rpartition(")")[2].split()[:4]
                )
            except (OSError, ValueError):
                continue
            if int(number) == leader and state != "Z":
                found.append(int(path.name))
    return sorted(found)


def role(pid: int, leader: int) -> Role | None:
    """What a process of a session does; None for helpers of the interpreter, and after its end."""
    if pid == leader:
        return Role.PARENT
    try:
        words = Path(f"/proc/{pid}/cmdline").read_bytes()
        maps = Path(f"/proc/{pid}/maps").read_text()
    except OSError:
        return None
    if not words or b"resource_tracker" in words:
        return None
    return Role.RENDERER if any(f"/{name}" in maps for name in DRIVERS) else Role.WORKER


def send(number: signal.Signals, wanted: Role, leader: int, choice: int) -> Role | None:
    """Send a signal to a process of a session.

    Args:
        number: The signal.
        wanted: Role of the process; without one of it, a worker or the parent gets the signal.
        leader: Process that leads the session.
        choice: Which of several processes of that role, counted round.

    Returns:
        The role of the process that got it; None if all had ended.
    """
    try:
        if wanted is Role.GROUP:
            os.killpg(leader, number)
            return wanted
        roles = {pid: role(pid, leader) for pid in session(leader)}
        for one in dict.fromkeys((wanted, Role.WORKER, Role.PARENT)):
            found = [pid for pid, has in roles.items() if has is one]
            if found:
                os.kill(found[choice % len(found)], number)
                return one
    except ProcessLookupError:
        pass
    return None


def name_of(pid: int) -> str:
    try:
        return Path(f"/proc/{pid}/cmdline").read_bytes().replace(b"\0", b" ").decode()[:100]
    except OSError:
        return "ended"
