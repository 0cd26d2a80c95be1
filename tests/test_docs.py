"""Files, modules, parameters and verbs named in the documentation exist."""

from __future__ import annotations

import importlib
import importlib.util
import json
import re
import runpy
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from typing import Any, get_args

import pytest
from matplotlib.testing.compare import compare_images
from pydantic import BaseModel

from airground.config import Config
from evaluation.cli import VERBS, parse
from evaluation.datasets.formats import FORMATS
from evaluation.judge.results import CONFIG, SHOWCASE, SUMMARY, TABLE
from evaluation.judge.summary import Summary
from evaluation.measure.plans.dials import DIALS
from evaluation.show.figures.style import write_png
from evaluation.show.report.levels import level_figures
from evaluation.table.rows import ResultTable
from sim import scene

ROOT = Path(__file__).parents[1]
PAGES = [
    *(ROOT / f"{name}.md" for name in ("README", "CONTRIBUTING", "SECURITY")),
    *sorted((ROOT / "docs").glob("*.md")),
]
SECTIONS = {name: getattr(Config(), name) for name in Config.model_fields}
PARAMETER = re.compile(
    rf"(?<!airground\.)\b({'|'.join(n for n in SECTIONS if n != 'preset')})\.(\w+)"
)
ROOMS = "airground|sim|evaluation"
PATH = re.compile(rf"(?<![\w/.-])(?:\.\./)?((?:{ROOMS}|tests|scenes|docs)/[\w/.*-]*\w)")
DOTTED = re.compile(rf"(?<![\w/.-])((?:{ROOMS})(?:\.\w+)+)")
IMPORT = re.compile(rf"^\s*from ((?:{ROOMS})[\w.]*) import ([\w, ]+)$", re.MULTILINE)
COMMAND = re.compile(r"(?:^|`|bin/)airground\s([a-z]+)([^`\n#]*)", re.MULTILINE)
WRITTEN_BY_THE_READER = {
    "evaluation/measure/baselines/highest_heap.py",
    "evaluation.measure.baselines.highest_heap",
}
"""The file that add_a_baseline.md asks its reader to write."""


def offenders(found_in: Callable[[Path, str], Iterable[str]]) -> dict[str, list[str]]:
    """What is wrong in each page, by its name; pages without a fault are left out."""
    texts = {page: page.read_text(encoding="utf-8") for page in PAGES}
    wrong = {page.name: sorted(set(found_in(page, text))) for page, text in texts.items()}
    return {name: found for name, found in wrong.items() if found}


def without_code(text: str) -> str:
    return re.sub(r"```.*?```", "", text, flags=re.DOTALL)


def test_links_lead_to_files_and_headings() -> None:
    def broken(page: Path, text: str) -> Iterator[str]:
        for target in re.findall(r"\]\(([^)\s]+)\)", without_code(text)):
            path, _, heading = target.partition("#")
            file = (page.parent / path).resolve() if path else page
            if target.startswith(("http:", "https:")):
                continue
            if not file.exists() or (heading and heading not in headings(file)):
                yield target

    assert offenders(broken) == {}


