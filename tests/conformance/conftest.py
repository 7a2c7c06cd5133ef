"""Every part of the catalogue for a test: one by one, or all at once."""

import pytest
from catalogue_parts import ALL, make, required


def pytest_generate_tests(metafunc):
    """Tests with the argument `part` run for every part there is; those that the module calls HEAVY are slow tests."""
    heavy = getattr(metafunc.module, "HEAVY", ())
    if "part" in metafunc.fixturenames:
        marked = [pytest.param(pair, marks=pytest.mark.slow) if pair in heavy else pair for pair in ALL]
        metafunc.parametrize("part", marked, ids=["/".join(pair) for pair in ALL], indirect=True)


@pytest.fixture
def part(request):
    kind, name = request.param
    return kind, make(kind, name)


@pytest.fixture
def all_parts():
    """Every part by kind and name."""
    return {pair: make(*pair) for pair in ALL}


@pytest.fixture
def all_made_anew():
    """Makes every part, and everything that they are made from, once more."""

    def made():
        make.cache_clear()
        required.cache_clear()
        return {pair: make(*pair) for pair in ALL}

    return made
