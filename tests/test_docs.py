"""What the documentation names is there: files, parameters, verbs."""

from __future__ import annotations

import re
import runpy
from collections.abc import Iterator
from pathlib import Path
from typing import Any, get_args

import pytest
from pydantic import BaseModel

from airground.config import Config
from evaluation.cli import VERBS
from evaluation.judge.results import CONFIG, SHOWCASE, SUMMARY, TABLE
from evaluation.judge.summary import Summary
from evaluation.table.rows import ResultTable

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


def test_the_index_links_every_page() -> None:
    text = (ROOT / "docs" / "index.md").read_text(encoding="utf-8")
    linked = set(re.findall(r"\]\((\w+\.md)\)", text))
    pages = {page.name for page in (ROOT / "docs").glob("*.md")}
    behind_the_api = {name for name in pages if name.startswith("api_")}
    assert pages - behind_the_api - {"index.md"} == linked


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


def part_of(page: str, heading: str) -> str:
    """The text under a heading of the second level."""
    text = (ROOT / "docs" / page).read_text(encoding="utf-8")
    return text.partition(f"\n## {heading}\n")[2].partition("\n## ")[0]


def named_in(text: str) -> set[str]:
    return set(re.findall(r"`([^`]+)`", text))


def keys(model: type[BaseModel]) -> Iterator[str]:
    """Names in a JSON file of this form, at every depth."""
    for name, field in model.model_fields.items():
        yield field.alias or name
        for part in parts(field.annotation):
            yield from keys(part)


def parts(annotation: Any) -> Iterator[type[BaseModel]]:
    """Models in an annotation: `Part | None`, `dict[str, Part]`."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        yield annotation
    for argument in get_args(annotation):
        yield from parts(argument)


def test_every_key_of_the_summary_is_explained() -> None:
    assert set(keys(Summary)) - named_in(part_of("formats.md", "summary.json")) == set()


def test_every_column_of_the_results_is_explained() -> None:
    columns = set(ResultTable.from_rows([]).frame.columns)
    assert columns - named_in(part_of("formats.md", "results.parquet")) == set()


def test_every_file_of_a_run_is_explained() -> None:
    files = named_in(part_of("formats.md", "What a run leaves"))
    assert {TABLE, SUMMARY, CONFIG, f"{SHOWCASE}/"} <= files
