"""`action.yml`: its shell steps run in order, as a runner of GitHub runs them."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import pytest
import yaml

from evaluation.judge.accepted import Accepted, Measured
from tests.evaluation.judge.flights import make_results
from tests.evaluation.judge.test_history import DAY, git, written

ROOT = Path(__file__).parents[1]
ACTION: dict[str, Any] = yaml.safe_load((ROOT / "action.yml").read_text(encoding="utf-8"))
STEPS: list[dict[str, Any]] = ACTION["runs"]["steps"]
AIRGROUND = """#!/usr/bin/env bash
# The suite takes minutes: its results are those of the test.
if [ "$1" = reproduce ]; then echo "$@" > "{asked}"; exec cp -r "{prepared}" "${{@: -1}}"; fi
PYTHONPATH="{root}" exec "{python}" -c "from evaluation.cli import main; main()" "$@"
"""
LONGEST_STEP_S = 600
"""None waits for anything but work; two busy cores take a minute."""
EXPRESSION = re.compile(r"\$\{\{\s*([\w.-]+)\s*\}\}")


@dataclass
class Runner:
    """What GitHub's runner does: expressions, environment, outputs, and the failing step."""

    folder: Path
    inputs: dict[str, str]
    values: dict[str, str] = field(default_factory=dict)
    failed: str = ""

    def run(self) -> Runner:
        for name, option in ACTION["inputs"].items():
            self.values[f"inputs.{name}"] = self.inputs.get(name, option["default"])
        for step in STEPS:
            if "run" in step and self._wanted(step.get("if", "")) and not self.failed:
                self._step(step)
        return self

    @property
    def summary(self) -> str:
        return (self.folder / "summary.md").read_text(encoding="utf-8")

    def _wanted(self, condition: str) -> bool:
        name, _, value = condition.partition(" != ")
        return not condition or self.values[name] != value.strip("'")

    def _step(self, step: dict[str, Any]) -> None:
        out = self.folder / "output"
        out.write_text("")
        given = {
            name: EXPRESSION.sub(lambda found: self.values[found[1]], value)
            for name, value in step.get("env", {}).items()
        }
        runner = {
            "GITHUB_ACTION_PATH": str(self.folder / "action"),
            "GITHUB_WORKSPACE": str(self.folder / "workspace"),
            "GITHUB_OUTPUT": str(out),
            "GITHUB_STEP_SUMMARY": str(self.folder / "summary.md"),
        }
        done = subprocess.run(
            ["bash", "--noprofile", "--norc", "-eo", "pipefail", "-c", step["run"]],
            env=os.environ | runner | given,
            cwd=self.folder / "workspace",
            timeout=LONGEST_STEP_S,
        )
        for line in out.read_text().splitlines():
            name, _, value = line.partition("=")
            self.values[f"steps.{step['id']}.outputs.{name}"] = value
        self.failed = step["name"] if done.returncode else ""


def runner(folder: Path, factors: dict[str, float] | None, **inputs: str) -> Runner:
    """A workspace in git with a remote, and an action of which only the suite is made up."""
    prepared = written(make_results(range(10), factors), folder / "prepared")
    programs = folder / "action" / ".venv" / "bin"
    programs.mkdir(parents=True)
    (programs / "python").symlink_to(sys.executable)
    (programs / "airground").write_text(
        AIRGROUND.format(
            asked=folder / "asked", prepared=prepared, root=ROOT, python=sys.executable
        )
    )
    (programs / "airground").chmod(0o755)
    (folder / "action" / "Makefile").write_text("setup:\n\t@true\n")
    (folder / "action" / "scripts").symlink_to(ROOT / "scripts")
    accepted = Accepted.of(Measured.of(make_results(range(10))), "one", "first", None, DAY)
    accepted.write(folder / "accepted.json")
    (folder / "workspace").mkdir()
    git(folder, "init", "-q", "--bare", "remote.git")
    git(folder / "workspace", "init", "-q")
    git(folder / "workspace", "remote", "add", "origin", str(folder / "remote.git"))
    git(folder / "workspace", "commit", "-q", "--allow-empty", "-m", "first")
    return Runner(folder, {"against": str(folder / "accepted.json"), **inputs})


