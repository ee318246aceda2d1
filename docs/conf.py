"""Sphinx configuration."""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent / "_ext"))

from nvhchain import __version__

project = "nvhchain"
author = "The nvhchain developers"
project_copyright = author
version = release = __version__

extensions = [
    "myst_parser",
    "sphinx.ext.autodoc",
    "sphinx.ext.mathjax",
    "plain_docstrings",
    "field_tables",
    "case_drawings",
    "command_line",
    "api_pages",
    "rooms",
    "validation",
]
myst_enable_extensions = ["dollarmath", "amsmath", "deflist", "colon_fence"]
myst_heading_anchors = 3
exclude_patterns = ["_build", "measured"]
nitpicky = False
# A class is documented where it is defined and again where its package offers it: two targets for one name.
suppress_warnings = ["ref.python"]

autodoc_member_order = "bysource"
autodoc_typehints = "signature"
autodoc_typehints_format = "short"
autodoc_default_options = {"members": True, "ignore-module-all": True}
# Private aliases such as FloatArray stay short in signatures.
autodoc_preserve_defaults = True
python_use_unqualified_type_names = True

html_theme = "furo"
html_title = f"nvhchain {version}"
html_static_path = ["_static"]
html_css_files = ["wrap.css"]
