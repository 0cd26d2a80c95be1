"""Compiled kernels serve again until something that they hold has changed."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests import behind, kernel_cache
from tests.kernel_cache import keep, key, use

FUSION = "airground/dense/__pycache__/fusion.step_row-12.py311.1.nbc"
ROTATIONS = "airground/slam/__pycache__/so3.log-54.py311.nbi"


@pytest.fixture
def cache(tmp_path: Path) -> Path:
    """Two kernels kept."""
    tree = tmp_path / "tree"
    for kernel in (FUSION, ROTATIONS):
        (tree / kernel).parent.mkdir(parents=True)
        (tree / kernel).write_text(kernel)
    keep(tmp_path / "cache", tree)
    return tmp_path / "cache"


def found(root: Path) -> set[str]:
    return {str(file.relative_to(root)) for file in root.rglob("*.nb[ic]")}


def changed(monkeypatch: pytest.MonkeyPatch, file: str) -> None:
    def other(of: str) -> bytes:
        return b"other" if of == file else behind.digest(of)

    monkeypatch.setattr(kernel_cache, "digest", other)


def test_kernels_of_the_same_sources_serve_again(cache: Path, tmp_path: Path) -> None:
    stale = tmp_path / "clone" / "sim/sensors/__pycache__/depth._measure-1.py311.nbi"
    stale.parent.mkdir(parents=True)
    stale.touch()
    use(cache, tmp_path / "clone")
    assert found(tmp_path / "clone") == {FUSION, ROTATIONS}
    assert (tmp_path / "clone" / FUSION).read_text() == FUSION


@pytest.mark.parametrize(
    ("file", "left"),
    [
        ("airground/dense/fusion.py", {ROTATIONS}),
        ("airground/core/camera.py", {ROTATIONS}),  # what fusion imports imports it
        ("airground/slam/so3.py", {FUSION}),
        ("airground/slam/monocular.py", {FUSION, ROTATIONS}),
        ("requirements.lock", set()),
    ],
)
def test_a_change_of_what_they_hold_drops_them(
    file: str, left: set[str], cache: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    changed(monkeypatch, file)
    use(cache, tmp_path / "clone")
    assert found(tmp_path / "clone") == left


def test_kernels_of_other_sources_are_not_kept_any_longer(
    cache: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    before = key("airground/slam/so3.py")
    changed(monkeypatch, "airground/slam/so3.py")
    assert key("airground/slam/so3.py") != before
    keep(cache, tmp_path / "tree")
    assert len(list((cache / "airground/slam/so3.py").iterdir())) == 1
    assert not (cache / "airground/slam/so3.py" / before).exists()


def test_nothing_kept_is_no_error(tmp_path: Path) -> None:
    use(tmp_path / "cache", tmp_path / "clone")
    keep(tmp_path / "cache", tmp_path / "clone")
    assert list((tmp_path / "cache").iterdir()) == []
