"""`undertow check`: from the name that the user gives to all findings."""

import inspect
from collections.abc import Callable, Iterable, Mapping
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

from undertow.core import catalogue
from undertow.core.contracts import AbstractController, AbstractPlant
from undertow.core.errors import BadInput, did_you_mean, nearest
from undertow.core.kept_programs import kept_result
from undertow.core.runtime import double_outside_runs
from undertow.core.structure_key import Constant
from undertow.core.user_code import place_of
from undertow.physics.plants.double_integrator import double_integrator
from undertow.physics.thrusters.thruster import AbstractThruster
from undertow.physics.vehicles.vehicle import VehicleModel
from undertow.scenario import factory
from undertow.scenario.build import Built, build, in_its_precision
from undertow.scenario.checks.controller_check import check_stability
from undertow.scenario.checks.finding import Finding
from undertow.scenario.checks.flow_stability import checked_flow_advice
from undertow.scenario.checks.part_check import check_contract, of_plant
from undertow.scenario.checks.plant_check import derived_of_plant
from undertow.scenario.checks.thruster_check import derived_of_thruster
from undertow.scenario.checks.vehicle_lint import Facts, derived, facts_of, lint, vehicle_facts
from undertow.scenario.reading import Text, nearest_file, no_file, read
from undertow.scenario.schema import Scenario
from undertow.scenario.validation import kind_of
from undertow.scenario.vehicle_file import is_vehicle_file, read_vehicle, vehicle_location
from undertow.scenario.vehicle_schema import KEYS

Rows = tuple[tuple[str, str, str], ...]


class Report(NamedTuple):
    """Result of a check."""

    found: tuple[tuple[Finding, str], ...]  # with its location, when known
    tables: tuple[tuple[str, Rows], ...] = ()  # title, and numbers derived from the data
    kind: str = ""  # `scenario`, `campaign`, `vehicle file`, or the kind of the part
    vehicle: Facts | None = None  # numbers of the vehicle, where there is one

    @property
    def sentences(self) -> tuple[str, ...]:
        """One line each, errors first."""
        ordered = sorted(self.found, key=lambda pair: pair[0].level != "error")
        return tuple(finding.sentence(where) for finding, where in ordered)

    @property
    def errors(self) -> int:
        """Number of errors."""
        return sum(finding.level == "error" for finding, _ in self.found)


@double_outside_runs
def check(thing: str, options: Mapping[str, Any], allow_code: bool = False) -> Report:
    """Check a vehicle file, a scenario, a result file, a part by name, or `./file.py:function`.

    Args:
        thing: what to check.
        options: options of the part, or keys of the vehicle file to change.
        allow_code: whether to run code that a result file names.

    Raises:
        BadInput: it cannot be read or made.
    """
    if Path(thing).suffix == ".nc" or is_vehicle_file(thing):
        return _check_file(Path(thing), options, allow_code)
    name, part, make = _named(thing, options)
    reports = [_of_part(name, part)]
    if isinstance(part, AbstractController) and not reports[0].errors:
        reports.append(_of_feedback(make, len(part.model.coordinates.angles)))
    return _joined(reports, factory.kind_of_part(part))


def _check_file(path: Path, options: Mapping[str, Any], allow_code: bool) -> Report:
    text = read(path, allow_code=allow_code)
    kind = kind_of(text.data)
    if not kind:
        hint = did_you_mean(next(iter(text.data), ""), {*KEYS, *Scenario.model_fields})
        raise BadInput(str(path), "be a vehicle, scenario or campaign file", "without a key of any", hint=hint)
    if kind == "vehicle file":
        return _joined([_of_vehicle_file(path, options)], kind)
    if options:
        raise BadInput("--option", "be left out for a scenario", next(iter(options)))
    return _joined(_of_scenario(text), kind)


def _of_vehicle_file(path: Path, options: Mapping[str, Any]) -> Report:
    vehicle_file = read_vehicle(path, options, "")
    report = _of_vehicle(vehicle_file.data.facts(), vehicle_file.location)
    if not report.errors:
        vehicle_file.vehicle()  # raises errors that no rule covers
    return report


