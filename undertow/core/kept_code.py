"""What is kept from one process to the next: by the batch compiler, where that is installed. Imports no JAX."""

from collections.abc import Callable
from typing import TYPE_CHECKING

from undertow.core.process_setup import cache_folder

if TYPE_CHECKING:
    from simdjit import cached
else:
    try:
        from simdjit import cached
    except ImportError:
        cached = None

KEEPS = TYPE_CHECKING or cached is not None


def kept_code(key: object, make: Callable[[], bytes]) -> bytes:
    """What `make` gives, or gave in an earlier process; made each time without the batch compiler.

    Args:
        key: everything that it depends on; by its `repr`.
        make: computes it.
    """
    return cached(key, ".xla", make, cache_folder() / "native") if KEEPS else make()
