"""The package imports where modules of Unix are missing, as on Windows."""

import subprocess
import sys
import textwrap

import pytest

# The stress test of the project starts, limits and kills processes: it needs Unix.
IMPORTS = """
import importlib, pkgutil, sys
for name in ("fcntl", "resource", "termios", "pwd", "grp", "syslog"):
    sys.modules[name] = None
import simdjit, undertow
for package in (undertow, simdjit):
    for module in pkgutil.walk_packages(package.__path__, package.__name__ + "."):
        if not module.name.endswith("__main__"):
            importlib.import_module(module.name)
"""


@pytest.mark.full
def test_every_module_imports_without_modules_of_unix():
    done = subprocess.run([sys.executable, "-c", textwrap.dedent(IMPORTS)], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr[-2000:]
