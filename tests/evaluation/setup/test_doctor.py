"""The doctor tells a healthy machine from one that lacks something."""

from __future__ import annotations

import subprocess
import sys

import pytest

from evaluation.setup import doctor
from evaluation.setup.doctor import Finding, Health
from evaluation.setup.system_libraries import SystemLibrary

MISSING = SystemLibrary("libmissing.so.7", "libmissing7", "everything")


def test_one_missing_library_is_named_with_its_package(monkeypatch: pytest.MonkeyPatch) -> None:
    optional = SystemLibrary("libspare.so.7", "libspare7", "little", required=False)
    monkeypatch.setattr(doctor, "SYSTEM_LIBRARIES", (MISSING, optional))
    broken, poor = doctor.libraries()
    assert (broken.health, poor.health) == (Health.BROKEN, Health.POOR)
    assert "apt-get install libmissing7" in broken.remedy


def test_one_way_to_render_suffices(monkeypatch: pytest.MonkeyPatch) -> None:
    def only_osmesa(script: str, **environment: str) -> tuple[bool, str]:
        return environment["PYOPENGL_PLATFORM"] == "osmesa", "no device"

    monkeypatch.setattr(doctor, "_try", only_osmesa)
    healths = {finding.what: finding.health for finding in doctor.rendering()}
    assert healths["mujoco with osmesa"] == Health.FINE
    assert healths["mujoco with egl"] == Health.POOR
    monkeypatch.setattr(doctor, "_try", lambda *_, **__: (False, "no device"))
    assert {finding.health for finding in doctor.rendering()} == {Health.BROKEN}


def test_remedies_are_shown_below_the_table(capsys: pytest.CaptureFixture[str]) -> None:
    doctor.show([Finding("a", Health.FINE, "x"), Finding("b", Health.BROKEN, "y", "install [b]")])
    said = capsys.readouterr().out
    assert "b: install [b]" in said
    assert "a: " not in said


@pytest.mark.slow
def test_this_machine_is_healthy() -> None:
    broken = [f for f in doctor.examine() if f.health == Health.BROKEN]
    assert broken == []


def test_libraries_are_listed_without_any_package_installed() -> None:
    """Set-up runs the file with a bare Python, outside the checkout's import path."""
    file = doctor.__file__.replace("doctor.py", "system_libraries.py")
    done = subprocess.run(
        [sys.executable, "-S", "-I", file], capture_output=True, text=True, check=True
    )
    assert done.stderr == ""
