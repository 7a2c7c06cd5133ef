"""The continuous loop with fixed steps by the batch compiler: figures and endings of the one that XLA compiles."""

import inspect

import jax.numpy as jnp
import numpy as np
import pytest
from jaxtyping import Array, Float
from recorded import is_as_recorded

from undertow.control.controllers.rcaf import rcaf
from undertow.control.navigation.perfect import perfect
from undertow.control.references.setpoint import setpoint
from undertow.core.contracts import AbstractDisturbance
from undertow.core.errors import BadInput
from undertow.core.status import Status
from undertow.physics.disturbances.sinusoid import sinusoid
from undertow.physics.plants.double_integrator import double_integrator
from undertow.scenario.results.run_scenario import run_scenario
from undertow.simulation.loop import continuous, simd_batch
from undertow.simulation.loop.closed_loop import ClosedLoop

HOW = {"duration": 0.5, "record_step": 0.02, "dt": 1e-3}


class Breaks(AbstractDisturbance):
    """0.5 m/s^2 until 0.2512 s, then `value`."""

    value: Float[Array, ""]

    def realize(self, key):
        return ()

    def at(self, path, t, place, calm):
        return calm._replace(acceleration=calm.acceleration + jnp.where(t < 0.2512, 0.5, self.value))

    def jumps(self, duration):
        return (0.2512,)


def under(load):
    plant = double_integrator(2)
    return ClosedLoop(
        plant, rcaf(plant.model(), preset="paper", sets=3), setpoint(np.array([0.2, 0.3])), load, perfect()
    )


@pytest.mark.full
def test_figures_of_both_compilers_agree():
    loop = under(sinusoid(np.array([2.0, 1.0]), np.array([1.0, 5.0])))
    start = {"position": np.array([0.1, -0.1]), "velocity": np.array([0.0, 0.5])}
    own, wanted = simd_batch.integrate(loop, **HOW, **start), continuous.simulate(loop, **HOW, **start)
    assert int(own.status) == int(Status.OK) and float(own.ended) == 0.5
    is_as_recorded("continuous loop", [wanted.signals[name] for name in sorted(wanted.signals)])
    assert len(own.time) == 26 and list(own.signals) == list(wanted.signals)
    for name, series in wanted.signals.items():
        np.testing.assert_allclose(own.signals[name], series, rtol=1e-9, atol=1e-11, err_msg=name)


@pytest.mark.full
@pytest.mark.parametrize(("value", "status"), [(1e12, Status.DIVERGED), (float("nan"), Status.NOT_FINITE)])
def test_a_failed_run_ends_at_the_same_instant_for_the_same_reason(value, status):
    own, wanted = (by(under(Breaks(jnp.asarray(value))), **HOW) for by in (simd_batch.integrate, continuous.simulate))
    assert Status(int(own.status)) is Status(int(wanted.status)) is status
    assert float(own.ended) == float(wanted.ended) == pytest.approx(0.252, abs=2e-3)
    np.testing.assert_allclose(own.signals["position"][-1], wanted.signals["position"][-1], rtol=1e-9)


def test_arguments_are_those_of_the_other_compiler():
    loop = under(Breaks(jnp.asarray(0.5)))
    for wrong in ({"duration": 0.0}, {"duration": 0.01}, {"dt": 0.0}, {"dt": 0.1}):
        sentences = []
        for by in (simd_batch.integrate, continuous.simulate):
            with pytest.raises(BadInput) as refused:
                by(loop, **(HOW | wrong))
            sentences.append(str(refused.value))
        assert sentences[0] == sentences[1]
    arguments = [inspect.signature(by).parameters for by in (simd_batch.integrate, continuous.simulate)]
    for name in arguments[0]:
        assert arguments[0][name].default == arguments[1][name].default, name


@pytest.mark.full
def test_a_scenario_is_run_by_the_backend_that_it_names():
    """`backend: xla` gives the same figures to rounding, and neither run had to change its backend."""
    scenario = {
        "plant": {"kind": "double_integrator", "axes": 1},
        "controller": "paper",
        "reference": {"kind": "setpoint", "position": [1.0]},
        "disturbance": {"kind": "sinusoid", "amplitude": 1.0, "frequency": 3.0},
        "loop": {"kind": "continuous", "duration": 1.0},
    }
    own = run_scenario(scenario)
    other = run_scenario(scenario | {"loop": scenario["loop"] | {"backend": "xla"}})
    assert "left_to_xla" not in own.dataset.attrs and "left_to_xla" not in other.dataset.attrs
    assert own.whole["position_rms"] == pytest.approx(other.whole["position_rms"], rel=1e-10)