def _of_vehicle(facts: Facts, where: Callable[[str], str] = lambda key: "") -> Report:
    return _report(lint(facts), where, f"{facts.name} (vehicle)", derived(facts))._replace(vehicle=facts)


def _of_part(name: str, part: Any) -> Report:
    if isinstance(part, VehicleModel):
        return _of_vehicle(facts_of(part))
    if isinstance(part, AbstractThruster):
        return _of_thruster(part, f"{name} (thruster)", partial(_place, part))
    findings = check_contract(part)
    where = partial(_place, part)
    sentences = () if findings else getattr(part, "advice", tuple)()
    rows = derived_of_plant(part) if isinstance(part, AbstractPlant) and not findings else ()
    part_advice = [Finding("advice", "own", name, sentence.rstrip(".")) for sentence in sentences]
    return _report([*findings, *part_advice], where, title=f"{name} (plant)", rows=rows)


def _of_feedback(make: Callable[..., Any], axes: int, dt: float = 1e-3) -> Report:
    """A controller in a loop with a double integrator of as many outputs as the vehicle of its check."""
    plant = double_integrator(axes)
    try:
        law = make(plant.model())
        return _report(check_stability(law, plant, dt), partial(_place, law))
    except Exception:  # a law may be for vehicles only, or not differentiable
        return _report(())


def _place(part: Any, key: str) -> str:
    """Location in the user's own file of the method that a finding names."""
    thing, _, method = key.rpartition(".")
    part = part.model() if thing == "model" and isinstance(part, AbstractPlant) else part
    return place_of(part, method) if method else ""


def _of_thruster(thruster: AbstractThruster, title: str, where: Callable[[str], str]) -> Report:
    findings, rows = kept_result("thruster", Constant(thruster), lambda: _checked_thruster(thruster))
    return _report(findings, where, title, rows)


def _checked_thruster(thruster: AbstractThruster) -> tuple[tuple[Finding, ...], tuple[tuple[str, str, str], ...]]:
    """Findings, and numbers to look at unless there are errors."""
    findings = check_contract(thruster)
    broken = any(finding.level == "error" for finding in findings)
    return findings, () if broken else derived_of_thruster(thruster)


@in_its_precision
def _of_scenario(text: Text) -> list[Report]:
    """Reports on the scenario itself, its vehicle and thruster, and its plant and other parts."""
    built = build(text)
    loop = built.closed_loop
    located_advice = [
        (Finding("advice", "scenario", "", advice.says, advice.hint), advice.where)
        for advice in (*built.advice(), *checked_flow_advice(built))
    ]
    reports = [Report(tuple(located_advice), ())]
    if (facts := vehicle_facts(loop.plant, built.resolved["plant"])) is not None:
        reports.append(_of_vehicle(facts, vehicle_location(text)))
    if isinstance(thruster := getattr(loop.plant, "thruster", None), AbstractThruster):
        in_scenario = text.location("plant.thruster")
        reports.append(_of_thruster(thruster, "thruster", lambda key: _place(thruster, key) or in_scenario))
    if any(report.errors for report in reports):
        return reports  # their errors would cause others in what contains them
    findings = kept_result("contract", Constant(loop.plant), lambda: check_contract(loop.plant))
    reports.append(_report(findings, partial(_place, loop.plant)))
    if not reports[-1].errors:
        plant = loop.plant
        for part in (loop.reference, loop.disturbance, loop.navigation, loop.controller):
            findings = kept_result("contract", Constant((part, plant)), partial(_contract_beside, part, plant))
            reports.append(_report(findings, partial(_place, part)))
        if not any(report.errors for report in reports):
            reports.append(_of_own_law(built))
    return reports


def _contract_beside(part: Any, plant: AbstractPlant) -> tuple[Finding, ...]:
    return check_contract(part, of_plant(plant))


def _of_own_law(built: Built) -> Report:
    """Slopes of a controller in a file of the user's: those of the catalogue have some. Its gains are for its plant."""
    law = built.resolved["controller"]
    if not catalogue.is_user_code(law["kind"]):
        return _report(())
    axes = len(built.closed_loop.plant.outputs)
    report = _of_feedback(
        lambda model: factory.make("controllers", law, built.text.folder, (model,))[0], axes, built.scenario.loop.dt
    )
    return report._replace(found=tuple((finding, where) for finding, where in report.found if finding.rule == "slope"))


