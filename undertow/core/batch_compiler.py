"""The batch compiler `simdjit`, which is optional: without it nothing is compiled by it, and `unavailable` says why."""

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import simdjit
    from simdjit import Unsupported
else:
    try:
        import simdjit
        from simdjit import Unsupported

        simdjit.Loop  # noqa: B018 - loads LLVM, which may be missing
    except ImportError as error:
        simdjit = None
        _REASON = (
            f"the batch compiler cannot be imported ({error}). `pip install .` in the folder of undertow installs it"
        )

        class Unsupported(Exception):
            """The batch compiler cannot make a program; the message says why."""

    else:
        _REASON = ""


def unavailable() -> str:
    """Why nothing can be compiled by it on this machine; empty where it can."""
    return "" if TYPE_CHECKING else _REASON
