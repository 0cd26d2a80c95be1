"""Which system libraries rendering needs, and which of them this machine lacks.

Nothing but the standard library is imported: set-up runs this file with the system's own
Python, before anything is installed (`python3 evaluation/setup/system_libraries.py` prints the
Debian packages that are missing, one a line).
"""

from __future__ import annotations

import ctypes
from dataclasses import dataclass


@dataclass(frozen=True)
class SystemLibrary:
    """A shared library by the name that the loader knows.

    Attributes:
        soname: What the loader is asked for.
        package: The Debian and Ubuntu package that brings it.
        needed_by: What fails without it.
        required: False where something else can take its place.
    """

    soname: str
    package: str
    needed_by: str
    required: bool = True

    def present(self) -> bool:
        try:
            ctypes.CDLL(self.soname)
        except OSError:
            return False
        return True


SYSTEM_LIBRARIES = (
    SystemLibrary("libGL.so.1", "libgl1", "mujoco, open3d, pyrender"),
    SystemLibrary("libEGL.so.1", "libegl1", "rendering without a screen"),
    SystemLibrary("libX11.so.6", "libx11-6", "open3d"),
    SystemLibrary("libXrender.so.1", "libxrender1", "open3d"),
    SystemLibrary("libusb-1.0.so.0", "libusb-1.0-0", "open3d"),
    SystemLibrary("libgomp.so.1", "libgomp1", "numba, open3d, small_gicp"),
    SystemLibrary("libOSMesa.so.8", "libosmesa6", "rendering where EGL fails", required=False),
)


def missing_libraries() -> list[SystemLibrary]:
    return [library for library in SYSTEM_LIBRARIES if not library.present()]


if __name__ == "__main__":
    for missing in missing_libraries():
        print(missing.package)
