"""Systems of python-control: the run of a simulation, exact derivatives, and what is connected wrongly."""

import control as ct
import jax
import jax.numpy as jnp
import numpy as np
import pytest

import undertow as ut
from undertow.analysis.linearization import margins
from undertow.analysis.linearization.equilibrium import equilibrium
from undertow.analysis.linearization.jacobians import without
from undertow.core.errors import BadInput
from undertow.outside import python_control as upc
from undertow.scenario.build import build
from undertow.scenario.reading import from_data

pytestmark = pytest.mark.interop

AUV = {
    "plant": {"vehicle": "bluerov2_heavy", "thruster": {"kind": "t200", "supply": 16}},
    "controller": {"kind": "rcaf", "preset": "robust"},
    "reference": {"kind": "setpoint", "position": [2, 1, 1, 0, 0, 0.5], "settling": 5},
    "disturbance": {"kind": "current", "velocity": [0.3, 0.2, 0]},
    "navigation": {"kind": "white_noise", "position": 0.001, "velocity": 0.01},
    "loop": {"duration": 1.0, "dt": 0.01, "record": 0.01},
}
PENDULUM = {
    "plant": "inverted_pendulum",
    "controller": "paper",
    "reference": {"kind": "sine", "amplitude": 0.1, "frequency": 1},
    "initial": {"position": [0.05]},
    "loop": {"duration": 1.0, "dt": 0.001, "record": 0.001},
}


@pytest.fixture(scope="module", params=[AUV, PENDULUM], ids=["vehicle", "pendulum"])
def case(request):
    """A scenario, its run, and the instants of its steps."""
    record = ut.simulate_scenario(request.param).dataset
    return request.param, record, record.time.values


def applied(response, plant_inputs):
    return np.array([response.outputs[response.output_labels.index(f"applied_{i + 1}")] for i in range(plant_inputs)]).T


def test_the_closed_loop_has_the_bits_of_a_simulation(case):
    scenario, record, time = case
    loop = upc.closed_loop(scenario)
    assert loop.dt == scenario["loop"]["dt"] and len(loop.state_labels) == len(set(loop.state_labels)) == len(
        loop.start
    )
    response = ct.input_output_response(loop, time, upc.reference(scenario, time), loop.start)
    n = record.position.shape[1]
    np.testing.assert_array_equal(response.outputs[:n].T, record.position.values)
    np.testing.assert_array_equal(response.outputs[n : 2 * n].T, record.velocity.values)
    np.testing.assert_array_equal(applied(response, record["input"].shape[1]), record["input"].values)


def test_plant_limits_and_controller_connected_by_name_are_the_loop(case):
    """To rounding: the controller computes the attitude of a vehicle from its Euler angles."""
    scenario, record, time = case
    parts = upc.plant(scenario, sampled=True), upc.limits(scenario), upc.controller(scenario)
    loop = upc.connected(*parts)
    start = np.concatenate([parts[0].start, parts[2].start])
    response = ct.input_output_response(loop, time, upc.reference(scenario, time), start)
    n = record.position.shape[1]
    np.testing.assert_allclose(response.outputs[:n].T, record.measured_position.values, rtol=0, atol=1e-9)
    np.testing.assert_allclose(applied(response, record["input"].shape[1]), record["input"].values, rtol=0, atol=1e-7)


def test_the_continuous_plant_meets_the_sampled_one():
    """SciPy's adaptive steps with the inputs of a run, one sampling time at a time; the run takes small steps, too."""
    scenario = AUV | {"navigation": {"kind": "perfect"}, "loop": AUV["loop"] | {"substeps": 20}}
    record, plant = ut.simulate_scenario(scenario).dataset, upc.plant(scenario)
    assert plant.dt == 0 and plant.units["north_rate"] == "m/s" and plant.units["applied_1"] == "V"
    x = plant.start
    for k in range(20):
        u = np.tile(record["input"].values[k][:, None], 2)
        given = {"rtol": 1e-10, "atol": 1e-12}
        x = ct.input_output_response(plant, [0.01 * k, 0.01 * (k + 1)], u, x, solve_ivp_kwargs=given).states[:, -1]
    found = plant.output(0.2, x, np.zeros(8))
    np.testing.assert_allclose(found[:6], record.position.values[20], rtol=0, atol=1e-9)
    np.testing.assert_allclose(found[6:12], record.velocity.values[20], rtol=0, atol=1e-7)


