"""Settings of Sphinx: `make docs` builds these pages and the API reference, offline."""

from pydantic import BaseModel
from sphinx.application import Sphinx

from airground import __version__
from evaluation.setup.environment import prepare

prepare()  # Modules are imported for their docstrings; MuJoCo needs a way to render first.

project = "airground"
author = "the airground authors"
release = __version__

extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.napoleon"]
html_theme = "furo"
html_title = f"airground {release}"

# Links to headings as GitHub names them. Links to files outside this folder, such as
# ../airground/config.py, become copies to download.
myst_heading_anchors = 4

highlight_language = "none"  # Blocks without a language are commands or listings.

autodoc_default_options = {
    "members": True,
    "member-order": "bysource",
    "exclude-members": "model_config",
}
autodoc_typehints = "signature"
autodoc_typehints_format = "short"
autodoc_preserve_defaults = True
napoleon_numpy_docstring = False
napoleon_use_ivar = True
napoleon_attr_annotations = False  # Docstrings state shapes and units, which types do not.


def setup(app: Sphinx) -> None:
    """Register the corrections of docstrings and signatures below."""
    app.connect("autodoc-process-docstring", keep_colons, priority=400)  # napoleon's is 500
    app.connect("autodoc-process-docstring", keep_bars)
    app.connect("autodoc-process-signature", without_constraints)


def keep_colons(app: Sphinx, what: str, name: str, obj: object, options: dict, lines: list) -> None:
    """Start a constant's docstring with an empty comment.

    Napoleon takes the text before a colon in its first line for a type.
    """
    if what in ("attribute", "data", "property") and lines:
        lines[:0] = ["..", ""]


def keep_bars(app: Sphinx, what: str, name: str, obj: object, options: dict, lines: list) -> None:
    """Escape vertical bars: docutils takes `|x|` for a substitution."""
    lines[:] = [line.replace("|", r"\|") for line in lines]


def without_constraints(
    app: Sphinx, what: str, name: str, obj: object, options: dict, *signature: str | None
) -> tuple[str, None] | None:
    """Drop a pydantic model's signature, which repeats its fields with every constraint."""
    is_model = isinstance(obj, type) and issubclass(obj, BaseModel)
    return ("", None) if is_model else None
