"""The next experiment: a script that lowers the deviations of a vehicle's numbers most, within a room.

Candidates are blocks of ten seconds. One long simulated dive has all of them, with rests between; the information of
each block about the free parameters comes from exact derivatives along that motion. Blocks are then chosen by exchange.
The whole script is rehearsed, with the vehicle of the file and with others within its deviations, and made smaller
until they stay within the limits. What is predicted is the median of what these rehearsals tell.
"""

from collections.abc import Callable, Sequence

import jax.numpy as jnp
import numpy as np

from undertow.core import checks
from undertow.core.authority import authority_of, limits_of
from undertow.core.errors import BadInput
from undertow.core.measurement import BODY_AXES
from undertow.physics.plants.hybrid_vehicle import HybridVehicle
from undertow.scenario.build import Built, build, in_its_precision
from undertow.scenario.scenario_vehicle import deviations_in, vehicle_of
from undertow.studies.identification.block_choice import greedy_choice, shares_left
from undertow.studies.identification.design_result import Design, DesignRequest, ExpectedDeviation
from undertow.studies.identification.dive_information import information_of
from undertow.studies.identification.excitation_blocks import BLOCK, ExcitationBlock, candidates, script
from undertow.studies.identification.experiment_scenario import (
    LEAD,
    REST,
    ExperimentLimits,
    experiment_scenario,
    station_of,
    with_supervisor,
)
from undertow.studies.identification.free_parameters import chosen, chosen_in, parameters_of
from undertow.studies.identification.identified_vehicle import prior_vehicle
from undertow.studies.identification.model import Unknowns, model_of
from undertow.studies.identification.rehearsal import Rehearsal, rehearse, with_vehicle
from undertow.studies.identification.uncertainty import undetermined

Say = Callable[[str], None]

STEP = 0.05  # s, of the grid
_PAUSE = 10.0  # s between the candidates, in which the vehicle comes back
_BLOCK_USE = 0.7  # of the limits that a block may use by itself
_USE = 0.95  # that a rehearsal may use
_SMALLER = 0.85  # factor on all forces where a rehearsal uses more
_TRIES = 10
_OTHERS = 12  # vehicles within the deviations, with which the script is rehearsed
_LEAVING = 1  # of these may leave: some are hardly stable, and the limits end their script
_USUAL_SPREAD = 0.3  # of these, where neither the vehicle file nor the user states a deviation
_LARGEST_INPUT = 0.9  # of the limit of the thrusters, where no other is given


@in_its_precision
def design(built: Built, request: DesignRequest, say: Say = lambda stage: None) -> Design:
    """Design an experiment.

    Args:
        built: scenario with the vehicle, its surroundings, and the navigation with which the law and the identification
            see it.
        request: see there.
        say: called with the current stage.

    Raises:
        BadInput: the plant is no vehicle, a number is out of its range, or no candidate stays in the room.
    """
    plant = vehicle_of(built)
    slots = _slots(request)
    model, parameters, of_interest = _free(built, plant, request)
    unknowns = Unknowns(tuple(parameters), 1)
    station = station_of(built, request.room, request.depth)
    limits = _limits(plant, request, station)
    say("simulating the candidates")
    blocks, information = _candidates(built, plant, station, limits, model, unknowns)
    say(f"choosing {slots} of {len(blocks)} blocks")
    picked = [blocks[i] for i in greedy_choice(information, of_interest, slots)]
    vehicles = _vehicles(unknowns, {*deviations_in(built), *request.priors})
    scenario, scale, rehearsals = _rehearsed(built, picked, station, limits, model, vehicles, say)
    say("predicting")
    pairs = [pair for pair in zip(vehicles, rehearsals, strict=True) if pair[1].abort == 0]
    totals = [information_of(model, z, rehearsal.dive, BLOCK).sum(axis=0) for z, rehearsal in pairs]
    shares = np.median([shares_left(total, range(len(parameters))) for total in totals], axis=0)
    expected = tuple(ExpectedDeviation(p, float(shares[i]), i in of_interest) for i, p in enumerate(parameters))
    return Design(
        scenario=with_supervisor(built, scenario, limits),
        blocks=tuple(picked),
        scale=scale,
        limits=limits,
        expected=expected,
        undetermined=tuple(undetermined(totals[0] + np.eye(len(totals[0])), parameters)),
        rehearsal=rehearsals[0],
        use=tuple(float(each.use_of(limits).max()) for each in rehearsals),
        model=model,
        notes=_notes(rehearsals[0]),
    )


