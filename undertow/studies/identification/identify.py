"""Identification of a vehicle: from its file and logs to numbers with intervals, judged on dives not used."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from types import MappingProxyType
from typing import NamedTuple

import numpy as np

from undertow.core import checks
from undertow.core.errors import BadInput
from undertow.core.measurement import BODY_AXES
from undertow.logs.log import Log
from undertow.scenario.build import Built, in_its_precision
from undertow.scenario.scenario_vehicle import vehicle_of
from undertow.scenario.uncertain_number import UncertainNumber
from undertow.simulation.checkpoint import Checkpoint
from undertow.studies.identification.cross_validation import (
    Validation,
    cross_validated,
    pieces_of,
    predicted,
    with_nuisances,
    with_published,
)
from undertow.studies.identification.dive import Dive
from undertow.studies.identification.estimates import METHODS, Estimates, Say
from undertow.studies.identification.fit import Fit, scores_of
from undertow.studies.identification.free_parameters import (
    FreeParameter,
    axis_parameters,
    chosen_in,
    parameters_of,
    resolved_by,
    shortest_lag,
)
from undertow.studies.identification.identified_vehicle import prior_vehicle
from undertow.studies.identification.model import IdentificationModel, Unknowns, model_of
from undertow.studies.identification.prepared_dive import PreparedDive, prepared_dive
from undertow.studies.identification.profile_likelihood import ProfileInterval, names_in, profile_intervals
from undertow.studies.identification.uncertainty import (
    Combination,
    ParameterInterval,
    Uncertainty,
    uncertainty_of,
    undetermined,
)
from undertow.studies.identification.validation import AXES

_LONGEST_STEP = 2.0  # lags of the thrusters; the fourth-order integration doubles them there, and is unstable at 2.79


class Identification(NamedTuple):
    """Result of an identification.

    Attributes:
        model: see there.
        dives: on their grids.
        segment: length of the segments, s.
        parameters: that were free.
        estimate: from all dives.
        uncertainty: of the unknowns.
        intervals: of the parameters.
        undetermined: combinations that the data do not determine.
        validation: of each dive from the others, and of dives that were not used from all.
        profiles: intervals by the profile of the likelihood, by name, of those parameters that were asked for.
        refused_axes: that no dive identifies, such as those without motion.
        findings: sentences of the checks before.
    """

    model: IdentificationModel
    dives: tuple[Dive, ...]
    segment: float
    parameters: tuple[FreeParameter, ...]
    estimate: Fit
    uncertainty: Uncertainty
    intervals: tuple[ParameterInterval, ...]
    undetermined: tuple[Combination, ...]
    validation: tuple[Validation, ...]
    profiles: Mapping[str, ProfileInterval] = MappingProxyType({})
    refused_axes: tuple[str, ...] = ()
    findings: tuple[str, ...] = ()

    @property
    def velocities(self) -> tuple[str, ...]:
        """Those of the axes that were identified, of `validation.AXES`."""
        return tuple(name for name, axis in zip(AXES, BODY_AXES, strict=True) if axis not in self.refused_axes)

    @property
    def z(self) -> np.ndarray:
        """Estimate of the parameters of the vehicle."""
        return self.estimate.z[: len(self.parameters)]


@in_its_precision
def identify(
    built: Built,
    logs: Sequence[Log],
    *,
    unseen: Sequence[Log] = (),
    free: Sequence[str] = (),
    priors: Mapping[str, UncertainNumber] | None = None,
    per_axis: bool = False,
    method: str = "output_error",
    profile: Sequence[str] = (),
    step: float = 0.05,
    segment: float = 10.0,
    validate: bool = True,
    checkpoint: Checkpoint | None = None,
    say: Say = lambda stage: None,
) -> Identification:
    """Identify a vehicle.

    Args:
        built: scenario, whose vehicle and thrusters have the prior numbers; nothing else of it matters.
        logs: with inputs and motion.
        unseen: further logs, which are only predicted.
        free: names, groups or patterns of parameters; () for the usual ones.
        priors: value and deviation beforehand, by name; those of the vehicle file unless given.
        per_axis: whether the inputs push along the six axes (sticks behind a mixer, or wrenches) instead of driving the
            thrusters.
        method: `output_error`, free runs over segments, or `prediction_error`, a Kalman filter that follows the motion:
            for dives that unknown forces disturb, such as those of a tether.
        profile: names, groups or patterns of free parameters whose intervals are also found by the profile of the
            likelihood.
        step: of the integration, s.
        segment: length of the segments, s.
        validate: whether to predict each dive from the others.
        checkpoint: keeps finished estimates; None to keep none.
        say: called with the current stage.

    Raises:
        BadInput: the plant is no vehicle, a log lacks something, inputs are of another number than thrusters or axes,
            or the step is too long for the lag of the thrusters.
    """
    checks.choice("method", method, METHODS)
    checks.positive("step", step, "s")
    checks.positive("segment", segment, "s")
    if not logs:
        raise BadInput("logs", "be given", "none")
    plant = vehicle_of(built)
    known = parameters_of(plant)
    lag = shortest_lag(plant)
    if lag is not None and not per_axis and step > _LONGEST_STEP * lag:
        must = f"be at most {_LONGEST_STEP * lag:.3g} s, as the thrusters have a lag of {lag:.3g} s"
        raise BadInput("step", must, step, hint="A step as long as the lag makes it 2 % longer")
    if per_axis:
        of_thrusters = ("thruster_gain", "reverse_gain", "lag", "command_delay")
        known = {name: p for name, p in known.items() if not name.startswith(of_thrusters)} | axis_parameters()
    asked = chosen_in(built, known, free, priors or {})
    say("checking the logs")
    prepared = [prepared_dive(plant, log, per_axis, step) for log in logs]
    only_predicted = [prepared_dive(plant, log, per_axis, step) for log in unseen]
    dives = [dive.dive for dive in prepared]
    refused = tuple(axis for axis in BODY_AXES if all(axis in dive.refused_axes for dive in prepared))
    parameters = [p for p in resolved_by(step, plant, asked) if p.name.rpartition(".")[2] not in refused]
    if not parameters or len(refused) == len(BODY_AXES):
        raise BadInput(
            "logs", "determine a parameter of some axis", "of no use for any: " + " ".join(_findings(prepared)[:3])
        )
    profiled = names_in(parameters, profile)
    model = model_of(prior_vehicle(plant, per_axis), parameters)
    count = len(parameters)
    pieces = pieces_of(dives) if validate else []
    estimates = Estimates(model, parameters, segment, method, 1 + len(pieces), say, checkpoint)
    say("first estimate")
    begin = estimates.nearest_begin(dives)
    estimate = estimates.of("all dives", dives, begin)
    scores = scores_of(model, step, estimate)
    parts, validation = None, ()
    if validate:
        parts, validation = cross_validated(model, pieces, estimate, count, estimates)
    validation += tuple(predicted(model, estimate.z[:count], dive.dive) for dive in only_predicted)
    if not per_axis:  # no gains along the axes are published
        validation = with_published(validation, built, parameters)
    say("judging how sure it is")
    uncertainty = uncertainty_of(estimate.information, scores, step, with_nuisances(parts, estimate.z, count))
    least = Unknowns(tuple(parameters), len(dives)).least()
    profiles = profile_intervals(
        model, step, estimate, least, parameters, uncertainty.reaches(parameters), profiled, say
    )
    return Identification(
        model=model,
        dives=tuple(dives),
        segment=segment,
        parameters=tuple(parameters),
        estimate=estimate,
        uncertainty=uncertainty,
        intervals=tuple(uncertainty.intervals(parameters, estimate.z)),
        undetermined=tuple(undetermined(estimate.information, parameters)),
        validation=validation,
        profiles=profiles,
        refused_axes=refused,
        findings=tuple(_findings([*prepared, *only_predicted])),
    )


def _findings(prepared: Sequence[PreparedDive]) -> list[str]:
    """Sentences of the checks, with the name of the log; equal ones once."""
    sentences: dict[str, list[str]] = {}
    for dive in prepared:
        for finding in dive.findings:
            sentences.setdefault(finding, []).append(Path(dive.dive.name).name)
    labelled = []
    for sentence, names in sentences.items():
        where = "all logs" if len(names) == len(prepared) > 1 else ", ".join(names)
        labelled.append(f"{where}: {sentence}")
    return labelled
