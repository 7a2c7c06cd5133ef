"""`undertow mavlink`: the controller of a scenario as a MAVLink companion."""

from pathlib import Path
from typing import NamedTuple

from undertow.cli.exit_codes import report
from undertow.cli.paced_loop import run_until_signal
from undertow.cli.stages import stage
from undertow.cli.tables import wide_console
from undertow.core import checks
from undertow.core.errors import BadInput
from undertow.realtime.loop_settings import LoopSettings


class Options(NamedTuple):
    """Options of the command, as given; None where one was not."""

    connect: str
    output: str
    source: str
    system: int
    target_system: int
    target_component: int
    signing_key: Path | None
    relative: bool
    frame: str | None
    channels: str | None
    timeout: float
    duration: float | None
    unsupervised: bool
    allow_code: bool


def mavlink(scenario: Path, options: Options) -> int:
    """Control the vehicle at the other end of a link until Ctrl-C; return the exit code."""
    try:
        from undertow.interop.mavlink import Companion, CompanionLink, UdpLink, read_key
    except ModuleNotFoundError as error:
        if error.name != "pymavlink":
            raise
        raise BadInput("", "", str(error)) from None
    if options.duration is not None:
        checks.positive("duration", options.duration, "s")
    key = None if options.signing_key is None else read_key(options.signing_key)
    with UdpLink(options.connect, options.system, key=key) as link:
        with stage(wide_console(), "building and compiling"):
            companion = Companion(
                scenario,
                source=options.source,
                output=options.output,
                target_system=options.target_system,
                target_component=options.target_component,
                frame=options.frame,
                channels=options.channels,
                timeout=options.timeout,
                relative=options.relative,
                unsupervised=options.unsupervised,
                allow_code=options.allow_code,
            )
        link.drain()  # what came while the controller was compiled
        report(f"MAVLink on UDP port {link.port}. Channels of the thrusters: {companion.channels}")
        settings = LoopSettings(max_age=options.timeout, from_safe=True)
        return run_until_signal(companion.autopilot, CompanionLink(companion, link), settings, options.duration, report)
