"""`undertow mavlink`: the controller of a scenario as a MAVLink companion."""

import time
from pathlib import Path

from undertow.cli.exit_codes import DONE, report
from undertow.cli.stages import stage
from undertow.cli.tables import wide_console
from undertow.core import checks
from undertow.core.errors import BadInput


def mavlink(
    scenario: Path,
    connect: str,
    output: str,
    source: str,
    system: int,
    target_system: int,
    target_component: int,
    frame: str | None,
    channels: str | None,
    timeout: float,
    duration: float | None,
    allow_code: bool,
) -> int:
    """Control the vehicle at the other end of a link until Ctrl-C; return the exit code."""
    try:
        from undertow.interop.mavlink import Companion, UdpLink, accompany
    except ModuleNotFoundError as error:
        if error.name != "pymavlink":
            raise
        raise BadInput("", "", str(error)) from None
    if duration is not None:
        checks.positive("duration", duration, "s")
    console = wide_console()
    with UdpLink(connect, system) as link:
        with stage(console, "building and compiling"):
            companion = Companion(
                scenario,
                source=source,
                output=output,
                target_system=target_system,
                target_component=target_component,
                frame=frame,
                channels=channels,
                timeout=timeout,
                allow_code=allow_code,
            )
        link.drain()  # what came while the law was compiled
        report(f"MAVLink on UDP port {link.port}. Channels of the thrusters: {companion.channels}")
        end = float("inf") if duration is None else time.monotonic() + duration
        accompany(companion, link, report, until=lambda: time.monotonic() >= end)
    return DONE
