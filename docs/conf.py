"""Sphinx configuration of the documentation site (``make docs``)."""

from __future__ import annotations

import os
import sys
from importlib.metadata import version as installed_version
from pathlib import Path

HERE = Path(__file__).parent
ROOT = HERE.parent
sys.path[:0] = [str(ROOT), str(HERE / "tools")]

import gallery  # noqa: E402  found through the line above

from fe_ste.tools import arrays  # noqa: E402

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
# Examples use paths from the root of the project, as the command line does.
os.chdir(ROOT)

project = "exugear"
author = "the exugear authors"
copyright = author
release = installed_version("exugear")
version = release

extensions = [
    "myst_parser",
    "docstrings",
    "sphinx.ext.autodoc",
    "sphinx.ext.autosummary",
    "sphinx.ext.mathjax",
    "sphinx_design",
    "sphinx_gallery.gen_gallery",
    "claims_tables",
    "command_pages",
    "interface_pages",
    "key_pages",
    "outside_pages",
    "api_pages",
]
templates_path = ["_templates"]
exclude_patterns = ["tools", "_static"]
source_suffix = {".md": "markdown", ".rst": "restructuredtext"}
nitpicky = False

# Text
myst_enable_extensions = ["dollarmath", "amsmath", "deflist", "colon_fence", "attrs_block"]
myst_heading_anchors = 4
smartquotes = False

# The programming interface, from the docstrings
autosummary_generate = False
autodoc_member_order = "bysource"
autodoc_docstring_signature = False  # signatures come from the code, not from docstrings
autodoc_use_type_comments = False
autodoc_typehints = "signature"  # docstrings add shapes, units and meaning
autodoc_type_aliases = {name: name for name in arrays.__all__}  # Floats, not its long form
# A type name that several modules have, such as LoadCase, is linked to one of them.
suppress_warnings = ["ref.python"]
numpydoc_show_class_members = False
numpydoc_class_members_toctree = False

# Formulas: a local copy of MathJax, for reading without a network
mathjax_path = "mathjax/tex-svg.js"
mathjax3_config = {
    "options": {"enableMenu": False, "menuOptions": {"settings": {"assistiveMml": True}}},
    "svg": {"fontCache": "global"},
}

sphinx_gallery_conf = gallery.settings(ROOT)

html_theme = "pydata_sphinx_theme"
html_title = f"exugear {release}"
html_static_path = ["_static"]
html_css_files = ["site.css"]
html_search_scorer = str(HERE / "tools" / "search_order.js")
html_show_sourcelink = False
html_copy_source = False
html_theme_options = {
    "navbar_align": "left",
    "navbar_end": ["theme-switcher"],
    "navbar_persistent": ["search-button"],
    "footer_start": ["copyright"],
    "footer_end": [],
    "header_links_before_dropdown": 9,
    "show_toc_level": 2,
    "show_nav_level": 1,
    "navigation_with_keys": False,
    "pygments_light_style": "a11y-high-contrast-light",
    "pygments_dark_style": "a11y-high-contrast-dark",
}
