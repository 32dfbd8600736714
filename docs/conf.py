"""Sphinx's configuration of the site: `make docs` builds it from what tools/make_site.py writes."""

from pathlib import Path

import arc_suite

project = "arc_suite"
author = "the arc_suite developers"
version = release = arc_suite.__version__
extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.napoleon", "sphinx_copybutton", "sphinx_design"]

root_doc = "index"
myst_enable_extensions = ["colon_fence"]
myst_heading_anchors = 4

autodoc_member_order = "bysource"
autodoc_typehints = "none"
default_role = "code"  # of names between single backticks in docstrings
add_module_names = False
napoleon_numpy_docstring = False
napoleon_use_ivar = True

html_theme = "furo"
html_title = "arc_suite"
html_static_path = ["_static"]
html_css_files = ["site.css"]
html_favicon = "_static/icon.svg"
html_extra_path = [str(Path(__file__).parents[1] / "out" / "docs" / "extra")]
html_show_copyright = html_show_sphinx = False
html_copy_source = False


def setup(app):
    """Leave out the fields of named tuples, which the sections `Attributes` of their docstrings describe."""
    app.connect("autodoc-skip-member", lambda app, what, name, member, skip, options: skip or _is_field(member))


def _is_field(member) -> bool:
    return (getattr(member, "__doc__", None) or "").startswith("Alias for field number")
