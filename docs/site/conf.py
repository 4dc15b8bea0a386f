"""Configuration of Sphinx, which makes the site of the documents: `make docs`.

The source folder is the root of the repository, so that links between documents are the same here
as in the files. README.md is the front page.
"""

from __future__ import annotations

import re
import sys
from pathlib import Path

from sphinx.application import Sphinx

sys.path.insert(0, str(Path(__file__).parent))

from api_pages import write_pages
from navigation import FRONT_PAGE, front_page_with_navigation, navigation
from plain_docstrings import as_restructured_text

project = "HMCS"
language = "en"
root_doc = FRONT_PAGE
extensions = ["mathml", "myst_parser", "sphinx.ext.autodoc"]
include_patterns = [
    f"{page}{suffix}"
    for page in (FRONT_PAGE, *(page for pages in navigation().values() for page in pages))
    for suffix in (".md", ".rst")
]
exclude_patterns = [".*", "out", "**/__pycache__"]

html_theme = "furo"
html_title = "HMCS"
html_copy_source = False
html_show_sphinx = False
html_show_copyright = False
html_extra_path = ["index.html"]
html_static_path = ["site.css"]
html_css_files = ["site.css"]
html_math_renderer = "mathml"

myst_enable_extensions = ["dollarmath"]
myst_heading_anchors = 3

default_role = "py:obj"
# A short name in a signature may stand for several things: the first of them is linked.
suppress_warnings = ["ref.python"]
toc_object_entries_show_parents = "hide"
maximum_signature_line_length = 90
autodoc_member_order = "bysource"
autodoc_typehints_format = "short"
autodoc_preserve_defaults = True
autodoc_type_aliases = {"Array": "Array"}
autodoc_default_options = {
    "undoc-members": True,
    "exclude-members": "model_config, model_post_init",
}


def setup(app: Sphinx) -> None:
    """Make the API pages, and read README.md and docstrings as they are meant."""
    app.connect("builder-inited", lambda _: write_pages())
    app.connect("source-read", _add_navigation)
    app.connect("autodoc-process-docstring", _read_as_prose)
    app.connect("autodoc-process-signature", _name_aliases)


def _add_navigation(_: Sphinx, name: str, content: list[str]) -> None:
    if name == FRONT_PAGE:
        content[0] = front_page_with_navigation(content[0])


def _read_as_prose(*given: object) -> None:
    lines = given[-1]
    assert isinstance(lines, list)
    lines[:] = as_restructured_text(lines)


def _name_aliases(*given: object) -> tuple[str | None, str | None]:
    """Return signature and return type with `Array` and `ndarray` in place of their definition."""
    signature, returned = (None if text is None else str(text) for text in given[-2:])
    return _with_aliases(signature), _with_aliases(returned)


def _with_aliases(text: str | None) -> str | None:
    if text is None:
        return None
    text = re.sub(r"TypeAliasForwardRef\('(\w+)'\)", r"\1", text)
    return text.replace("ndarray[tuple[Any, ...], dtype[Any]]", "ndarray")
