"""docs/code_tour.md follows real imports and names real functions."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
PAGE = (ROOT / "docs" / "code_tour.md").read_text(encoding="utf-8")
ROW = re.compile(r"^\| (\d+) \| \[`([\w/]+\.py)`\]\(\S+\) \| (.*?) \|", re.MULTILINE)
MOST_FILES = 15
"""From the command to a box of Fig. 11."""

Walk = list[tuple[str, list[str]]]


def walks() -> Iterator[tuple[str, Walk]]:
    """The title of each walk, with its files and the functions named in each."""
    for part in PAGE.split("\n## ")[1:]:
        rows = ROW.findall(part)
        if rows:
            yield (
                part.splitlines()[0],
                [(file, re.findall(r"`([\w.]+)`", names)) for _, file, names in rows],
            )


WALKS = dict(walks())


@pytest.fixture(params=WALKS.values(), ids=WALKS.keys())
def walk(request: pytest.FixtureRequest) -> Walk:
    return request.param


def test_there_are_two_walks_and_the_first_is_short() -> None:
    assert len(WALKS) == 2
    assert len(next(iter(WALKS.values()))) <= MOST_FILES


def test_rows_are_numbered() -> None:
    for part in PAGE.split("\n## ")[1:]:
        numbers = [int(number) for number, _, _ in ROW.findall(part)]
        assert numbers == list(range(1, len(numbers) + 1))


def test_named_functions_exist(walk: Walk) -> None:
    missing = [
        f"{file}: {name}"
        for file, names in walk
        for name in names
        if name not in defined((ROOT / file).read_text(encoding="utf-8"))
    ]
    assert missing == []
    assert all(names for _, names in walk)


def test_each_file_is_imported_by_an_earlier_one(walk: Walk) -> None:
    reached: set[str] = set()
    for index, (file, _) in enumerate(walk):
        module = file.removesuffix(".py").replace("/", ".")
        assert index == 0 or module in reached, f"no earlier file of the walk imports {file}"
        reached |= imported(ROOT / file)


def defined(source: str) -> set[str]:
    """Functions and classes of a file, and methods as `Class.method`."""
    names = set()
    for node in ast.parse(source).body:
        if isinstance(node, (ast.FunctionDef, ast.ClassDef)):
            names.add(node.name)
        if isinstance(node, ast.ClassDef):
            methods = [one for one in node.body if isinstance(one, ast.FunctionDef)]
            names |= {f"{node.name}.{method.name}" for method in methods}
    return names


def imported(file: Path) -> set[str]:
    """Modules that a file imports: also inside functions, through packages, and verbs by name."""
    source = file.read_text(encoding="utf-8")
    modules: set[str] = set()
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.ImportFrom) and node.module:
            modules |= {node.module, *(f"{node.module}.{name.name}" for name in node.names)}
            package = ROOT / node.module.replace(".", "/") / "__init__.py"
            if package.exists() and package != file:
                modules |= imported(package)
        elif isinstance(node, ast.Import):
            modules |= {name.name for name in node.names}
    if 'import_module(f"evaluation.commands.' in source:
        modules |= {f"evaluation.commands.{one.stem}" for one in ROOT.glob("evaluation/commands/*")}
    return modules
