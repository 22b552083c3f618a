"""Settings of Sphinx. Build: `sphinx-build -W --keep-going docs build/docs`."""

from __future__ import annotations

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))

import generate

import lenscl

project = "lenscl"
author = "the lenscl authors"
copyright = author  # noqa: A001 - Sphinx's own name
version = release = "0.1"

extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.napoleon"]
exclude_patterns = ["figures", "generated", "**/.*"]  # generated pages are included by others
myst_enable_extensions = ["attrs_inline", "colon_fence", "deflist"]
myst_heading_anchors = 3
nitpicky = False  # docstrings name types of numpy and OpenCL, of which no inventory is loaded
suppress_warnings = ["config.cache"]

autodoc_typehints = "none"  # numpydoc sections say them
autodoc_member_order = "bysource"
napoleon_numpy_docstring = True
napoleon_google_docstring = False
napoleon_use_rtype = False
napoleon_use_ivar = True

default_role = "code"  # of single backquotes in docstrings

html_theme = "furo"
html_title = "lenscl"
html_static_path = ["static"]
html_css_files = ["lenscl.css"]
html_theme_options = {"navigation_with_keys": True}

assert lenscl.__all__  # the package that is described is the one that is installed
generate.write_all(Path(__file__).parent / "generated")
