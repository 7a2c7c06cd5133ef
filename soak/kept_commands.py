"""Link commands one after the other in a process, for a stress test: what they compile is kept from call to call."""

import importlib
from collections.abc import Callable, Sequence
from typing import Any

from undertow.cli.interruptible import forget_interrupts, remember_interrupts
from undertow.cli.main import run
from undertow.core.process_setup import prepare

# Module and name of what takes seconds to make; and the optional package that it needs.
_COMPILED = (
    ("undertow.cli.run", "build", ""),
    ("undertow.cli.run", "_autopilot", ""),
    ("undertow.cli.ardupilot", "SteppedVehicle", ""),
    ("undertow.outside.mavlink.companion", "Autopilot", "pymavlink"),
    ("undertow.outside.mavlink.companion", "ThrusterDriver", "pymavlink"),
    ("undertow.outside.ros2.compiled_controller", "CompiledController", "cyclonedds"),
)

_kept: dict[str, Any] = {}


def kept(arguments: Sequence[str]) -> int:
    """Run a link command in this process, as `undertow` does; each process has one scenario and one kind of command."""
    if not _kept:
        prepare()
        _keep_what_is_compiled()
        remember_interrupts()
    forget_interrupts()
    return run(arguments)


def _keep_what_is_compiled() -> None:
    for module_name, name, package in _COMPILED:
        try:
            module = importlib.import_module(module_name)
        except ModuleNotFoundError as error:
            if error.name != package:
                raise
            continue
        function = getattr(module, name)
        setattr(module, name, _once(f"{module_name}.{name}", function))
    _kept.setdefault("", None)


def _once(name: str, make: Callable[..., Any]) -> Callable[..., Any]:
    def first_or_again(*arguments: Any, **options: Any) -> Any:
        if name not in _kept:
            _kept[name] = make(*arguments, **options)
        elif hasattr(_kept[name], "restart"):  # a vehicle; laws are started by their links
            _kept[name].restart()
        return _kept[name]

    return first_or_again
