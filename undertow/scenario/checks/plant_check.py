"""Checks of a plant: its contract, and agreement with its model."""

from collections.abc import Iterator
from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, PyTree

from undertow.core.contracts import AbstractPlant, Effort, Measurement, Model
from undertow.core.signals import check_declared
from undertow.scenario.checks.finding import Finding, agree, error, is_a, same_structure, shaped

_GRIP = 1e-9  # of the largest entry: below it an input does not act at once


def check_plant(plant: AbstractPlant) -> Iterator[Finding]:
    """Findings from every method near the origin, each result against another way to the same number."""
    findings = [*_forms(plant), *is_a("advice", plant.advice(), tuple)]
    findings = findings or list(_forms_of_model(plant))
    if findings:
        yield from findings
        return
    results = jax.jit(partial(_numbers, plant))(_trial(plant))
    yield from agree("output", results["velocity"], results["position_rate"], "the rate of its position")
    yield from agree("acceleration", results["acceleration"], results["velocity_rate"], "the rate of the output")
    added = "the lumped acceleration of the load, which adds to it"
    yield from agree("acceleration", results["gained"], _extra(plant), added)
    held, gain, true_gain = results["held"], results["gain"], results["true_gain"]
    if not (held < 0).all():
        i = int(np.argmax(held))
        got = f"{held[i]:.4g} for a unit of it on {plant.outputs[i]}"
        hint = "It stands on the left side of Eq. (2): subtract it from the forces"
        yield error("contract", "acceleration", "fall with the wrench of the load", got, hint)
    yield from agree("invert", results["reached"], results["reachable"], "`gain`: G G# a = a")
    if np.abs(true_gain).max() > _GRIP and float((true_gain * gain).sum()) < 0:
        i, j = np.unravel_index(np.abs(gain).argmax(), gain.shape)
        got = f"{gain[i, j]:.4g} where x_ddot changes by {true_gain[i, j]:.4g} per unit"
        yield error("contract", "gain", "push where the plant does", got)


def derived_of_plant(plant: AbstractPlant) -> tuple[tuple[str, str, str], ...]:
    """Rows (what, value, unit) at the point of `check_plant`."""
    n, m, t, no_load = len(plant.outputs), plant.inputs(), jnp.zeros(()), plant.no_load()
    x, dynamics = _trial(plant), plant.model().dynamics
    y, u = plant.output(t, x), plant.admissible(x, jnp.zeros(m))
    gain = np.asarray(dynamics.gain(y))
    true = np.asarray(plant.acceleration(t, x, u, no_load))
    rows = [("outputs, inputs, rank of G", f"{n}, {m}, {np.linalg.matrix_rank(gain, tol=1e-9)}", "")]
    for i, (name, unit, nominal) in enumerate(zip(plant.outputs, plant.output_units, dynamics.drift(y), strict=True)):
        at = f"{name} {float(y.position[i]):.3g} {unit}, {float(y.velocity[i]):.3g} {unit}/s"
        rows.append((f"{at}: x_ddot without input, F of the model", f"{true[i]:.4g}, {nominal:.4g}", f"{unit}/s^2"))
    return tuple(rows)


def _trial(plant: AbstractPlant):
    """A state near the origin with motion in every output."""
    n = len(plant.outputs)
    return plant.initial_state(jnp.linspace(0.1, 0.5, n), jnp.linspace(0.2, -0.1, n))


def _extra(plant: AbstractPlant):
    """A lumped acceleration for the test."""
    return jnp.linspace(1.0, 2.0, len(plant.outputs))


def _forms(plant: AbstractPlant) -> Iterator[Finding]:
    """Types and shapes, by tracing, which also raises the errors of compilation."""
    n, m, t, no_load = len(plant.outputs), plant.inputs(), jnp.zeros(()), plant.no_load()
    if len(plant.output_units) != n:
        yield error("contract", "output_units", f"have {n} entries, one per output", f"{len(plant.output_units)} long")
    x = _trial(plant)
    u = jax.eval_shape(plant.admissible, x, jnp.zeros(m))
    wrong = [*shaped("admissible", u, (m,))]
    if wrong:
        yield from wrong
        return
    y = jax.eval_shape(plant.output, t, x)
    effort = jax.eval_shape(plant.effort, x, u)
    yield from is_a("output", y, Measurement)
    yield from is_a("effort", effort, Effort)
    if isinstance(y, Measurement):
        yield from shaped("output", y.position, (n,))
        yield from shaped("output", y.velocity, (n,))
    if isinstance(effort, Effort):
        yield from (finding for value in effort for finding in shaped("effort", value, (m,)))
    recorded = jax.eval_shape(plant.diagnostics, x, u)
    check_declared(plant, recorded, "diagnostics")
    sizes = {"axis": n, "actuator": m}
    for name, signal in plant.signals().items():
        if set(signal.dimensions) <= set(sizes):
            form = tuple(sizes[dimension] for dimension in signal.dimensions)
            yield from shaped(f"diagnostics, signal {name}", recorded[name], form)
    yield from same_structure(
        "dynamics", jax.eval_shape(plant.dynamics, t, x, u, no_load), x, "have the form of the state"
    )
    yield from shaped("acceleration", jax.eval_shape(plant.acceleration, t, x, u, no_load), (n,))
    yield from shaped("status", jax.eval_shape(plant.status, x), ())


def _forms_of_model(plant: AbstractPlant) -> Iterator[Finding]:
    n, m = len(plant.outputs), plant.inputs()
    model, y = plant.model(), jax.eval_shape(plant.output, jnp.zeros(()), _trial(plant))
    wrong = list(is_a("model", model, Model))
    yield from wrong
    if not wrong:
        yield from shaped("angles", np.asarray(model.coordinates.angles, dtype=float), (n,))
        yield from shaped("drift", jax.eval_shape(model.dynamics.drift, y), (n,))
        yield from shaped("gain", jax.eval_shape(model.dynamics.gain, y), (n, m))
        yield from shaped("invert", jax.eval_shape(model.dynamics.invert, y, jnp.zeros(n)), (m,))


def _numbers(plant: AbstractPlant, x: PyTree) -> dict[str, Array]:
    """Results of the plant, each in two ways."""
    m, t, no_load = plant.inputs(), jnp.zeros(()), plant.no_load()
    u = plant.admissible(x, jnp.full(m, 0.1))
    y, rate = jax.jvp(lambda x: plant.output(t, x)[:2], (x,), (plant.dynamics(t, x, u, no_load),))
    moved = lambda u, load: plant.acceleration(t, x, u, load)
    at_rest = moved(u, no_load)
    model, measured = plant.model(), plant.output(t, x)
    gain = model.dynamics.gain(measured)
    reachable = gain @ jnp.linspace(1.0, 2.0, m)
    held = jax.jacfwd(lambda w: moved(u, no_load._replace(wrench=w)))(no_load.wrench)
    return {
        "velocity": y[1],
        "position_rate": rate[0],
        "acceleration": at_rest,
        "velocity_rate": rate[1],
        "gained": moved(u, no_load._replace(acceleration=_extra(plant))) - at_rest,  # from a lumped acceleration
        "held": jnp.diagonal(held),  # from a unit of wrench on each axis
        "gain": gain,
        "true_gain": jax.jacfwd(lambda u: moved(u, no_load))(u),
        "reachable": reachable,
        "reached": gain @ model.dynamics.invert(measured, reachable),
    }
