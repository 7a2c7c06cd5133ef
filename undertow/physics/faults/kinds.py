"""All kinds of faults: which target can fail in which mode, and what the severity of each means."""

from collections.abc import Iterable
from typing import Any, NamedTuple

from undertow.core import catalogue
from undertow.core.errors import BadInput
from undertow.physics.faults.mode import NO_SEVERITY, TARGET, AbstractFault, AbstractThrustMode
from undertow.physics.faults.targets import FaultTarget, all_targets


class FaultKind(NamedTuple):
    """A kind of fault, with the meaning of its severity.

    Attributes:
        target, mode: as a scenario gives them.
        meaning: of the severity; "none" where it has none and may not be given.
        unit: of the severity.
        default: severity unless given; None where it has none.
        lowest, highest: range of the severity; None where it has none.
        can_be_announced: whether the controller may be informed.
    """

    target: str
    mode: str
    meaning: str
    unit: str
    default: float | None
    lowest: float | None
    highest: float | None
    can_be_announced: bool


def supports(target: FaultTarget, fault: AbstractFault) -> bool:
    """Whether a target can fail in this way."""
    if isinstance(fault, AbstractThrustMode) and target.name == "input":
        return False
    return target.role in fault.targets


def kind_of(target: FaultTarget, mode: str, fault: AbstractFault) -> FaultKind:
    """Kind of a fault, with default and range of its severity for this target."""
    announced = target.role in ("thruster", "bus")
    if fault.severity == NO_SEVERITY:
        return FaultKind(target.name, mode, "none", "", None, None, None, announced)
    meaning, unit, default, lowest, highest = fault.severity
    if unit == TARGET:
        unit, default = target.unit, default * target.size
    return FaultKind(target.name, mode, meaning, unit, default, lowest, highest, announced)


def list_kinds(targets: Iterable[FaultTarget] | None = None) -> list[FaultKind]:
    """All kinds of faults of the catalogue, by target and mode; for the targets of one loop where these are given."""
    found = all_targets().values() if targets is None else targets
    modes: dict[str, Any] = {name: part() for name, part in sorted(catalogue.names("faults").items())}
    return [kind_of(one, name, fault) for one in found for name, fault in modes.items() if supports(one, fault)]


def severity_cells(kind: FaultKind) -> tuple[str, str, str, str]:
    """Meaning, unit, default and range of a severity as text, for tables."""
    if kind.default is None:
        return kind.meaning, "", "", ""
    return kind.meaning, kind.unit or "1", f"{kind.default:g}", f"{kind.lowest:g} to {kind.highest:g}"


def check_pair(target: FaultTarget, mode: str, fault: AbstractFault) -> FaultKind:
    """The kind of a fault.

    Raises:
        BadInput: the target cannot fail in this mode; the error names its modes.
    """
    if not supports(target, fault):
        modes = ", ".join(dict.fromkeys(kind.mode for kind in list_kinds([target])))
        raise BadInput("mode", f"be a mode of `{target.name}`", mode, hint=f"Its modes: {modes}")
    return kind_of(target, mode, fault)
