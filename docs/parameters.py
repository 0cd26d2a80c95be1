"""Writes `parameters.md`, the table of every parameter, from `airground/config.py`."""

from pathlib import Path
from typing import Literal, get_args, get_origin

from airground.config import Section, paper
from evaluation.setup.settings import Settings
from evaluation.setup.switches import SWITCH_OF, condition_of

PAGE = Path(__file__).with_suffix(".md")
INTRODUCTION = """\
# Parameters

Every parameter of the pipeline, made from [`config.py`](../airground/config.py) by `make docs`; a
test sees that it is up to date. `best` is the default; `paper` has the constants as published,
and `paper_literal` the same with `localization.sigma` as printed, 0.08 m^2.
A dash there means the same as `best`. [The method](method.md) says what the important ones do.

```
airground run RECORDING --preset paper --set localization.particles=400 --out DIR
airground run RECORDING --config results/a/config.toml --out DIR
```

`--config` takes a file in the form of the `config.toml` that every run leaves: `preset`, and one
table for each section below. What it leaves out stays as the preset has it. `--set` comes last.
`--set` of a parameter that another one switches off ("only with") is refused; a file may have it.
"""


def page() -> str:
    """The whole page."""
    best, published = Settings(), Settings(**dict(paper()))
    sections = [
        _section(name, getattr(best, name), getattr(published, name))
        for name in Settings.model_fields
        if isinstance(getattr(best, name), Section)
    ]
    return "\n".join([INTRODUCTION, *sections])


def _section(name: str, best: Section, published: Section) -> str:
    lines = [f"## `{name}`", "", (type(best).__doc__ or "").strip(), ""]
    lines += ["| parameter | `best` | `paper` | meaning |", "|---|---|---|---|"]
    for key, field in type(best).model_fields.items():
        ours, theirs = getattr(best, key), getattr(published, key)
        meaning = " ".join((field.description or "").split()).replace("|", "\\|")
        if get_origin(field.annotation) is Literal:
            meaning += f" One of {', '.join(f'`{one}`' for one in get_args(field.annotation))}."
        if f"{name}.{key}" in SWITCH_OF:
            meaning += f" Only with `{condition_of(f'{name}.{key}')}`."
        shown = "-" if theirs == ours else _value(theirs)
        lines.append(f"| `{key}` | {_value(ours)} | {shown} | {meaning} |")
    return "\n".join([*lines, ""])


def _value(value: object) -> str:
    """As TOML has it."""
    if isinstance(value, bool):
        return str(value).lower()
    return str(list(value)) if isinstance(value, tuple) else str(value)


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
