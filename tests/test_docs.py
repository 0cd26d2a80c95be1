"""What the documentation names is there: files, parameters, verbs."""

from __future__ import annotations

import re
import runpy
from pathlib import Path

import pytest
from pydantic import BaseModel

from airground.config import Config
from evaluation.cli import VERBS

ROOT = Path(__file__).parents[1]
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]
SECTIONS = {name: getattr(Config(), name) for name in Config.model_fields}
PARAMETER = re.compile(rf"\b({'|'.join(n for n in SECTIONS if n != 'preset')})\.(\w+)")


@pytest.fixture(params=PAGES, ids=[page.name for page in PAGES])
def page(request: pytest.FixtureRequest) -> Path:
    return request.param


def without_code(text: str) -> str:
    return re.sub(r"```.*?```", "", text, flags=re.DOTALL)


def test_links_lead_to_files_and_headings(page: Path) -> None:
    broken = []
    for target in re.findall(r"\]\(([^)\s]+)\)", without_code(page.read_text(encoding="utf-8"))):
        if target.startswith(("http:", "https:")):
            continue
        path, _, heading = target.partition("#")
        file = (page.parent / path).resolve() if path else page
        if not file.exists() or (heading and heading not in headings(file)):
            broken.append(target)
    assert broken == []


def headings(file: Path) -> set[str]:
    """Names of a page's headings as they stand in links."""
    found = re.findall(r"^#+ (.+)$", without_code(file.read_text(encoding="utf-8")), re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", one.lower()).replace(" ", "-") for one in found}


def test_parameters_exist(page: Path) -> None:
    text = re.sub(r"\]\([^)]*\)", "]", page.read_text(encoding="utf-8"))  # but for links
    unknown = []
    for section, name in PARAMETER.findall(text):
        owner = SECTIONS[section]
        if name != "py" and isinstance(owner, BaseModel) and not hasattr(owner, name):
            unknown.append(f"{section}.{name}")
    assert unknown == []


def test_verbs_exist(page: Path) -> None:
    blocks = re.findall(r"```.*?```", page.read_text(encoding="utf-8"), flags=re.DOTALL)
    verbs = re.findall(r"^airground ([a-z]+)", "\n".join(blocks), re.MULTILINE)
    assert set(verbs) <= set(VERBS)


def test_every_page_can_be_reached_from_the_readme() -> None:
    reached, to_read = set(), [ROOT / "README.md"]
    while to_read:
        current = to_read.pop()
        if current in reached:
            continue
        reached.add(current)
        links = re.findall(r"\]\(([^)#\s]+\.md)", current.read_text(encoding="utf-8"))
        links += re.findall(r"\b(docs/\w+\.md)", current.read_text(encoding="utf-8"))
        for link in links:
            for base in (current.parent, ROOT):
                if (base / link).exists():
                    to_read.append((base / link).resolve())
    assert {page.resolve() for page in PAGES} <= reached


def test_the_table_of_parameters_is_up_to_date() -> None:
    made = runpy.run_path(str(ROOT / "docs" / "parameters.py"))["page"]()
    page = (ROOT / "docs" / "parameters.md").read_text(encoding="utf-8")
    assert page == made, "config.py has changed: run docs/parameters.py, or make docs"


def test_every_parameter_is_explained() -> None:
    bare = [
        f"{section}.{name}"
        for section, owner in SECTIONS.items()
        if isinstance(owner, BaseModel)
        for name, field in type(owner).model_fields.items()
        if not field.description
    ]
    assert bare == []
