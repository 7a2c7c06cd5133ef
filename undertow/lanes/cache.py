"""Where compiled code is kept, from one process to the next."""

import os
from pathlib import Path


def cache_folder() -> Path:
    """UNDERTOW_CACHE, or `undertow` in the user's folder of caches."""
    told = os.environ.get("UNDERTOW_CACHE")
    return Path(told) if told else Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "undertow"
