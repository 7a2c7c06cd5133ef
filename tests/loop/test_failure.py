"""A run that fails keeps its last sound state, says when and why, and does not hurt its neighbours in a batch."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from jaxtyping import Array, Float

from undertow.control.controllers.rcaf import rcaf
from undertow.control.navigation.perfect import perfect
from undertow.control.references.setpoint import setpoint
from undertow.core.contracts import AbstractDisturbance
from undertow.core.status import Status
from undertow.physics.plants.double_integrator import double_integrator
from undertow.simulation.loop import continuous, sampled
from undertow.simulation.loop.closed_loop import ClosedLoop
from undertow.simulation.loop.outcome import status_of


class Breaks(AbstractDisturbance):
    """0.5 m/s^2 until BREAK, then `value`."""

    value: Float[Array, ""]

    def realize(self, key):
        return ()

    def at(self, path, t, place, calm):
        return calm._replace(acceleration=calm.acceleration + jnp.where(t < BREAK, 0.5, self.value))

    def jumps(self, duration):
        return (BREAK,)


def loop_with(value):
    plant = double_integrator(1)
    load = Breaks(jnp.asarray(value))
    return ClosedLoop(plant, rcaf(plant.model(), preset="paper"), setpoint(np.ones(1)), load, perfect())


BREAK = 0.2512  # s; inside a step and between two records
RUNS = {
    "sampled": lambda loop: sampled.simulate(loop, duration=0.5, dt=2.0**-10, record_every=16),
    "continuous": lambda loop: continuous.simulate(loop, duration=0.5, record_step=2.0**-6, tolerances=(1e-8, 1e-9)),
}
ENDINGS = {
    "sampled": {0.5: Status.OK, float("nan"): Status.NOT_FINITE, 1e12: Status.DIVERGED},
    "continuous": {0.5: Status.OK, 1e12: Status.DIVERGED},
}


@pytest.fixture(scope="module", params=["sampled", pytest.param("continuous", marks=pytest.mark.slow)])
def batch(request):
    """The endings side by side in one batch, and the sound one alone."""
    run = RUNS[request.param]
    loops = [loop_with(value) for value in ENDINGS[request.param]]
    stacked = jax.tree.map(lambda *leaves: np.stack(leaves), *(eqx.filter(loop, eqx.is_array) for loop in loops))
    every = eqx.combine(stacked, eqx.filter(loops[0], eqx.is_array, inverse=True))
    together = jax.tree.map(np.asarray, eqx.filter_jit(eqx.filter_vmap(run))(every))
    one = lambda i: jax.tree.map(lambda leaf: leaf[i], together)
    return request.param, [one(i) for i in range(len(loops))], run(loops[0])


def test_codes_and_times(batch):
    name, together, _ = batch
    assert [Status(int(o.status)) for o in together] == list(ENDINGS[name].values())
    assert float(together[0].ended) == 0.5
    for outcome in together[1:]:
        assert BREAK <= float(outcome.ended) <= BREAK + 2.0**-6


def test_last_sound_state_is_kept(batch):
    name, (sound, *failed), _ = batch
    for outcome in failed:
        before, after = outcome.time < BREAK, outcome.time > BREAK + 2.0**-6
        np.testing.assert_allclose(outcome.signals["position"][before], sound.signals["position"][before], rtol=1e-6)
        for series in (outcome.signals["position"], outcome.signals["velocity"], outcome.signals["weights"]):
            assert np.isfinite(series).all()
            assert (series[after] == series[after][0]).all(), "records after the failure repeat the last sound one"
        if name == "sampled":
            assert all(np.isfinite(leaf).all() for leaf in jax.tree.leaves(outcome.final))
            at_break = np.interp(BREAK, sound.time, sound.signals["position"][:, 0])
            assert outcome.final[0].position[0] == pytest.approx(at_break, rel=1e-2)


@pytest.mark.slow
def test_continuous_loop_ends_when_nothing_is_finite():
    """The adaptive integrator rejects every step into the undefined; it gives up, and says so."""
    outcome = RUNS["continuous"](loop_with(float("nan")))
    assert Status(int(outcome.status)) in (Status.NOT_FINITE, Status.STEPS_EXHAUSTED)
    assert float(outcome.ended) == pytest.approx(BREAK, abs=1e-6)
    assert np.isfinite(np.asarray(outcome.signals["position"])).all()


@eqx.filter_jit
def code_of(loop, remembered):
    """Status where the controller remembers these numbers."""
    x, _ = loop.realize(jax.random.PRNGKey(0)).start(*loop.outputs_at_start(None, None))
    return status_of(loop, x, (jnp.zeros(2, dtype=remembered.dtype), remembered))


@pytest.mark.parametrize("kind, most", [(jnp.float64, 1.34e154), (jnp.float32, 1.84e19)])
@pytest.mark.parametrize("share, code", [(0.99, Status.OK), (1.01, Status.NOT_FINITE), (-1.01, Status.NOT_FINITE)])
def test_a_state_whose_square_overflows_is_not_finite(kind, most, share, code):
    """sqrt(1.798e308) and sqrt(3.403e38): a controller that grows to there in silence gives metrics that are infinite."""
    remembered = np.array([0.0, share * most], dtype=kind)
    assert int(code_of(loop_with(0.5), remembered)) == int(code)


def test_neighbours_are_not_hurt(batch):
    name, together, alone = batch
    pairs = zip(jax.tree.leaves(together[0].signals), jax.tree.leaves(alone.signals), strict=True)
    for one, other in pairs:
        np.testing.assert_allclose(one, np.asarray(other), rtol=1e-9, atol=1e-9)
    assert np.abs(together[0].signals["velocity"]).max() > 0.1, name