def headings(file: Path) -> set[str]:
    """Names of a page's headings as they stand in links."""
    found = re.findall(r"^#+ (.+)$", without_code(file.read_text(encoding="utf-8")), re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", one.lower()).replace(" ", "-") for one in found}


def test_files_exist() -> None:
    def missing(page: Path, text: str) -> Iterator[str]:
        named = set(PATH.findall(text)) - WRITTEN_BY_THE_READER
        return (name for name in named if not list(ROOT.glob(name)))

    assert offenders(missing) == {}


def test_modules_and_imported_names_exist() -> None:
    def missing(page: Path, text: str) -> Iterator[str]:
        named = set(DOTTED.findall(text))
        for module, names in IMPORT.findall(text):
            if module not in WRITTEN_BY_THE_READER:
                named |= {f"{module}.{name.strip()}" for name in names.split(",")}
        return (name for name in named - WRITTEN_BY_THE_READER if not exists(name))

    assert offenders(missing) == {}


def exists(dotted: str) -> bool:
    """Whether a dotted name is a module, or an attribute of one."""
    module, names = dotted, list[str]()
    while not is_module(module):
        module, _, name = module.rpartition(".")
        if not module:
            return False
        names.insert(0, name)
    found: object = importlib.import_module(module)
    for name in names:
        if not hasattr(found, name):
            return False
        found = getattr(found, name)
    return True


def is_module(name: str) -> bool:
    try:
        return importlib.util.find_spec(name) is not None
    except ModuleNotFoundError:
        return False


def test_parameters_exist() -> None:
    def unknown(page: Path, text: str) -> Iterator[str]:
        for section, name in PARAMETER.findall(re.sub(r"\]\([^)]*\)", "]", text)):  # no links
            owner = SECTIONS[section]
            if name != "py" and isinstance(owner, BaseModel) and not hasattr(owner, name):
                yield f"{section}.{name}"

    assert offenders(unknown) == {}


def test_verbs_and_options_exist(capsys: pytest.CaptureFixture[str]) -> None:
    known = {verb: options(verb, capsys) for verb in VERBS}

    def unknown(page: Path, text: str) -> Iterator[str]:
        for verb, words in COMMAND.findall(text):
            if verb not in known:
                yield verb
                continue
            for option in re.findall(r"(?<!\S)--[a-z0-9-]+", words):
                if option not in known[verb]:
                    yield f"{verb} {option}"

    assert offenders(unknown) == {}


def options(verb: str, capsys: pytest.CaptureFixture[str]) -> set[str]:
    """The options in a verb's help."""
    with pytest.raises(SystemExit):
        parse(verb, ["--help"])
    return set(re.findall(r"--[a-z0-9-]+", capsys.readouterr().out))


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


def test_the_page_of_metrics_is_that_of_the_table() -> None:
    made = runpy.run_path(str(ROOT / "docs" / "metrics.py"))["page"]()
    page = (ROOT / "docs" / "metrics.md").read_text(encoding="utf-8")
    assert page == made, "the table of metrics has changed: run docs/metrics.py, or make docs"


def test_the_page_of_measured_levels_is_that_of_the_runs_kept() -> None:
    made = runpy.run_path(str(ROOT / "docs" / "measured_levels.py"))["page"]()
    page = (ROOT / "docs" / "measured_levels.md").read_text(encoding="utf-8")
    assert page == made, "runs or tables have changed: run docs/measured_levels.py, or make docs"


def test_the_pictures_of_measured_levels_are_those_of_the_runs_kept(tmp_path: Path) -> None:
    measured = runpy.run_path(str(ROOT / "docs" / "measured_levels.py"))["measured_levels"]()
    for made in level_figures(measured):
        kept, new = ROOT / "docs" / "pictures" / f"{made.name}.png", tmp_path / f"{made.name}.png"
        write_png(made.figure, new)
        # Not byte by byte: libraries of another machine may round lines otherwise.
        off = compare_images(str(kept), str(new), tol=0.5)
        assert off is None, f"runs have changed: run docs/measured_levels.py, or make docs\n{off}"


def test_the_levels_in_the_readme_are_those_of_their_page() -> None:
    page = (ROOT / "docs" / "measured_levels.md").read_text(encoding="utf-8")
    methods = page[page.index("| best guess within 0.25 m") : page.index("## `paper` 1")]
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    rows = re.findall(r"^\| `(\w+)` (\d) \| (.*) \| (\d+ of \d+) \|$", readme, re.MULTILINE)
    assert rows
    for level, version, shares, claims in rows:
        level_on = page[page.index(f"## `{level}` {version}") :]
        together = re.search(r"^\| all together \|.*", level_on, re.MULTILINE)
        assert together is not None
        assert f"({claims};" in together.group(), f"{level}: {claims}"
        for share in shares.split(" | "):
            count, interval = share.rstrip(")").split(" (")
            assert f"({count}; {interval})" in methods, f"{level}: {share}"


def test_every_row_of_the_parameters_stands_alone() -> None:
    page = (ROOT / "docs" / "parameters.md").read_text(encoding="utf-8")
    rows = [line for line in page.splitlines() if line.startswith("| `")]
    cells = [re.split(r"(?<!\\)\|", row) for row in rows]
    assert [row for row, parts in zip(rows, cells, strict=True) if len(parts) != 6] == []
    assert [row for row in rows if "..." in row or not row.rstrip(" |").endswith(".")] == []


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


SCENE_TABLES = {
    "`[room]`": scene.Room,
    '`[rubble]`, for kind `"rubble"`': scene.Rubble,
    '`[terrain]`, for kind `"terrain"`': scene.Terrain,
    "`[light]`": scene.Light,
    "`[mav]`": scene.MavPath,
    "`[ground]`": scene.GroundPath,
}
"""Headings of add_a_scene.md."""


@pytest.mark.parametrize("heading", SCENE_TABLES)
def test_keys_of_a_scene_are_explained_with_their_defaults(heading: str) -> None:
    documented: dict[str, Any] = {}
    for row in re.findall(r"^\| (`\w+`.*)$", part_of("add_a_scene.md", heading), re.MULTILINE):
        names, defaults, *_ = row.split(" |")
        values = json.loads(f"[{defaults.replace('`', '').replace('none', 'null')}]")
        keys = re.findall(r"`(\w+)`", names)
        documented |= dict(zip(keys, values or ["required"] * len(keys), strict=True))
    fields = SCENE_TABLES[heading].model_fields
    assert documented == {
        name: "required" if field.is_required() else json.loads(json.dumps(field.default))
        for name, field in fields.items()
    }


def test_keys_at_the_top_of_a_scene_are_explained() -> None:
    text = (ROOT / "docs" / "add_a_scene.md").read_text(encoding="utf-8")
    explained = named_in(without_code(text))
    headings = {name.partition("]")[0].strip("[") for name in explained if name.startswith("[")}
    assert set(scene.Scene.model_fields) <= explained | headings


def test_every_dial_of_a_sweep_is_explained() -> None:
    assert {dial.name for dial in DIALS} <= named_in(part_of("sweep.md", "Dials"))


def test_every_export_format_is_explained() -> None:
    page = (ROOT / "docs" / "datasets.md").read_text(encoding="utf-8")
    assert {name for name in FORMATS if f"(`{name}`)" not in page} == set()