def test_every_step_says_what_a_runner_needs() -> None:
    assert ACTION["runs"]["using"] == "composite"
    ids = {step["id"] for step in STEPS if "id" in step}
    for step in STEPS:
        assert "name" in step
        assert ("shell" in step) == ("run" in step) != ("uses" in step)
        # Expressions stand in the environment: in a script they would be code.
        assert "${{" not in step.get("run", "")
    for name in EXPRESSION.findall((ROOT / "action.yml").read_text(encoding="utf-8")):
        kind, key, *_ = name.split(".")
        assert key in (ACTION["inputs"] if kind == "inputs" else ids), name


@pytest.mark.slow
def test_unchanged_accuracy_passes_and_publishes(tmp_path: Path) -> None:
    done = runner(tmp_path, None, **{"badge-branch": "badges"}).run()
    assert done.failed == ""
    assert done.values["steps.check.outputs.verdict"] == "no difference seen"
    results = Path(done.values["steps.suite.outputs.results"])
    assert {path.name for path in results.iterdir()} == {
        "suite", "check.json", "check.md", "check.xml", "badge.json", "history",
    }  # fmt: skip
    assert "airground check: No difference seen" in done.summary
    assert "History: 2 revisions; steps: none." in done.summary
    kept = subprocess.run(
        ["git", "show", "badges:badge.json"],
        cwd=tmp_path / "remote.git", capture_output=True, check=True,
    )  # fmt: skip
    assert json.loads(kept.stdout)["message"] == "no difference seen"


@pytest.mark.slow
@pytest.mark.parametrize(
    ("suite", "file"), [("fast", "accepted.json"), ("faults", "accepted_faults.json")]
)
def test_a_suite_is_compared_with_its_own_accepted_results(
    suite: str, file: str, tmp_path: Path
) -> None:
    run = runner(tmp_path, None, suite=suite, against="")
    (tmp_path / "action" / "evaluation").mkdir()
    (tmp_path / "accepted.json").rename(tmp_path / "action" / "evaluation" / file)
    done = run.run()
    assert done.failed == ""
    assert done.values["steps.check.outputs.verdict"] == "no difference seen"
    asked = (tmp_path / "asked").read_text(encoding="utf-8")
    assert f"--suite {suite} " in asked


@pytest.mark.slow
def test_worse_accuracy_fails_at_the_end_with_all_files_written(tmp_path: Path) -> None:
    done = runner(tmp_path, {"error_median_m": 1.4}).run()
    assert done.failed == "Fail if something got worse"
    assert done.values["steps.check.outputs.verdict"] == "worse"
    assert "steps: 1 worse" in done.summary


def publish(workspace: Path, *words: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [str(ROOT / "scripts" / "publish_files"), *words],
        cwd=workspace,
        capture_output=True,
        text=True,
    )


def test_published_files_replace_those_of_the_same_name_only(tmp_path: Path) -> None:
    workspace, remote = tmp_path / "workspace", tmp_path / "remote.git"
    workspace.mkdir()
    git(tmp_path, "init", "-q", "--bare", "remote.git")
    git(workspace, "init", "-q")
    git(workspace, "remote", "add", "origin", str(remote))
    (workspace / "code.py").write_text("code")
    git(workspace, "add", "code.py")
    git(workspace, "commit", "-q", "-m", "first")
    for name, text in (("a", "1"), ("b", "2"), ("a", "3"), ("a", "3")):
        (tmp_path / name).write_text(text)
        assert publish(workspace, "badges", str(tmp_path / name)).returncode == 0
    listed = subprocess.run(
        ["git", "ls-tree", "--name-only", "badges"], cwd=remote, capture_output=True, check=True
    )
    assert listed.stdout.split() == [b"a", b"b"]
    shown = subprocess.run(["git", "show", "badges:a"], cwd=remote, capture_output=True, check=True)
    assert shown.stdout == b"3"
    assert (workspace / "code.py").read_text() == "code"
    assert publish(workspace, "badges").returncode == 2
    assert publish(workspace, "no..branch", str(tmp_path / "a")).returncode != 0