# A load, so that no thruster stands still, where thrust has no slope; m/s^2, rad/s^2.
LOADS = {"vehicle": [0.3, 0.2, 0.1, 0.05, 0.05, 0.1], "pendulum": [0.5]}


@pytest.fixture(scope="module", params=[AUV, PENDULUM], ids=list(LOADS))
def linear(request):
    """A scenario, where it is linearised, and undertow's own equilibrium and linear loop there."""
    load = np.array(LOADS["vehicle" if request.param is AUV else "pendulum"])
    built, position = build(from_data(request.param)), 0 * load
    with jax.enable_x64(True):
        at = equilibrium(built.closed_loop, built.scenario.loop.dt, position, load)
        own = margins.closed(at, built.scenario.loop.dt)
    return built, {"position": position, "load": load}, at, own


def test_poles_are_those_of_undertow(linear):
    built, where, _, own = linear
    loop = upc.linear_closed_loop(built, **where)
    expected = np.exp(margins.poles(own) * loop.dt)
    assert len(expected) >= 2 and loop.input_labels == upc.closed_loop(built).input_labels
    for pole in expected:
        assert np.abs(loop.poles() - pole).min() < 1e-7


def test_derivatives_are_those_of_finite_differences(linear):
    """The nonlinear systems, moved a little from the equilibrium: plant in continuous time, and controller."""
    built, where, at, _ = linear
    u, position, still = at.at["u"], where["position"], built_still(built, where["load"])
    plant, controller = upc.plant(still), upc.controller(still)
    linear_plant = upc.linear_plant(built, **where, all_states=True)
    linear_controller = upc.linear_controller(built, **where, all_states=True)
    assert linear_plant.state_labels == plant.state_labels
    assert linear_controller.input_labels == controller.input_labels
    with jax.enable_x64(True):
        truth = built.closed_loop.plant.output(jnp.zeros(()), at.parts.plant_state(jnp.asarray(at.at["plant"])))
        report = np.concatenate([np.ravel(leaf) for leaf in jax.tree.leaves(truth.actuator)] or [[]])
    measured = np.concatenate([truth.position, truth.velocity, report])
    given = np.concatenate([measured, position, 0 * position, 0 * position, u])
    for system, exact, x, taken in (
        (plant, linear_plant, at.at["plant"], u),
        (controller, linear_controller, at.at["law"], given),
    ):
        a, b = slopes(lambda x, u, s=system: s.dynamics(0.0, x, u), x, taken)
        c, d = slopes(lambda x, u, s=system: s.output(0.0, x, u), x, taken)
        for name, differences in zip("ABCD", (a, b, c, d), strict=True):
            scale = max(1.0, np.abs(differences).max())
            np.testing.assert_allclose(getattr(exact, name), differences, rtol=1e-4, atol=2e-6 * scale, err_msg=name)


def test_states_that_only_observe_are_left_out(linear):
    """No pole stays at the border of stability, and the answer to every input is that of all states."""
    built, where, _, _ = linear
    plant, law = upc.linear_plant(built, **where), upc.linear_controller(built, **where)
    for fewer, every, point in (
        (plant, upc.linear_plant(built, **where, all_states=True), 0.3 + 2j),
        (law, upc.linear_controller(built, **where, all_states=True), 0.9 + 0.3j),
    ):
        assert fewer.nstates < every.nstates or built.closed_loop.plant.outputs == ("angle",)
        expected = every(point)
        np.testing.assert_allclose(fewer(point), expected, rtol=0, atol=1e-8 * np.abs(expected).max())
    loop = upc.linear_closed_loop(built, **where)
    n = len(built.closed_loop.plant.outputs)
    assert np.abs(loop.poles() - 1).min() > 1e-6
    np.testing.assert_allclose(np.diag(ct.dcgain(loop)[:n, :n]) if n > 1 else ct.dcgain(loop)[0][0], 1, atol=1e-3)
    assert np.isfinite(ct.step_info(loop[0, 0])["SettlingTime"])