def _slots(request: DesignRequest) -> int:
    for i, side in enumerate(request.room):
        checks.positive(f"room[{i}]", side, "m")
    for name in ("max_rate", "max_angle"):
        checks.positive(name, getattr(request, name))
    slots = int((request.duration - LEAD - REST) // BLOCK)
    if slots < 1:
        raise BadInput("duration", f"be {BLOCK + LEAD + REST:g} s or more", f"{request.duration:g} s")
    return slots


def _free(built: Built, plant: HybridVehicle, request: DesignRequest):
    """The model, its free parameters, and the numbers of those of interest."""
    known = parameters_of(plant)
    parameters = chosen_in(built, known, request.free, request.priors)
    by_name = {parameter.name: parameter for parameter in parameters}
    names = {p.name for p in chosen(by_name, request.of_interest)} if request.of_interest else set(by_name)
    of_interest = [i for i, parameter in enumerate(parameters) if parameter.name in names]
    return model_of(prior_vehicle(plant), parameters), parameters, of_interest


def _limits(plant: HybridVehicle, request: DesignRequest, station: Sequence[float]) -> ExperimentLimits:
    largest = float(np.abs(np.asarray(jnp.stack(limits_of(plant, plant.initial_state())))).min())
    largest_input = _LARGEST_INPUT * largest if request.max_input is None else request.max_input
    if not np.isfinite(largest_input):
        raise BadInput("max_input", "be given, because the thrusters have no limit")
    half = request.room[2] / 2
    depth = (station[2] - half, station[2] + half)
    return ExperimentLimits(request.room, depth, request.max_rate, request.max_angle, largest_input)


def _candidates(built: Built, plant: HybridVehicle, station, limits: ExperimentLimits, model, unknowns: Unknowns):
    """Candidates that stay within the limits, and the information of each."""
    body_model = plant.model().in_body_axes()
    mass = np.diagonal(np.asarray(plant.body.mass_matrix))
    largest = np.asarray(authority_of(body_model, plant)) * mass
    blocks = candidates(np.where(np.isfinite(largest), largest, mass), BODY_AXES)
    rows = script(blocks, LEAD, _PAUSE)
    library = rehearse(build(experiment_scenario(built, rows, station)), station, STEP)
    use = library.use_of(limits)
    period = BLOCK + _PAUSE
    begins = LEAD + period * np.arange(len(blocks))
    uses = [use[(library.time >= begin) & (library.time < begin + period)].max() for begin in begins]
    fitting = [number for number in range(len(blocks)) if uses[number] < _BLOCK_USE]
    if not fitting:
        raise BadInput("room", "leave room for some motion", _in_words(limits.room))
    # Segments are as long as a block or a pause; the one before the first block is at rest.
    segments = [1 + round(number * period / BLOCK) for number in fitting]
    information = information_of(model, np.zeros(len(unknowns.all())), library.dive, BLOCK, segments)
    return [blocks[number] for number in fitting], information


def _vehicles(unknowns: Unknowns, stated: set[str]) -> list[np.ndarray]:
    """Numbers of the vehicle of the file, and of some within its deviations; usual deviations are wide on purpose."""
    generator = np.random.default_rng(0)
    least = unknowns.least()
    spread = np.array([1.0 if p.name in stated else _USUAL_SPREAD for p in unknowns.parameters])
    vehicles = [np.zeros(len(least))]
    for _ in range(_OTHERS):
        z = np.zeros(len(least))
        z[: len(spread)] = spread * generator.standard_normal(len(spread))
        vehicles.append(np.maximum(z, least))
    return vehicles


def _rehearsed(
    built: Built,
    picked: Sequence[ExcitationBlock],
    station,
    limits: ExperimentLimits,
    model,
    vehicles: Sequence[np.ndarray],
    say,
):
    """Scenario of the script, smaller until the vehicles stay within the limits; the factor, and the rehearsals."""
    scale = 1.0
    for trial in range(_TRIES):
        say(f"rehearsal {trial + 1}")
        rows = script([block._replace(wrenches=scale * block.wrenches) for block in picked], LEAD)
        scenario = experiment_scenario(built, rows, station, limits)
        placed = build(scenario)
        rehearsals: list[Rehearsal] = []
        leaving = 0
        for z in vehicles:
            rehearsals.append(rehearse(with_vehicle(placed, model, z), station, STEP))
            leaving += rehearsals[-1].use_of(limits).max() > _USE
            if leaving > (_LEAVING if len(rehearsals) > 1 else 0):
                break
        else:
            return scenario, scale, rehearsals
        scale *= _SMALLER
    hint = "Give a larger room, or the numbers of the vehicle smaller deviations"
    raise BadInput("room", "hold vehicles within the deviations", _in_words(limits.room), hint=hint)


def _in_words(room: Sequence[float]) -> str:
    return " x ".join(f"{side:g}" for side in room) + " m"


def _notes(rehearsal: Rehearsal) -> tuple[str, ...]:
    if not rehearsal.dive.is_usual:
        return ()
    return (
        "The scenario measures without noise: that of an acoustic position, an attitude reference, a DVL and gyros was "
        "assumed. Give its `navigation` the noise of your sensors.",
    )
