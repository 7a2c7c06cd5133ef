"""The page in which a visitor drives a vehicle, as a file of the site: `drive/index.html`, shown in `drive.md`.

Making it takes a minute for each controller, so it is kept until undertow or the scenario changes.
"""

import hashlib
from pathlib import Path
from typing import Any

from sphinx.application import Sphinx
from sphinx.util.logging import getLogger

from undertow.core.atomic_io import write_whole
from undertow.outside.browser.browser_page import export_page
from undertow.scenario.reading import read
from undertow.studies.comparison.candidates import built_with_each

ROOT = Path(__file__).parents[2]
SCENARIO = ROOT / "examples" / "browser.yaml"
CONTROLLERS = ("robust", "pid", "ardusub")


def write_page(app: Sphinx) -> None:
    """Write the page into the site. First of all, before autodoc changes the signatures of parts."""
    if app.builder.format != "html" or not app.config.live_page:
        return
    name = f"drive-{hashlib.sha256(SCENARIO.read_bytes()).hexdigest()[:8]}-{'-'.join(CONTROLLERS)}.html"
    kept = Path(app.config.nb_execution_cache_path) / name
    if not kept.is_file():
        getLogger(__name__).info("compiling %s for the browser", ", ".join(CONTROLLERS))
        kept.parent.mkdir(parents=True, exist_ok=True)
        page = export_page(built_with_each(CONTROLLERS, read(SCENARIO), SCENARIO)).files["index.html"]
        write_whole(kept, page)
    target = Path(app.outdir) / "drive" / "index.html"
    target.parent.mkdir(parents=True, exist_ok=True)
    target.write_bytes(kept.read_bytes())


def setup(app: Sphinx) -> dict[str, Any]:
    """Register the event; `-D live_page=0` builds the site without the page."""
    app.add_config_value("live_page", True, "", bool)
    app.connect("builder-inited", write_page)
    return {"parallel_read_safe": True}
