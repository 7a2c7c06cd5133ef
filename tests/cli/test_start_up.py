"""`undertow --help` answers at once: nothing heavy is imported before a command runs."""

import subprocess
import sys
import time

import pytest

pytestmark = pytest.mark.full

HEAVY = "{'jax', 'numpy', 'xarray', 'matplotlib', 'ruamel', 'diffrax', 'equinox'}"


def python(code: str) -> str:
    return subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout


def test_help_imports_nothing_heavy():
    code = f"import sys; from undertow.cli.main import run; run(['--help']); print({HEAVY} & set(sys.modules))"
    assert python(code).splitlines()[-1] == "set()"


def test_mistyped_option_imports_nothing_heavy():
    code = f"import sys; from undertow.cli.main import run; run(['list', '--x']); print({HEAVY} & set(sys.modules))"
    assert python(code).splitlines()[-1] == "set()"


def test_import_of_the_package_is_light():
    assert python(f"import sys, undertow; dir(undertow); print({HEAVY} & set(sys.modules))").strip() == "set()"


def test_help_takes_less_than_half_a_second():
    """Processor time, the best of three: the machine may be busy with other tests."""
    code = "import time; from undertow.cli.main import run; run(['--help']); print(time.process_time())"
    started = time.perf_counter()
    assert min(float(python(code).splitlines()[-1]) for _ in range(3)) < 0.5
    assert time.perf_counter() - started < 60
