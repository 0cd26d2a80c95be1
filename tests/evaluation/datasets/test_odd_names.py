"""A recording whose scene has a name that is markup: pages and files show it, and do nothing."""

from __future__ import annotations

import html
import json
import re
import shutil
from pathlib import Path

import pytest
from markdown_it import MarkdownIt

from airground.io.header import read_header
from airground.io.sensor_file import read_mapping
from evaluation import cli

NAME = "a|b <script>alert(1)</script>\n# [x](y): ../../up"


@pytest.fixture(scope="module")
def odd(small: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("odd") / "recording"
    shutil.copytree(small, path)
    text = (path / "recording.toml").read_text()
    assert text.count('scene = "small"') == 1
    named = text.replace('scene = "small"', f"scene = {json.dumps(NAME)}")
    (path / "recording.toml").write_text(named)
    assert read_header(path / "recording.toml").scene == NAME
    return path


def airground(*words: object) -> int | str | None:
    with pytest.raises(SystemExit) as ended:
        cli.main([str(word) for word in words])
    return ended.value.code


def test_the_card_of_shards(odd: Path, tmp_path: Path) -> None:
    out = tmp_path / "shards"
    assert airground("export", odd, "--format", "webdataset", "--robot", "mav", "--out", out) == 0
    assert {str(path.relative_to(out)) for path in out.rglob("*") if path.is_file()} == {
        "README.md",
        "croissant.json",
        "data/mav-00000.tar",
    }
    _, head, body = (out / "README.md").read_text().split("---\n")
    assert NAME.split()[0] not in head
    page = MarkdownIt("commonmark").render(body)
    (title,) = re.findall(r"<h1>(.*)</h1>", page)
    assert html.unescape(title) == f"airground-{' '.join(NAME.split())}-3-0"
    assert not re.search(r"<(script|a|h2)\b", page)
    assert json.loads((out / "croissant.json").read_text())["name"] == f"airground-{NAME}-3-0"


def test_the_comment_of_euroc(odd: Path, tmp_path: Path) -> None:
    assert airground("export", odd, "--format", "euroc", "--out", tmp_path / "euroc") == 0
    body = read_mapping(tmp_path / "euroc" / "mav0" / "body.yaml")
    assert body == {"comment": f"airground {NAME}, seed 3, flight 0"}


def test_every_template_escapes_what_it_is_given() -> None:
    """By its name, by which `rendered` escapes; the tests of some pages look for the tags."""
    templates = list(Path(cli.__file__).parent.rglob("*.j2"))
    assert len(templates) > 5
    for template in templates:
        assert template.name.endswith((".html.j2",))
        text = template.read_text(encoding="utf-8")
        assert not re.search(r"\|\s*safe\b|autoescape", text), template
