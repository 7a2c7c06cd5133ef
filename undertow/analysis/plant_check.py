"""Does a plant keep its contract, and does its model tell the same story?"""

from collections.abc import Iterator

import jax
import jax.numpy as jnp
import numpy as np

from undertow.analysis.answers import agree, alike, is_a, shaped
from undertow.analysis.finding import Finding, error
from undertow.core.contracts import AbstractModel, AbstractPlant, Effort, Load, Measurement

_GRIP = 1e-9  # of the largest entry: below it an input does not act at once


def check_plant(plant: AbstractPlant) -> Iterator[Finding]:
    """Every method once, near the origin; and each answer against another way to the same number."""
    n, m, t, calm = len(plant.outputs), plant.inputs(), jnp.zeros(()), plant.no_load()
    if len(plant.output_units) != n:
        yield error("contract", "output_units", f"have {n} entries, one per output", f"{len(plant.output_units)} long")
    x = _trial(plant)
    u = plant.admissible(x, jnp.full(m, 0.1))
    jax.eval_shape(plant.dynamics, t, x, u, calm)  # whether it compiles
    forms = [
        *shaped("admissible", u, (m,)),
        *is_a("output", plant.output(t, x), Measurement),
        *is_a("effort", plant.effort(x, u), Effort),
    ]
    if forms:
        yield from forms
        return
    y, rate = plant.output(t, x), plant.dynamics(t, x, u, calm)
    forms = [
        *shaped("output", y.position, (n,)),
        *shaped("output", y.velocity, (n,)),
        *(finding for value in plant.effort(x, u) for finding in shaped("effort", value, (m,))),
        *alike("dynamics", rate, x, "have the form of the state"),
        *shaped("acceleration", plant.acceleration(t, x, u, calm), (n,)),
        *shaped("health", plant.health(x), ()),
        *is_a("advice", plant.advice(), tuple),
    ]
    if forms:
        yield from forms
        return
    y, y_rate = jax.jvp(lambda x: plant.output(t, x)[:2], (x,), (rate,))
    yield from agree("output", y[1], y_rate[0], "the rate of its position")
    yield from agree("acceleration", plant.acceleration(t, x, u, calm), y_rate[1], "the rate of the output")
    yield from _loads(plant, x, u, calm)
    yield from _model(plant, x, u, calm)


def derived_of_plant(plant: AbstractPlant) -> tuple[tuple[str, str, str], ...]:
    """(what, value, unit), a row each: at the point where `check_plant` tries it."""
    n, m, t, calm = len(plant.outputs), plant.inputs(), jnp.zeros(()), plant.no_load()
    x, model = _trial(plant), plant.model()
    y, u = plant.output(t, x), plant.admissible(x, jnp.zeros(m))
    gain = np.asarray(model.gain(y))
    true = np.asarray(plant.acceleration(t, x, u, calm))
    rows = [("outputs, inputs, rank of G", f"{n}, {m}, {np.linalg.matrix_rank(gain, tol=1e-9)}", "")]
    for i, (name, unit, told) in enumerate(zip(plant.outputs, plant.output_units, model.drift(y), strict=True)):
        at = f"{name} {float(y.position[i]):.3g} {unit}, {float(y.velocity[i]):.3g} {unit}/s"
        rows.append((f"{at}: x_ddot without input, F of the model", f"{true[i]:.4g}, {told:.4g}", f"{unit}/s^2"))
    return tuple(rows)


def _trial(plant: AbstractPlant):
    """A state near the origin, at rest in nothing."""
    n = len(plant.outputs)
    return plant.initial_state(jnp.linspace(0.1, 0.5, n), jnp.linspace(0.2, -0.1, n))


def _loads(plant: AbstractPlant, x, u, calm: Load) -> Iterator[Finding]:
    """A lumped acceleration adds to x_ddot as it is; a wrench stands on the left side of Eq. (2), so it holds back."""
    moved = lambda load: plant.acceleration(jnp.zeros(()), x, u, load)
    extra = jnp.linspace(1.0, 2.0, len(plant.outputs))
    gained = moved(calm._replace(acceleration=extra)) - moved(calm)
    yield from agree("acceleration", gained, extra, "the lumped acceleration of the load, which adds to it")
    held = np.diagonal(jax.jacfwd(lambda w: moved(calm._replace(wrench=w)))(calm.wrench))
    if not (held < 0).all():
        i = int(np.argmax(held))
        got = f"{held[i]:.4g} for a unit of it on {plant.outputs[i]}"
        hint = "It stands on the left side of Eq. (2): subtract it from the forces"
        yield error("contract", "acceleration", "fall with the wrench of the load", got, hint)


def _model(plant: AbstractPlant, x, u, calm: Load) -> Iterator[Finding]:
    """F, G and G# have the right shapes, G# inverts G as far as its range goes, and G pushes where the plant does."""
    n, m, t = len(plant.outputs), plant.inputs(), jnp.zeros(())
    model, y = plant.model(), plant.output(t, x)
    wrong = list(is_a("model", model, AbstractModel))
    if not wrong:
        reachable = jnp.zeros(n)
        wrong = [
            *shaped("model.angles", np.asarray(model.angles, dtype=float), (n,)),
            *shaped("model.drift", model.drift(y), (n,)),
            *shaped("model.gain", model.gain(y), (n, m)),
            *shaped("model.invert", model.invert(y, reachable), (m,)),
        ]
    if wrong:
        yield from wrong
        return
    gain = model.gain(y)
    reachable = gain @ jnp.linspace(1.0, 2.0, m)
    yield from agree("model.invert", gain @ model.invert(y, reachable), reachable, "`model.gain`: G G# a = a")
    true = jax.jacfwd(lambda u: plant.acceleration(t, x, u, calm))(u)
    if np.abs(true).max() > _GRIP and float((true * gain).sum()) < 0:
        i, j = np.unravel_index(np.abs(gain).argmax(), gain.shape)
        got = f"{gain[i, j]:.4g} where x_ddot changes by {true[i, j]:.4g} per unit"
        yield error("contract", "model.gain", "push where the plant does", got)
