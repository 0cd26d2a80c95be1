"""What numba has compiled so far."""

from __future__ import annotations

import importlib
import pkgutil

from numba.core.registry import CPUDispatcher


def compiled(*packages: str) -> dict[str, int]:
    """Signatures compiled so far, by kernel of the packages."""
    kernels = {}
    for package in packages:
        folder = importlib.import_module(package).__path__
        for found in pkgutil.walk_packages(folder, f"{package}."):
            for name, value in vars(importlib.import_module(found.name)).items():
                if isinstance(value, CPUDispatcher):
                    kernels[f"{value.__module__}.{name}"] = len(value.signatures)
    return kernels
