"""Vehicles under models of other people: what the flow does to a slow loop, and that `robust` holds at 50 Hz."""

import dataclasses

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from undertow.analysis.linearization import margins
from undertow.analysis.linearization.disturbance_profile import OperatingConditions
from undertow.core import runtime
from undertow.core.contracts import AbstractController
from undertow.physics.vehicles import bluerov2_heavy
from undertow.scenario.build import build
from undertow.scenario.checks.flow_stability import checked_flow_advice, flow_advice, munk_rate
from undertow.scenario.reading import from_data
from undertow.scenario.results.run_scenario import run_scenario

CURRENT = 0.5  # m/s


def scenario(plant, model, rate, reference=None, current=(CURRENT, 0, 0), duration=60):
    vehicle = lambda name: {"kind": "bluerov2_heavy", "parameters": name}
    return {
        "plant": {"vehicle": vehicle(plant), "thruster": {"kind": "t200", "supply": 16}, "ledger": False},
        "model": {"rate_term": True, "vehicle": vehicle(model)},
        "controller": "robust",
        "reference": reference or {"kind": "setpoint", "position": [0] * 6},
        "disturbance": [{"kind": "current", "velocity": list(current)}],
        "loop": {"dt": 1 / rate, "duration": duration, "record": 0.1},
        "steady": {"start": 20, "stop": duration},
    }


def test_a_flow_turns_a_body_by_the_difference_of_its_masses():
    """(m_22 - m_11) U^2 / I_z in yaw along surge, Fossen (2021), section 6.3, and alike about the other axes."""
    masses, inertia = np.array([20.0, 34.0, 27.0]), np.array([0.3, 0.4, 0.5])
    body = dataclasses.replace(
        bluerov2_heavy().body(),
        mass_matrix=jnp.diag(jnp.asarray([*masses, *inertia])),
        inverse_mass_matrix=jnp.diag(1 / jnp.asarray([*masses, *inertia])),
        linear_damping=jnp.zeros((6, 6)), quadratic_damping=jnp.zeros((6, 6)),
        r_g=jnp.zeros(3), r_b=jnp.zeros(3), weight=jnp.asarray(100.0), buoyancy=jnp.asarray(100.0),
    )  # fmt: skip

    def turned(angle, axis, along):
        """Angular acceleration of a body that has turned by a small angle in a flow."""
        past = jnp.zeros(3).at[along].set(-CURRENT)
        seen = past - jnp.cross(jnp.zeros(3).at[axis].set(angle), past)
        return body.free_acceleration(jnp.concatenate([seen, jnp.zeros(3)]), jnp.asarray([0.0, 0, 1]))[3 + axis]

    slopes = jax.jit(
        lambda: jnp.stack([jax.grad(turned)(0.0, axis, (axis + k) % 3) for axis in range(3) for k in (1, 2)])
    )
    about_yaw = (masses[1] - masses[0]) * CURRENT**2 / inertia[2]
    np.testing.assert_allclose(slopes()[4:], [about_yaw, -about_yaw], rtol=1e-5)
    np.testing.assert_allclose(munk_rate(body) * CURRENT, np.sqrt(np.abs(slopes()).max()), rtol=1e-5)


@pytest.mark.full
def test_a_slow_loop_is_unstable_in_a_current_that_turns_its_vehicle():
    """As a constant force the same load is held; the run shows which is true. 50 Hz is enough for both."""
    attitude, found = {}, {}
    for rate in (20, 50):
        built = build(from_data(scenario("ng2024", "wu2018", rate)))
        load = np.array([-0.5, 0.0, 0.0, 0.0, 0.0, 0.0])
        points = [OperatingConditions("", load, None), OperatingConditions("", load, np.array([CURRENT, 0.0, 0.0]))]
        with runtime.in_precision("float64"):
            found[rate] = [margins.certify(built.closed_loop, 1 / rate, np.zeros(6), [one])[0] for one in points]
        attitude[rate] = float(run_scenario(built).steady["attitude_rms"])
    assert found[20][0] < 1 < found[20][1]
    assert max(found[50]) < 1
    assert attitude[20] > 0.3 and attitude[50] < 0.05


@pytest.mark.full
def test_a_loop_that_is_too_slow_is_named_with_the_rate_that_is_enough():
    (advised,) = flow_advice(build(from_data(scenario("ng2024", "gazebo_box_drag", 20))))
    assert "at 20 Hz the loop is unstable while the water passes the vehicle at 0.5 m/s" in advised.says
    assert advised.hint.startswith("80 Hz is enough")
    for plant, rate in (("px4", 20), ("ng2024", 50)):
        assert flow_advice(build(from_data(scenario(plant, plant, rate)))) == ()


@pytest.mark.full
def test_gains_that_turn_the_vehicle_are_named():
    """A PID of 1 rad/s turns the vehicle in 0.28 m/s, within a minute by tens of degrees; one of 2 rad/s holds it."""
    task = {"plant": "vonbenzon2022", "model": "vonbenzon2022", "rate": 50, "current": (0.28, 0, 0)}
    turns = build(from_data(scenario(**task) | {"controller": {"kind": "pid", "frequency": 1}}))
    (advised,) = checked_flow_advice(turns)
    assert "with these gains the loop is unstable while the water passes the vehicle at 0.28 m/s" in advised.says
    holds = build(from_data(scenario(**task) | {"controller": {"kind": "pid", "frequency": 2}}))
    assert checked_flow_advice(holds) == ()
    assert checked_flow_advice(build(from_data(scenario(**task)))) == (), "of the rule's gains nothing is said"
    lost, held = (run_scenario(built).steady["attitude_rms"] for built in (turns, holds))
    assert lost > 0.2 > 0.01 > held


class WithoutSlopes(eqx.Module):
    """A law that runs and cannot be differentiated."""

    law: AbstractController

    def __getattr__(self, name):
        return getattr(self.law, name)

    def command(self, z, y, r):
        u, signals = self.law.command(z, y, r)
        return jax.pure_callback(lambda u: u, u, u), signals


@pytest.mark.full
def test_of_a_law_without_slopes_nothing_is_said():
    built = build(from_data(scenario("ng2024", "gazebo_box_drag", 20)))
    loop = dataclasses.replace(built.closed_loop, controller=WithoutSlopes(built.closed_loop.controller))
    assert flow_advice(built._replace(closed_loop=loop)) == ()


LISSAJOUS = {"kind": "lissajous", "amplitude": [2.0, 1.0, 0.5, 0.8], "frequency": [0.2, 0.4, 0.3, 0.25]}


@pytest.mark.full
@pytest.mark.parametrize(("plant", "model"), [("px4", "vonbenzon2022"), ("gazebo_box_drag", "vonbenzon2022")])
def test_a_model_with_seven_times_the_drag_is_no_danger(plant, model):
    """155 N at 1 m/s are compensated where the vehicle has 22: at the measured velocity that drove it away."""
    run = run_scenario(build(from_data(scenario(plant, model, 50, LISSAJOUS, (0.3, 0.2, 0)))))
    assert run.steady["position_rms"] < 0.02
    assert run.steady["attitude_rms"] < 0.02
