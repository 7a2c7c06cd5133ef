"""Operating point of a scenario under its mean load, and the metrics predicted from there."""

from typing import NamedTuple

import numpy as np

from undertow.analysis.linearization import margins
from undertow.analysis.linearization.disturbance_profile import DisturbanceProfile, disturbance_profile
from undertow.analysis.linearization.equilibrium import Equilibrium, equilibrium
from undertow.analysis.linearization.linear_loop import LinearLoop
from undertow.analysis.linearization.response import from_start, metrics_of, signals_within
from undertow.analysis.theory import theory_of
from undertow.core.arrays import as_array
from undertow.core.contracts import AbstractController, AbstractPlant, AbstractReference, Inputs, Outputs, Time
from undertow.core.kept_programs import briefly_compiled
from undertow.core.numerics.random_keys import key_of_seed
from undertow.scenario.build import Built

_MAX_STEPS = 200_000  # largest number of predicted steps
_ABSURD = 10.0  # an input of so many times its limit comes from a gain near zero, not from the load
_LITTLE = 0.05  # of its limit: an input close to zero
_HUGE = 1e9  # an input beyond every limit


class OperatingPoint(NamedTuple):
    """Equilibrium of a scenario's loop under its mean load, with the disturbances along the reference."""

    built: Built
    around: DisturbanceProfile
    mean: Equilibrium
    linear: LinearLoop
    radius: float  # spectral radius of `linear`


def operating_point(built: Built) -> OperatingPoint:
    """Equilibrium of a scenario's loop under the mean load of its steady window, with its linearisation.

    Raises:
        BadInput: the Jacobians are not finite there.
    """
    built = built.of_the_law()
    loop, settings = built.closed_loop, built.scenario.loop
    start, stop = built.window()
    position = np.asarray(_desired(loop.reference, as_array((start + min(stop, settings.duration)) / 2)))
    unloaded = equilibrium(loop, settings.dt, position, np.zeros(len(position)))
    steps = min(round(settings.duration / settings.dt) + 1, _MAX_STEPS)
    outputs = loop.outputs_at_start(built.scenario.initial.position, built.scenario.initial.velocity)
    around = disturbance_profile(loop, unloaded, key_of_seed(built.scenario.seed), steps, settings.dt, outputs)
    inside = (around.time >= start) & (around.time <= stop)
    steady = inside if inside.any() else slice(None)
    load, flow = around.load[steady].mean(axis=0), None if around.flow is None else around.flow[steady].mean(axis=0)
    mean = equilibrium(loop, settings.dt, position, load, flow)
    linear = margins.closed(mean, settings.dt, settings.kind)
    return OperatingPoint(built, around, mean, linear, margins.spectral_radius(linear))


@briefly_compiled
def _desired(reference: AbstractReference, t: Time) -> Outputs:
    return reference.at(t).position


def instability(op_point: OperatingPoint) -> str:
    """A sentence where small errors grow about the equilibrium under the mean load; otherwise empty."""
    if not op_point.mean.found or op_point.radius < 1:
        return ""
    output, pole = margins.fastest_growing_error(op_point.linear, op_point.radius)
    name = op_point.built.closed_loop.plant.outputs[output]
    return f"the loop is unstable: a small error in {name} grows by {max(pole.real, 0.0):.2g} 1/s"


def predicted(op_point: OperatingPoint) -> tuple[dict[str, float] | None, str]:
    """Metrics of the steady window from the linearised loop; or None, and the reason."""
    if not op_point.mean.found:
        rate = f"{op_point.mean.moving:.2g} per second"
        return None, f"no equilibrium of the loop was found under the mean load: a state still changes by {rate}"
    if op_point.radius >= 1:
        pole = margins.poles(op_point.linear)[0]
        turning = f"+- {abs(pole.imag):.3g}j " if pole.imag else ""
        adapts = theory_of(op_point.built.closed_loop.controller).adapts
        loop = "loop linearised at fixed weights" if adapts else "linearised loop"
        why_not = f"the {loop} is unstable: rightmost pole {pole.real:+.3g} {turning}1/s"
        if adapts:
            why_not += "; adapting weights may change that, which only a run shows"
        return None, why_not
    start, stop = op_point.built.window()
    settings = op_point.built.scenario.loop
    every = max(1, round(settings.record / settings.dt))
    assert op_point.around.start is not None
    transient = from_start(op_point.linear, op_point.mean, *op_point.around.start)
    signals = signals_within(op_point.mean, transient, op_point.around, (start, stop), every)
    forbidden = _forbidden(op_point.built.closed_loop.controller, signals) or _beyond_limits(op_point, signals["u"])
    units = op_point.built.closed_loop.plant.output_units
    return (None, forbidden) if forbidden else (metrics_of(signals, units), "")


def _forbidden(law: AbstractController, signals: dict[str, np.ndarray]) -> str:
    """A sentence where predicted signals exceed a bound of the controller; otherwise empty."""
    for name, (meaning, bound) in theory_of(law).limits.items():
        share = np.abs(signals[name]) / np.maximum(np.asarray(bound, dtype=float), 1e-300)
        if share.max() > 1 and np.abs(signals[name]).max() > 0:
            row, axis = np.unravel_index(share.argmax(), share.shape)
            limit = np.broadcast_to(np.asarray(bound, dtype=float), share.shape[1:])[axis]
            required = f"the linear model requires a {meaning} of {abs(signals[name][row, axis]):.3g}"
            return f"{required}, which the controller limits to {limit:.3g}: the loop leaves its linear range"
    return ""


def _beyond_limits(op_point: OperatingPoint, inputs: np.ndarray) -> str:
    """A sentence where an input would have to be beyond its limit on average; short peaks only saturate for a while."""
    size = np.sqrt((inputs**2).mean(axis=0))
    low, high = input_limits(op_point.built, op_point.mean)
    share = size / np.maximum(-low, high)
    if share.max(initial=0.0) <= 1:
        return ""
    worst = int(share.argmax())
    unit = op_point.built.closed_loop.plant.input_unit
    at_rest = op_point.mean.at["u"][worst]
    if share[worst] > _ABSURD and abs(at_rest) < _LITTLE * max(-low[worst], high[worst]):
        return (
            f"the loop is in equilibrium with input {worst + 1} at {at_rest:.2g} {unit}, where it has almost no effect "
            "(in a dead zone, or where force grows with its square), so that no linear model describes the loop there. "
            "The run itself is not affected"
        )
    required = f"the linear model requires {size[worst]:.3g} {unit} (rms) of input {worst + 1}"
    limit = f"which is limited to {max(-low[worst], high[worst]):.3g} {unit}"
    return f"{required}, {limit}: the loop leaves its linear range"


def input_limits(built: Built, at: Equilibrium) -> tuple[np.ndarray, np.ndarray]:
    """Smallest and largest input that reaches the actuators; infinite without a limit."""
    plant = built.closed_loop.plant
    x, _ = at.parts.states(at.at)
    low, high = (np.asarray(_admissible(plant, x, as_array(np.full(plant.inputs(), ask)))) for ask in (-_HUGE, _HUGE))
    return np.where(low < -0.1 * _HUGE, -np.inf, low), np.where(high > 0.1 * _HUGE, np.inf, high)


@briefly_compiled
def _admissible(plant: AbstractPlant, x, ask: Inputs) -> Inputs:
    return plant.admissible(x, ask)
