"""The help of a verb: one screen, its options in groups, a line each where the text is short."""

from __future__ import annotations

import ast
import inspect
import shutil
import textwrap
import typing
from collections.abc import Iterator
from dataclasses import MISSING, Field, dataclass, fields
from functools import cache
from typing import Any, Literal, get_args, get_origin

from tyro.conf import Positional

from evaluation.commands.options import Shown, Verb

MAX_COLUMNS = 100
FORM_COLUMNS = 31
"""Width of the left column, which holds "--name VALUE"."""
GROUPS = ("input", "pipeline", "output", "machine")
"""Groups whose order is fixed; those of a single verb come after the first."""
_POSITIONAL = get_args(Positional[int])[1]


@dataclass(frozen=True)
class Option:
    """An option as the help shows it; `form` is the option with its value: "--seed N"."""

    form: str
    text: str
    required: bool
    positional: bool


def help_text(name: str, verb: type[Verb]) -> str:
    """What `airground NAME --help` prints."""
    width = min(MAX_COLUMNS, shutil.get_terminal_size((MAX_COLUMNS, 40)).columns)
    groups = grouped_options(verb)
    every = [option for options in groups.values() for option in options]
    words = [one.form if one.required else f"[{one.form}]" for one in every if one.positional]
    words += [one.form for one in every if one.required and not one.positional]
    usage = " ".join(["usage: airground", name, *words, "[OPTIONS]"])
    lines = [*textwrap.wrap(usage, width, subsequent_indent="  "), ""]
    for paragraph in inspect.cleandoc(verb.__doc__ or "").split("\n\n"):
        lines += textwrap.wrap(" ".join(paragraph.split()), width)
    for heading, options in groups.items():
        lines += ["", f"{heading}:"]
        for option in options:
            lines += _lines(option, width)
    return "\n".join(lines)


def grouped_options(verb: type[Verb]) -> dict[str, list[Option]]:
    """A verb's options by the heading of their group."""
    known = {field.name: field for field in fields(verb)}
    hints = typing.get_type_hints(verb, include_extras=True)
    found: dict[str, list[Option]] = {}
    for owner in verb.__mro__:
        for name in inspect.get_annotations(owner):
            if name in known:
                heading = "input" if owner is verb else vars(owner)["heading"]
                option = _option(known.pop(name), hints[name], _docstrings(owner)[name])
                found.setdefault(heading, []).append(option)
    own = [heading for heading in found if heading not in GROUPS]
    order = [GROUPS[0], *own, *GROUPS[1:]]
    return {heading: found[heading] for heading in order if heading in found}


def _option(field: Field[Any], hint: Any, text: str) -> Option:
    kind, *extras = get_args(hint) if get_origin(hint) is typing.Annotated else (hint,)
    named = next((extra.name for extra in extras if getattr(extra, "name", None)), field.name)
    shown = next((extra for extra in extras if isinstance(extra, Shown)), Shown(_metavar(kind)))
    positional = _POSITIONAL in extras
    required = field.default is MISSING
    form = shown.metavar if positional else f"--{named.replace('_', '-')} {shown.metavar}".rstrip()
    default = shown.default
    if not default and not required and field.default not in (None, False, ()):
        value = " ".join(field.default) if isinstance(field.default, tuple) else field.default
        default = f"{value}"
    return Option(form, f"{text} [{default}]" if default else text, required, positional)


def _metavar(kind: Any) -> str:
    if get_origin(kind) is Literal:
        return f"{{{','.join(get_args(kind))}}}"
    return "" if kind is bool else "VALUE"


def _lines(option: Option, width: int) -> Iterator[str]:
    form, column = f"  {option.form}", FORM_COLUMNS + 2
    first, *more = textwrap.wrap(option.text, max(30, width - column))
    if len(form) < column:
        yield f"{form:<{column}}{first}"
    else:
        yield form
        yield f"{'':<{column}}{first}"
    yield from (f"{'':<{column}}{line}" for line in more)


@cache
def _docstrings(owner: type) -> dict[str, str]:
    """The string that follows each field in the source of a class, by the field's name."""
    (body,) = ast.parse(textwrap.dedent(inspect.getsource(owner))).body
    assert isinstance(body, ast.ClassDef)
    found = {}
    for field, text in zip(body.body, body.body[1:], strict=False):
        match field, text:
            case (
                ast.AnnAssign(target=ast.Name(id=name)),
                ast.Expr(value=ast.Constant(value=str(said))),
            ):
                found[name] = " ".join(said.split())
    return found
