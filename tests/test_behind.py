"""What a slow test is said to depend on exists, and leaves nothing out without a reason."""

from __future__ import annotations

import ast
from dataclasses import dataclass
from pathlib import Path

import pytest

from tests.behind import files_of_subject, helpers, is_in, modules_of, python_behind
from tests.sources import ROOT, imports, nodes, sources


@dataclass(frozen=True)
class Subject:
    """`pytest.mark.subject` as written in a test file."""

    test_file: str
    line: int
    named: tuple[str, ...]
    but: dict[str, str]


def subjects() -> list[Subject]:
    found = []
    for file in sources("tests"):
        if "mark.subject" not in (ROOT / file).read_text(encoding="utf-8"):
            continue
        for node in nodes(file):
            if isinstance(node, ast.Call) and ast.unparse(node.func) == "pytest.mark.subject":
                named = ast.literal_eval(ast.Tuple(node.args, ast.Load()))
                keywords = {k.arg: ast.literal_eval(k.value) for k in node.keywords}
                assert keywords.keys() <= {"but"}, f"{file}:{node.lineno}: {keywords}"
                found.append(Subject(file, node.lineno, named, keywords.get("but", {})))
    return found


SUBJECTS = [pytest.param(one, id=f"{Path(one.test_file).stem}-{one.line}") for one in subjects()]


@pytest.mark.parametrize("subject", SUBJECTS)
def test_what_a_subject_names_exists(subject: Subject) -> None:
    assert subject.named or subject.but
    assert [path for path in (*subject.named, *subject.but) if not (ROOT / path).exists()] == []
    assert all(subject.but.values()), "a reason for each that is left out"


@pytest.mark.parametrize("subject", [s for s in SUBJECTS if s.values[0].named])
def test_a_subject_covers_what_its_test_imports(subject: Subject) -> None:
    """Or gives the reason for leaving it out."""
    needed = {
        modules_of(name)[-1]
        for file in helpers(subject.test_file)
        for name in imports(file)
        if not name.startswith("tests.") and modules_of(name)
    }
    depended = files_of_subject(subject.test_file, subject.named, subject.but)
    left_out = {f for f in needed - depended if not any(is_in(f, path) for path in subject.but)}
    assert left_out == set()


def test_a_test_depends_on_what_it_imports_directly_or_not() -> None:
    behind = python_behind("tests/slam/test_robustness.py")
    assert {"airground/slam/monocular.py", "airground/slam/so3.py", "tests/conftest.py"} <= behind
    assert "tests/slam/hard_sequences.py" in behind
    assert not [file for file in behind if file.startswith(("sim/", "evaluation/measure/"))]


def test_a_test_that_starts_a_process_depends_on_all_sources() -> None:
    everything = set(sources("airground", "sim", "evaluation", "tests"))
    assert python_behind("tests/evaluation/measure/test_sweep_command.py") == everything
    assert set(sources("airground")) <= python_behind("tests/evaluation/test_python_api.py")


def test_a_subject_has_the_files_below_its_folders_and_the_helpers_of_its_test() -> None:
    file = "tests/evaluation/measure/test_measure.py"
    found = files_of_subject(file, ("scenes", "evaluation/setup"), {})
    assert {file, "tests/conftest.py", "tests/evaluation/measure/fake.py"} <= found
    assert {"scenes/tiny.toml", "evaluation/setup/doctor.py", "requirements.lock"} <= found
    assert "airground/slam/so3.py" not in found
    program = files_of_subject(file, ("tests/digest_of_results.py",), {})
    assert {"airground/dense/fusion.py", "tests/slam/bundle_problems.py"} <= program


def test_what_a_subject_leaves_out_is_all_that_it_leaves_out() -> None:
    file = "tests/evaluation/measure/test_suite.py"
    everything = files_of_subject(file, (), {})
    found = files_of_subject(file, (), {"airground/slam": "for this test"})
    assert everything - found == {f for f in everything if f.startswith("airground/slam/")}
    assert "airground/slam/monocular.py" in everything
