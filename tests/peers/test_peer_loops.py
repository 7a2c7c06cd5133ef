"""Laws against closed loops of other people's code on the same plants: benchmarks/rival_peers.py printed them."""

import json
from pathlib import Path

import jax
import numpy as np
import pytest

from undertow.control.controllers import adrc, integral_sliding_mode, nmpc, pid
from undertow.control.navigation import perfect
from undertow.control.references import setpoint
from undertow.core.contracts import Measurement
from undertow.physics.disturbances import none, sinusoid
from undertow.physics.plants import linear_plant, two_link_arm
from undertow.simulation.loop import sampled
from undertow.simulation.loop.closed_loop import ClosedLoop

pytestmark = pytest.mark.full

PEER = json.loads((Path(__file__).parent / "data" / "rival_laws.json").read_text())


def run(plant, law, goal, duration, dt, load=0.0, **start):
    push = sinusoid(0.0, 1.0, offset=load) if load else none()
    loop = ClosedLoop(plant, law, setpoint(goal), push, perfect())
    found = sampled.simulate(loop, duration=duration, dt=dt, record_every=1, **start)
    assert int(found.status) == 0
    return {name: np.asarray(value) for name, value in found.signals.items()}


def damped(time_constant, inertia=1.0):
    """Heading of a vessel: inertia x_ddot = u - inertia / time_constant x_dot."""
    return linear_plant(gain=[[1 / inertia]], velocity_term=[[-1 / time_constant]])


@pytest.mark.parametrize("case", [0, 1])
def test_pid_pole_placement_of_the_otter(case):
    """PythonVehicleSimulator feeds back the damping that is asked for less that of the vessel, 1 / T, which acts here too."""
    peer, expected = PEER["pid"], PEER["pid"]["runs"][case]
    time_constant, dt = 1.0, peer["dt"]
    plant = damped(time_constant, peer["inertia"])
    damping = float(peer["zeta"]) - 1 / (2 * peer["wn"] * time_constant)
    law = pid(plant.model(), sampling_time=dt, frequency=peer["wn"], damping=damping, reference_frequency=0.0)
    load = expected["load"] / peer["inertia"]
    found = run(plant, law, [0.0], 20.0, dt, load, position=[expected["start"]])["position"][:, 0]
    np.testing.assert_allclose(dt * np.abs(found).sum(), expected["integral_of_error"], rtol=1e-6)
    np.testing.assert_allclose([found.min(), found.max()], [expected["least"], expected["most"]], rtol=1e-6, atol=1e-9)


def test_integral_sliding_mode_of_the_remus_100_under_a_load():
    """Fossen (2021), Eq. (16.479), in its layer: its K_d s and K_s sat(s / phi) are one slope M / phi here.

    The peer compensates the damping 1 / T of the vessel at the velocity that its surface asks for, undertow at that of
    the target: the same PID with k_d less by 1 / T, from which frequency, damping and slope follow.
    """
    peer = PEER["integral_sliding_mode"]
    (expected,), dt, time_constant = peer["runs"], peer["dt"], float(peer["T_nomoto"])
    slope = (1 + peer["K_d"]) / time_constant + peer["K_sigma"] / time_constant / peer["phi_b"]
    plant, lam = damped(time_constant), peer["lam"]
    by_rate, by_error, by_integral = 2 * lam + slope - 1 / time_constant, lam**2 + 2 * lam * slope, lam**2 * slope
    slope = max(root.real for root in np.roots([1, -by_rate, by_error, -by_integral]) if abs(root.imag) < 1e-9)
    frequency = np.sqrt(by_integral / slope)
    law = integral_sliding_mode(
        plant.model(),
        sampling_time=dt,
        frequency=frequency,
        damping=(by_rate - slope) / (2 * frequency),
        amplitude=slope,
        layer=1.0,
        reference_frequency=0.0,
    )
    found = run(plant, law, [0.0], 60.0, dt, expected["load"])
    assert np.abs(found["surface"]).max() < 1.0  # inside the layer
    heading = found["position"][:, 0]
    np.testing.assert_allclose(dt * np.abs(heading).sum(), expected["integral_of_error"], rtol=1e-3)
    np.testing.assert_allclose(heading.max(), expected["most"], rtol=1e-3)


@pytest.mark.parametrize("name", PEER["adrc"]["plants"])
def test_adrc_on_plants_around_the_nominal_one(name):
    """Herbst (2013) by pyadrc: the model is a double integrator, k_ESO = 10 and s_CL = -6 / T_settle.

    pyadrc observes the position alone, undertow the velocity as well: it is a little faster, within 10 %.
    """
    peer, expected = PEER["adrc"], PEER["adrc"]["plants"][name]
    gain, damping, time = (float(part.split("=")[1]) for part in name.split(","))
    plant = linear_plant(gain=[[gain / time**2]], position_term=[[-1 / time**2]], velocity_term=[[-2 * damping / time]])
    dt, w = peer["dt"], 6 / peer["settling_time"]
    law = adrc(
        plant.model(gain=[[1.0]], position_term=[[0.0]], velocity_term=[[0.0]]),
        sampling_time=dt,
        bandwidth=peer["observer_ratio"] * w,
        feedback=[w**2, 2 * w],
        motor="steady",
    )
    found = run(plant, law, [1.0], 15.0, dt)
    position = found["position"][:, 0]
    np.testing.assert_allclose(dt * np.abs(1 - position).sum(), expected["integral_of_error"], rtol=0.1)
    np.testing.assert_allclose(np.abs(found["input"]).max(), expected["largest_input"], rtol=0.17)
    assert position.max() - 1 <= expected["overshoot"] + 1e-3


@pytest.mark.parametrize("case", [0, 1])
def test_predictive_control_of_an_arm_costs_what_the_converged_optimum_costs(case):
    """From hanging to horizontal with torques at their limits: two steps per sampling time against IPOPT's optimum."""
    expected, w, dt = PEER["nmpc"]["runs"][case], 4.0, 0.02
    plant = two_link_arm(limit=expected["limit"])
    law = nmpc(
        plant.model(), sampling_time=dt, bandwidth=10.0, tracking=w, horizon=1.0, steps=10, reference_frequency=0.0
    )
    found = run(plant, law, [0.0, 0.5], 4.0, dt, position=[-np.pi / 2, 0.0])
    q, v, u, e = (found[name][:-1] for name in ("position", "velocity", "input", "error"))
    dynamics = plant.model().dynamics
    given_by = lambda q, v, u: dynamics.drift(Measurement(q, v)) + dynamics.gain(Measurement(q, v)) @ u
    given = np.asarray(jax.jit(jax.vmap(given_by))(q, v, u))
    cost = float(dt / 2 * (w**4 * e**2 + 2 * w**2 * v**2 + given**2).sum())
    assert (np.abs(found["input"]) > 0.999 * expected["limit"]).any()
    assert 0.99 * expected["cost"] < cost < 1.01 * expected["cost"], cost