def test_lqr_of_a_vehicle(linear):
    """12 states of the body and 8 of the thrusters, without quaternion and energy ledger; the loop with it is stable."""
    built, where, _, _ = linear
    plant = upc.linear_plant(built, **where)
    gain = ct.lqr(plant, np.eye(plant.nstates), np.eye(plant.ninputs))[0]
    assert np.linalg.eigvals(plant.A - plant.B @ gain).real.max() < 0
    if plant.ninputs == 8:
        assert plant.nstates == 20
        assert plant.state_labels[3:6] == ["plant_roll", "plant_pitch", "plant_yaw"]


def built_still(built, load):
    """The scenario with perfect measurements, no dead zone and a constant load."""
    constant = {"kind": "sinusoid", "amplitude": 0.0, "offset": load.tolist()}
    still = build(from_data(built.resolved | {"disturbance": constant, "navigation": {"kind": "perfect"}}))
    return still._replace(closed_loop=without(still.closed_loop, ("dead_zone",)))


def slopes(function, x, u, step=1e-6):
    """Central differences with respect to both arguments."""

    def of(function, at):
        moved = lambda i, by: function(at + by * np.eye(len(at))[i])
        return np.array([(moved(i, step) - moved(i, -step)) / (2 * step) for i in range(len(at))]).T

    return of(lambda x: function(x, u), x), of(lambda u: function(x, u), u)


def test_sampled_linear_plant_is_exact():
    """Against many small steps of the continuous one."""
    continuous = upc.linear_plant(PENDULUM, position=[0.0])
    exact = upc.linear_plant(PENDULUM, position=[0.0], sampled=True)
    small = ct.sample_system(continuous, 1e-6, "euler")
    np.testing.assert_allclose(exact.A, np.linalg.matrix_power(small.A, 1000), rtol=0, atol=1e-7)
    assert exact.input_labels == continuous.input_labels == ["applied_1"]


def test_what_is_connected_wrongly():
    plant, limits, controller = upc.plant(PENDULUM, sampled=True), upc.limits(PENDULUM), upc.controller(PENDULUM)
    with pytest.raises(BadInput, match="`plant` must be in discrete time, as its controller is, but is continuous"):
        upc.connected(upc.plant(PENDULUM), limits, controller)
    slower = upc.controller(PENDULUM | {"loop": {"dt": 0.002, "record": 0.002}})
    with pytest.raises(BadInput, match=r"`controller` must have the sampling time of the plant, 0.001 s, but is 0.002"):
        upc.connected(plant, limits, slower)
    with pytest.raises(BadInput, match="`controller` must take what the others give, but is without north, east"):
        upc.connected(plant, limits, upc.controller(AUV | {"loop": PENDULUM["loop"]}))
    loop = upc.closed_loop(PENDULUM)
    with pytest.raises(BadInput, match=r"`time` must be whole sampling times of 0.001 s, but is 0.0005 s"):
        loop.output(0.0005, loop.start, np.zeros(3))


def test_what_no_system_can_be_made_of():
    continuous = PENDULUM | {"loop": {"kind": "continuous", "duration": 1.0}}
    for made in (upc.controller, upc.closed_loop, upc.linear_controller, upc.linear_closed_loop):
        with pytest.raises(BadInput, match=r"`loop.kind` must be sampled for a .* in discrete time, but is continuous"):
            made(continuous)
    with pytest.raises(BadInput, match=r"`position` must have 1 entries"):
        upc.linear_plant(PENDULUM, position=np.zeros(6))
    with pytest.raises(BadInput, match="`position` must be given with a load"):
        upc.linear_plant(PENDULUM, load=[0.0])
    with pytest.raises(BadInput, match="`load` must leave the loop an equilibrium"):
        upc.linear_plant(AUV, position=np.zeros(6), load=[1e3] * 6)
    for time, said in ((0.5, "shape"), ([[0.0]], "shape"), (["soon"], "numbers"), ([np.nan], "finite")):
        with pytest.raises(BadInput, match=rf"`time(\[0\])?` must .*{said}"):
            upc.reference(PENDULUM, time)
