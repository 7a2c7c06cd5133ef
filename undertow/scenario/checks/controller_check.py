"""Checks of a controller: its contract, and stability with a double integrator."""

from collections.abc import Iterator

import jax
import jax.numpy as jnp
import numpy as np

from undertow.analysis.linearization import margins
from undertow.analysis.linearization.equilibrium import equilibrium
from undertow.control.navigation.perfect import perfect
from undertow.control.references.setpoint import setpoint
from undertow.core.contracts import AbstractController, Target
from undertow.core.return_checks import PAIR, STATE, form
from undertow.core.signals import check_declared
from undertow.physics.disturbances.none import none
from undertow.physics.plants.double_integrator import DoubleIntegrator
from undertow.scenario.checks.finding import Finding, advice, same_structure, shaped, two_values
from undertow.simulation.loop.closed_loop import ClosedLoop

_GROWTH = 0.01  # 1/s; a slower one may be rounding
_DEFAULT = "Tried with the default vehicle; for another plant, check a scenario"


def check_controller(controller: AbstractController) -> Iterator[Finding]:
    """Findings from every method, traced as in a loop, near the origin; then with numbers."""
    n = len(controller.model.coordinates.angles)
    y = controller.model.coordinates.measurement(0.1 * jnp.ones(n), jnp.zeros(n))
    r, dt = Target(jnp.zeros(n), jnp.zeros(n), jnp.zeros(n)), jnp.asarray(1e-3)
    z = jax.eval_shape(controller.init, y, r)
    answer = jax.eval_shape(controller.command, z, y, r)
    if findings := list(two_values("command", answer, PAIR)):
        yield from findings
        return
    u, signals = answer
    inputs = controller.model.dynamics.gain(y).shape[1]
    if getattr(u, "shape", None) != (inputs,):
        due = f"must return an input of shape {(inputs,)}, one entry per input of the plant"
        yield Finding("error", "contract", "command", f"`command` {due}, but returns {form(u)}", _DEFAULT)
        return
    check_declared(controller, signals, "command")
    sizes = {"axis": n, "actuator": inputs}
    for name, signal in controller.signals().items():
        own_sizes = dict(zip(signal.dimensions, signals[name].shape, strict=False))  # sizes of the law's own dimensions
        expected_shape = tuple(sizes.get(dimension, own_sizes.get(dimension, 1)) for dimension in signal.dimensions)
        yield from shaped(f"command, signal {name}", signals[name], expected_shape)  # pyright: ignore[reportArgumentType] - every size is known here
    after = jax.eval_shape(controller.advance, z, y, r, u, dt)
    findings = list(same_structure("advance", after, z, STATE, types=True))
    yield from findings or shaped(
        "command", jax.jit(lambda: controller.command(controller.init(y, r), y, r)[0])(), (inputs,)
    )


def check_stability(controller: AbstractController, plant: DoubleIntegrator, dt: float = 1e-3) -> Iterator[Finding]:
    """Advice where the loop of a controller with x_ddot = u, linearised at the origin, is unstable.

    Args:
        controller: controller made with the model of this plant.
        plant: plant of the test.
        dt: sampling time, s.
    """
    zeros = np.zeros(len(plant.outputs))
    loop = ClosedLoop(plant, controller, setpoint(zeros), none(), perfect())
    at = equilibrium(loop, dt, zeros, zeros)
    try:
        radius, reversed_radius = (margins.spectral_radius(margins.closed(at, dt, gain=gain)) for gain in (1.0, -1.0))
    except margins.NoSlopes:
        got = "without one there, so that no loop with this law can be analysed or predicted"
        hint = "sqrt(|e|) and |e|^0.6 have such slopes: add a small number, as in sqrt(e^2 + 1e-6)^0.6 sign(e)"
        yield advice("slope", "command", "have a finite slope where the error is zero", got, hint)
        return
    if at.found and radius > 1 + _GROWTH * dt:
        got = f"unstable there: the linearised closed loop has a spectral radius of {radius:.6g} at steps of {dt:g} s"
        hint = "Check the gains, and the signs of input and state: the error is target minus position"
        if reversed_radius < radius and reversed_radius <= 1 + _GROWTH * dt:
            hint = "With the opposite sign of the input it is stable: the error is target minus position"
        yield advice("stability", "command", "bring a double integrator, x_ddot = u, back to the origin", got, hint)
