"""Version of the code: covers the sources that make rows, and none that only show rows."""

from __future__ import annotations

from pathlib import Path

from evaluation.measure.work.code_version import ROOT, code_version, row_sources


def tree(root: Path, **files: str) -> None:
    for name, text in files.items():
        path = root / name.replace("__", "/")
        path.parent.mkdir(parents=True, exist_ok=True)
        path.with_suffix(".py").write_text(text)


def names(root: Path) -> set[str]:
    return {str(file.relative_to(root)) for file in row_sources(root)}


def test_sources_are_followed_through_imports(tmp_path: Path) -> None:
    tree(
        tmp_path,
        airground__core__a="",
        sim__b="",
        evaluation__measure__work__experiment="from evaluation.metrics import x\nimport numpy",
        evaluation__metrics="def f():\n    import evaluation.deep.deeper",
        evaluation__deep__deeper="from evaluation.measure.work.experiment import y",
        evaluation__report__page="",
    )
    (tmp_path / "evaluation/deep/__init__.py").write_text("from evaluation import beside")
    (tmp_path / "evaluation/beside.py").write_text("")
    (tmp_path / "scenes").mkdir()
    (tmp_path / "scenes/c.toml").write_text("")
    assert names(tmp_path) == {
        "airground/core/a.py",
        "sim/b.py",
        "scenes/c.toml",
        "evaluation/measure/work/experiment.py",
        "evaluation/metrics.py",
        "evaluation/deep/__init__.py",
        "evaluation/deep/deeper.py",
        "evaluation/beside.py",
    }


def test_it_covers_what_makes_rows_and_not_what_shows_them() -> None:
    found = names(ROOT)
    for made in (
        "measure/protocol/trials",
        "measure/protocol/mapping_pass",
        "table/oracle",
        "measure/baselines/feature_matching",
        "measure/protocol/error_budget",
    ):
        assert f"evaluation/{made}.py" in found
    assert "scenes/tiny.toml" in found
    assert "airground/localization/particle_filter.py" in found
    for shown in (
        "show/figures/style",
        "show/report/page",
        "cli",
        "measure/work/crew",
        "measure/plans/dials",
        "table/intervals",
    ):
        assert (ROOT / f"evaluation/{shown}.py").exists()
        assert f"evaluation/{shown}.py" not in found
    assert len(code_version()) == 64
