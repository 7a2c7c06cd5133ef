"""`undertow campaign` as it is typed, and the bytes that it leaves."""

import subprocess
import sys

from undertow.studies.campaign.run_campaign import STORE

TYPED = (sys.executable, "-W", "ignore", "-m", "undertow")
VEHICLE = {
    "controller": {"kind": "pid"},
    "reference": {"kind": "setpoint", "position": [0.0] * 6},
    "loop": {"duration": 0.1, "dt": 0.01, "record": 0.1},
}


def contents(folder):
    """Bytes of every file of the store."""
    store = folder / STORE
    return {str(file.relative_to(store)): file.read_bytes() for file in sorted(store.rglob("*")) if file.is_file()}


def typed(path, out, *options, **settings):
    arguments = [*TYPED, "campaign", str(path), "--out", str(out), *options]
    quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
    return subprocess.Popen(arguments, **(quiet | settings))
