"""A DDS domain of this process's own, on the loopback interface."""

import os

import pytest


@pytest.fixture(scope="session")
def domain():
    """Two processes that test at once must not meet."""
    return 100 + os.getpid() % 100


@pytest.fixture(scope="session")
def empty_domain():
    """One in which nobody else is."""
    return 200 + os.getpid() % 32
