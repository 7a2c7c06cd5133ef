"""Settings of the documentation site: `python -m sphinx -W -b html docs docs/_build`.

What the reference says about parts, keys, metrics, commands and classes is made from the code by the modules in `_ext`.
"""

import importlib.metadata
import sys
from pathlib import Path

from undertow.core.process_setup import prepare

HERE = Path(__file__).parent
sys.path.insert(0, str(HERE / "_ext"))
prepare()  # as the command line does: double precision, and compiled code is kept for the next build

project = "undertow"
author = "The undertow developers"
release = importlib.metadata.version("undertow")
html_title = f"undertow {release}"

extensions = [
    "myst_parser",
    "sphinx.ext.autodoc",
    "sphinx.ext.napoleon",
    "sphinx_gallery.gen_gallery",
    "mathml",
    "links",
    "layers",
    "reference",
    "api",
]
exclude_patterns = ["_build", "gallery/GALLERY_HEADER.rst"]

# Pages are Markdown with mathematics between dollar signs; every heading down to the third level can be linked to.
myst_enable_extensions = ["dollarmath", "amsmath", "deflist"]
myst_heading_anchors = 3

# Everything that the pages load is part of the site: it opens from disk, without a network.
html_theme = "furo"
html_math_renderer = "mathml"
html_static_path = ["_static"]
html_css_files = ["site.css"]
html_theme_options = {"source_directory": "docs/"}
html_copy_source = False
html_show_copyright = False
html_show_sourcelink = False
html_show_search_summary = False  # it would be fetched, which pages from disk may not

default_role = "literal"  # `name` in docstrings
autodoc_member_order = "bysource"
autodoc_preserve_defaults = True
autodoc_typehints = "signature"
python_maximum_signature_line_length = 110
napoleon_google_docstring = True
napoleon_numpy_docstring = False

# A reference to something that does not exist is an error. Annotations may name what has no entry of its own: classes
# that are not public, and other people's.
nitpicky = True
nitpick_ignore_regex = [(r"py:.*", r"(?!undertow\.\w+$).*")]

sphinx_gallery_conf = {
    "examples_dirs": str(HERE.parent / "examples" / "gallery"),
    "gallery_dirs": "gallery",
    "download_all_examples": False,
    "show_signature": False,
    "remove_config_comments": True,
    "within_subsection_order": "FileNameSortKey",
    "write_computation_times": False,
    "abort_on_example_error": True,
}
# Its settings hold a class that cannot be cached, which Sphinx would warn of.
suppress_warnings = ["config.cache"]
