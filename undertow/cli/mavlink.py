"""`undertow mavlink`: the controller of a scenario as a MAVLink companion."""

from undertow.cli.exit_codes import report
from undertow.cli.options.mavlink import MavlinkCommand
from undertow.cli.paced_loop import run_until_signal
from undertow.cli.stages import stage
from undertow.cli.tables import wide_console
from undertow.core import checks
from undertow.outside.mavlink import Companion, CompanionLink, UdpLink, read_key
from undertow.outside.realtime.loop_settings import LoopSettings


def mavlink(command: MavlinkCommand) -> int:
    """Control the vehicle at the other end of a link until Ctrl-C; return the exit code."""
    if command.duration is not None:
        checks.positive("duration", command.duration, "s")
    key = None if command.signing_key is None else read_key(command.signing_key)
    with UdpLink(command.connect, command.system, key=key) as link:
        with stage(wide_console(), "building and compiling"):
            companion = Companion(
                command.scenario,
                source=command.source,
                output=command.output,
                target_system=command.target_system,
                target_component=command.target_component,
                frame=command.frame,
                channels=command.channels,
                timeout=command.timeout,
                relative=command.relative,
                unsupervised=command.unsupervised,
                allow_code=command.allow_code,
            )
        link.drain()  # what came while the controller was compiled
        report(f"MAVLink on UDP port {link.port}. Channels of the thrusters: {companion.channels}")
        settings = LoopSettings(max_age=command.timeout, from_safe=True)
        paced = CompanionLink(companion, link)
        return run_until_signal(companion.autopilot, paced, settings, command.duration, report, command.log)
