"""The project's own source files, parsed, for tests that read them."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from functools import cache
from pathlib import Path

ROOT = Path(__file__).parent.parent
ROOMS = ("airground", "sim", "evaluation")


def sources(*folders: str) -> list[str]:
    """Every Python file below the folders, relative to the repository."""
    files = [file for folder in folders for file in (ROOT / folder).rglob("*.py")]
    return sorted(str(file.relative_to(ROOT)) for file in files)


@cache
def tree(file: str) -> ast.Module:
    return ast.parse((ROOT / file).read_text(encoding="utf-8"), filename=file)


@cache
def nodes(file: str) -> tuple[ast.AST, ...]:
    return tuple(ast.walk(tree(file)))


@cache
def imports(file: str) -> tuple[str, ...]:
    """Dotted names of all that a file imports, wherever in the file it does."""
    names: list[str] = []
    for node in nodes(file):
        if isinstance(node, ast.Import):
            names += (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{file}:{node.lineno}: relative import"
            names += (f"{node.module}.{alias.name}" for alias in node.names)
    return tuple(names)


def strings(file: str) -> Iterator[tuple[int, str]]:
    """Text in the code, docstrings apart."""
    docstrings = set()
    for node in nodes(file):
        body = getattr(node, "body", None)
        if isinstance(body, list):
            docstrings |= {
                id(child.value)
                for child in body
                if isinstance(child, ast.Expr) and isinstance(child.value, ast.Constant)
            }
    for node in nodes(file):
        if not isinstance(node, ast.Constant) or id(node) in docstrings:
            continue
        if isinstance(node.value, str):
            yield node.lineno, node.value


@cache
def calls(file: str) -> tuple[tuple[int, str], ...]:
    """Line and text of the called expression, for every call in a file."""
    found = (node for node in nodes(file) if isinstance(node, ast.Call))
    return tuple((node.lineno, ast.unparse(node.func)) for node in found)