def _named(thing: str, options: Mapping[str, Any]) -> tuple[str, Any, Callable[..., Any]]:
    """Name and instance of a part, and a function that makes another one, for a given model."""
    if catalogue.is_user_code(thing) or thing.endswith(".py"):
        function = catalogue.find("", thing, what=thing)
        make = lambda *leading_arguments: factory.call(function, options, leading_arguments, Path())[0]
        _check_model_comes_first(function, options)
        part = make(*_leading(function))
        name = thing.rpartition(":")[2]
        if not factory.is_part(part):
            raise _no_part(name, part, "controllers" if factory.takes_model(function) else "")
        return name, part, make
    prefix, _, short = thing.rpartition("/")
    names_by_kind = {kind: catalogue.names(kind) for kind in catalogue.KINDS if prefix in ("", kind)}
    for kind, names in names_by_kind.items():
        if (full_name := catalogue.presets(kind).get(short, short)) in names:
            make = lambda *leading_arguments, kind=kind: factory.make(
                kind, {"kind": short, **options}, Path(), leading_arguments
            )[0]
            return short, make(*_leading(names[full_name])), make
    part_names = {name for kind, names in names_by_kind.items() for name in (*names, *catalogue.presets(kind))}
    must = "be a .yaml file, or the name of a part"
    if Path(thing).exists() or Path(thing).suffix:
        raise no_file(Path(thing), "", must)
    hint = nearest_file(Path(thing)) or nearest(short, part_names) or "`undertow list` shows the names of all parts"
    raise BadInput(thing, must, "not", hint=hint)


def _no_part(name: str, thing: Any, kind: str) -> BadInput:
    """Error for what a function returns instead of a part."""
    location = place_of(thing)
    if not location:
        hint = "Return a vehicle, thruster, plant, controller or another part"
        return BadInput("", "", f"`{name}` returns {thing!r}, which is not a part", hint=hint)
    message = f"`{name}` returns a `{type(thing).__name__}`, which is not a part"
    return BadInput("", "", message, hint=factory.derive_hint(thing, kind), where=location)


def _check_model_comes_first(function: Callable[..., Any], options: Mapping[str, Any]) -> None:
    """Check the first argument of a function in a file that defines a controller.

    Raises:
        BadInput: it is required, and not called `model`.
    """
    first = next(iter(inspect.signature(function).parameters.values()), None)
    if first is None or first.name == "model" or first.name in options or first.default is not first.empty:
        return
    classes = [
        member
        for member in getattr(function, "__globals__", {}).values()
        if inspect.isclass(member) and place_of(member)
    ]
    if any(issubclass(member, AbstractController) for member in classes):
        message = (
            f"the first argument of a controller must be `model`, but that of `{function.__name__}` is `{first.name}`"
        )
        hint = "Call it `model`: undertow gives the nominal model of the plant there"
        raise BadInput("", "", message, hint=hint, where=place_of(function))


def _leading(function: Callable[..., Any]) -> tuple[Any, ...]:
    """First argument of a controller: the model of the default vehicle."""
    if not factory.takes_model(function):
        return ()
    return (factory.make("plants", "hybrid_vehicle", Path())[0].model(),)


def _report(
    findings: Iterable[Finding], where: Callable[[str], str] = lambda key: "", title: str = "", rows: Rows = ()
) -> Report:
    located_findings = tuple((finding, where(finding.key)) for finding in findings)
    return Report(located_findings, ((title, rows),) if rows else ())


def _joined(reports: list[Report], kind: str) -> Report:
    """All reports as one; of equal findings the later one is kept, which has the location."""
    by_sentence = {finding.says: (finding, where) for report in reports for finding, where in report.found}
    tables = tuple(table for report in reports for table in report.tables)
    vehicle = next((report.vehicle for report in reports if report.vehicle is not None), None)
    return Report(tuple(by_sentence.values()), tables, kind, vehicle)
