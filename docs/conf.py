"""Settings of the documentation site: `python -m sphinx -W -b html docs docs/_build`.

What the reference says about parts, keys, metrics, commands and classes is made from the code by the modules in `_ext`.
"""

import hashlib
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
    "myst_nb",
    "sphinx.ext.autodoc",
    "sphinx.ext.napoleon",
    "sphinx_gallery.gen_gallery",
    "mathml",
    "links",
    "layers",
    "reference",
    "api",
    "live_page",
    "pictures",
    "signal_flow",
]
# The gallery also writes its examples as notebooks to download; its pages are the .rst files.
exclude_patterns = ["_build", ".jupyter_cache", "gallery/GALLERY_HEADER.rst", "gallery/*.ipynb"]

# Pages are Markdown with mathematics between dollar signs; every heading down to the third level can be linked to.
myst_enable_extensions = ["dollarmath", "amsmath", "deflist"]
myst_heading_anchors = 3

# Notebooks are kept without outputs and executed by the build, in a temporary folder, because they write files. What
# was executed is kept until the notebook or undertow changes. An exercise stands as the reader finds it.
_CODE = hashlib.sha256(b"".join(path.read_bytes() for path in sorted((HERE.parent / "undertow").rglob("*.py"))))
nb_execution_mode = "cache"
nb_execution_cache_path = str(HERE / ".jupyter_cache" / _CODE.hexdigest()[:16])
nb_execution_in_temp = True
nb_execution_raise_on_error = True
nb_execution_timeout = 900  # s for each cell
nb_merge_streams = True
nb_ipywidgets_js = {}  # no notebook shows a widget, whose scripts would be loaded from a network

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
