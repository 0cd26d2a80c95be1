"""Writes `metrics.md`, the table of every metric, from `evaluation/judge/metrics.py`."""

from pathlib import Path

from evaluation.judge.metrics import SHOWN, WATCHED, Metric
from evaluation.judge.poses import POSE_METRICS

PAGE = Path(__file__).with_suffix(".md")
INTRODUCTION = """\
# Metrics

Every metric of the summary, the report and the verdicts, made from
[`metrics.py`](../evaluation/judge/metrics.py) and [`poses.py`](../evaluation/judge/poses.py) by
`make docs`; a test checks that it is up to date. Limits are constants of
[`limits.py`](../evaluation/table/limits.py).
"""
JUDGED = """\
## Judged by `airground check`

| metric | title | better | one value per | a failure counts as | matters | because | the paper |
|---|---|---|---|---|---|---|---|\
"""
ONLY_SHOWN = """
## Shown only

| metric | title | better | one value per | a failure counts as | the paper |
|---|---|---|---|---|---|\
"""
POSES = """
## Poses of each robot

One value per recording; tables show the median and the worst. `live` poses are estimated with
each image, `final` poses after the last. The error over 1 m is evo's relative pose error of the
translation, over all pairs of poses that are 1 m of true path apart
(`evo_rpe tum TRUE ESTIMATE -d 1 -u m --all_pairs --pairs_from_reference`).

| key of `summary.json` | title | alignment | the worst is the |
|---|---|---|---|\
"""


def page() -> str:
    """The whole page."""
    lines = [INTRODUCTION, JUDGED]
    for metric in WATCHED:
        because = metric.why.partition(": ")[2]
        lines.append(_row(*_common(metric), _matters(metric), because, metric.paper))
    lines.append(ONLY_SHOWN)
    lines += [_row(*_common(metric), metric.paper) for metric in SHOWN]
    lines.append(POSES)
    lines += [_row(f"`{m.name}`", m.title, m.alignment, m.worst) for m in POSE_METRICS]
    return "\n".join([*lines, ""])


def _common(metric: Metric) -> tuple[str, ...]:
    failure = "infinite" if metric.failure == float("inf") else f"{metric.failure:g}"
    return f"`{metric.name}`", metric.title, metric.better, metric.each, failure


def _matters(metric: Metric) -> str:
    return f"{100 * metric.matters:g} " + ("%" if metric.relative else "points of %")


def _row(*cells: str) -> str:
    return f"| {' | '.join(cells)} |"


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
