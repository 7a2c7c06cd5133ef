"""Battery, speed controllers and energy ledger: closed forms, limits that are met and never passed, diagnostics that close."""

import itertools
from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from jaxtyping import Array, Float
from scipy.integrate import quad

import undertow as ut
from undertow.control.navigation.perfect import perfect
from undertow.control.references.setpoint import setpoint
from undertow.core.contracts import AbstractContinuousController, Model
from undertow.core.errors import BadInput
from undertow.core.numerics.integrators import METHODS
from undertow.physics.disturbances.none import none
from undertow.physics.plants import double_integrator, hybrid_vehicle
from undertow.physics.power import battery, esc
from undertow.physics.power.esc import ESC
from undertow.physics.power.ledger import closure
from undertow.physics.thrusters import first_order, linear_voltage, paper_table3, t200
from undertow.physics.thrusters.fidelity_levels import FIDELITIES
from undertow.physics.vehicles import odin
from undertow.simulation.loop import continuous, sampled
from undertow.simulation.loop.closed_loop import ClosedLoop

THRUSTERS = {"t200": t200, "table3": paper_table3}
# Stiff enough for both: Table 3 takes 10 A a thruster at 12 V, eight of them.
BATTERY = battery(resistance=0.01)


class Driven(AbstractContinuousController):
    """Voltages size * (bias + sin(7 t + phase)), whatever is measured; the state is the time."""

    model: Model
    size: Float[Array, ""]
    bias: Float[Array, ""]
    method: str = eqx.field(static=True, default="rk4")
    substeps: int = eqx.field(static=True, default=1)

    def init(self, y, r):
        return jnp.zeros(())

    def command(self, z, y, r):
        volts = self.size * (self.bias + jnp.sin(7 * z + jnp.arange(8.0)))
        return volts, {}

    def signals(self):
        return {}

    def flow(self, z, y, r, u_applied):
        return jnp.ones(())

    def project(self, z):
        return z


def loop_of(thruster, size=8.0, bias=0.0, **power):
    plant = hybrid_vehicle(odin(), thruster, **power)
    law = Driven(plant.model(), jnp.asarray(size), jnp.asarray(bias))
    return ClosedLoop(plant, law, setpoint(np.zeros(6)), none(), perfect())


def recorded(outcome):
    return {"time": outcome.time, **outcome.signals}


# ----------------------------------------------------------------------------------------------------- the diagnostics


@eqx.filter_jit
def flows_of(thruster, state, volts):
    """Powers, and the rate of the stored energy."""
    return thruster.powers(state, volts), jax.jvp(thruster.stored, (state,), (thruster.dynamics(state, volts),))[1]


@pytest.mark.parametrize("fidelity", FIDELITIES)
@pytest.mark.parametrize("name", ["t200", pytest.param("table3", marks=pytest.mark.full)])
def test_rates_of_the_ledger_cancel_at_every_instant(name, fidelity):
    """source + conversion = copper + friction + water + d(stored)/dt at random states, in both directions."""
    thruster, rng = THRUSTERS[name](fidelity), np.random.default_rng(1)
    volts = jnp.asarray(12 * rng.normal(size=400))
    state = jax.tree.map(lambda leaf: leaf + 30 * rng.normal(size=leaf.shape), thruster.initial_state(400))
    flows, stored = flows_of(thruster, state, volts)
    left = flows.source + flows.conversion - flows.copper - flows.friction - flows.water - stored
    assert (np.abs(left) <= 1e-12 * np.max(np.abs(flows), axis=0)).all()
    if name == "t200" and fidelity != "ideal":
        np.testing.assert_array_equal(flows.conversion, 0.0, err_msg="k_t = k_e: nothing out of nothing")


CASES = list(itertools.product(THRUSTERS, FIDELITIES, ("sampled", "continuous")))
# Every fidelity, and each loop with a battery and without one.
QUICK = {
    ("t200", "shaft", "sampled"),
    ("table3", "ideal", "continuous"),
    ("table3", "electromechanical", "sampled"),
    ("t200", "static", "continuous"),
}


@pytest.mark.full
@pytest.mark.parametrize(
    ("name", "fidelity", "kind"),
    [case if case in QUICK else pytest.param(*case, marks=pytest.mark.slow) for case in CASES],
)
def test_ledger_closes_in_both_loops(name, fidelity, kind):
    """1e-8 of the energy drawn. Every fidelity and loop meets a battery with one thruster and none with the other."""
    cells = BATTERY if (name == "t200") == (kind == "sampled") else None
    loop, dt = loop_of(THRUSTERS[name](fidelity), battery=cells), 2e-4
    if kind == "sampled":
        outcome = sampled.simulate(loop, duration=0.5, dt=dt, record_every=50)
    else:
        outcome = continuous.simulate(loop, duration=0.5, record_step=1e-2, dt=dt)
    assert int(outcome.status) == 0
    diagnostics = recorded(outcome)
    assert diagnostics["energy_source"][-1] > 1, "J: something was drawn"
    assert ("state_of_charge" in diagnostics) == (cells is not None)
    shares = closure(diagnostics)
    assert shares["energy_balance_residual"] <= 1e-12, shares
    assert shares["energy_integration_residual"] <= 1e-5, shares
    if cells is not None:
        gone = cells.energy(diagnostics["charge_drawn"][-1])
        np.testing.assert_allclose(
            gone, diagnostics["energy_source"][-1] + diagnostics["energy_battery"][-1], rtol=1e-9
        )


@pytest.mark.parametrize(
    ("fidelity", "method", "source"),
    [
        ("electromechanical", "euler", "battery"),
        pytest.param("shaft", "rk4", "battery", marks=pytest.mark.full),
        pytest.param("shaft", "euler", "supply", marks=pytest.mark.full),
        pytest.param("electromechanical", "rk4", "supply", marks=pytest.mark.full),
        pytest.param("shaft", "rk4", "supply", marks=pytest.mark.slow),
        pytest.param("shaft", "euler", "battery", marks=pytest.mark.slow),
        pytest.param("electromechanical", "rk4", "battery", marks=pytest.mark.slow),
        pytest.param("electromechanical", "euler", "supply", marks=pytest.mark.slow),
    ],
)
def test_defect_falls_with_the_step_at_the_order_of_the_integrator(fidelity, method, source):
    """The plant under a constant voltage, by steps h, h/2, h/4 (Euler: from h/8). `diagnostics` do not care."""
    cells, dt = BATTERY if source == "battery" else None, {"shaft": 0.02, "electromechanical": 4e-3}[fidelity]
    plant, volts = hybrid_vehicle(odin(), paper_table3(fidelity), battery=cells), jnp.linspace(2.0, 6.0, 8)
    step, (order, first) = METHODS[method], {"rk4": (4, 1), "euler": (1, 8)}[method]

    @jax.jit
    def diagnostics(dt, steps):
        field = lambda t, x: plant.dynamics(t, x, volts, plant.no_load())
        move = lambda k, x: step(field, jnp.zeros(()), x, dt)
        return plant.diagnostics(jax.lax.fori_loop(0, steps, move, plant.initial_state()), volts)

    ends = [diagnostics(dt / n, np.asarray(round(0.2 / dt * n))) for n in (first, 2 * first, 4 * first)]
    assert all(abs(end["energy_residual"]) < 1e-12 * end["energy_source"] for end in ends)
    defects = np.abs([end["energy_integration_error"] / end["energy_source"] for end in ends])
    assert defects[-1] > 1e-12, "above rounding"
    slopes = np.log2(defects[:-1] / defects[1:])
    assert abs(slopes[-1] - order) < 0.2, (defects, slopes)


def test_closure_over_a_part_of_a_run():
    time = np.arange(5.0)
    diagnostics = {
        "time": time,
        "energy_source": 100 * time,
        "energy_residual": np.array([0.0, 1.0, -2.0, 0.5, 0.5]),
        "energy_integration_error": np.array([0.0, 0.0, 0.0, 0.0, 8.0]),
    }
    assert closure(diagnostics) == {"energy_balance_residual": 0.005, "energy_integration_residual": 0.02}
    assert closure(diagnostics, 2.0, 3.0) == {"energy_balance_residual": 0.025, "energy_integration_residual": 0.0}
    assert closure(diagnostics, 2.2, 2.4) == {"energy_balance_residual": 0.0, "energy_integration_residual": 0.0}, (
        "no record, no claim"
    )
    assert closure({"time": time}) == {}


def test_books_are_kept_wherever_there_is_a_motor():
    assert hybrid_vehicle(odin(), t200()).power.ledger
    assert not hybrid_vehicle(odin(), t200(), ledger=False).power.ledger
    for without in (linear_voltage(), first_order()):
        assert not hybrid_vehicle(odin(), without).power.ledger
        with pytest.raises(BadInput, match="`ledger` must be false"):
            hybrid_vehicle(odin(), without, ledger=True)


@pytest.mark.full
def test_every_run_says_how_far_its_books_close():
    """By default and in both windows; not where there are none."""
    for plant in (ut.HybridVehicle(odin(), paper_table3("static")), double_integrator(8)):
        law = Driven(plant.model(), jnp.asarray(8.0), jnp.asarray(0.0), "euler")
        run = ut.simulate(plant, law, setpoint(np.ones(len(plant.outputs))), duration=0.2)
        for window in ("steady", "whole"):
            share = run.metrics[window].get("energy_balance_residual")
            assert share is None if len(plant.outputs) == 8 else 0 <= share <= 1e-8


@pytest.mark.full
def test_books_change_nothing_else():
    """The same motion with and without, to rounding."""
    ends = []
    for ledger in (True, False):
        outcome = sampled.simulate(loop_of(t200(), ledger=ledger), duration=0.5, record_every=0, method="euler")
        ends.append(np.concatenate([np.ravel(leaf) for leaf in jax.tree.leaves(outcome.final[0]._replace(power=()))]))
    np.testing.assert_allclose(*ends, rtol=1e-12, atol=1e-14)


# --------------------------------------------------------------------------------------------------- the battery

CELLS = battery(full_voltage=16.8, empty_voltage=13.2, resistance=0.05, capacity=10.0)
DRAWN = np.linspace(0.0, 36000.0, 7)  # C, full to empty


class AtPower(NamedTuple):
    """What the cells say at DRAWN and a power for each of them."""

    emf: Array
    state_of_charge: Array
    energy: Array
    bus: Array
    current: Array
    loss: Array
    allowed: Array


@jax.jit
def _cells(drawn, power, voltage):
    of = CELLS.open_circuit_voltage(drawn), CELLS.state_of_charge(drawn), CELLS.energy(drawn)
    under = CELLS.bus_voltage(drawn, power), CELLS.current(drawn, power), CELLS.loss(drawn, power)
    return AtPower(*of, *under, CELLS.allows(drawn, voltage, power))


def cells(power=0.0, voltage=0.0):
    return AtPower(*map(np.asarray, _cells(DRAWN, np.full(7, power), np.full(7, voltage))))


def test_open_circuit_voltage_is_linear_in_the_charge():
    np.testing.assert_allclose(cells().emf[[0, 3, 6]], [16.8, 15.0, 13.2])
    np.testing.assert_allclose(cells().state_of_charge[[0, 3, 6]], [1.0, 0.5, 0.0], atol=1e-15)


@pytest.mark.parametrize("power", [-500.0, 0.0, 1.0, 400.0, 860.0])
def test_bus_voltage_solves_its_quadratic(power):
    """v^2 - E v + R P = 0, the larger root; current P / v, heat R i^2."""
    found = cells(power)
    emf, v = found.emf, found.bus
    assert (v >= emf / 2).all()
    np.testing.assert_allclose(v**2 - emf * v + 0.05 * power, 0.0, atol=1e-10)
    np.testing.assert_allclose(emf - 0.05 * found.current, v, rtol=1e-11, err_msg="Ohm's law")
    np.testing.assert_allclose(found.loss, 0.05 * found.current**2, rtol=1e-9, atol=1e-9)


def test_no_more_than_the_largest_power_can_be_drawn():
    """E^2 / (4 R) at half the voltage; the search for the limit stops there."""
    emf = cells().emf
    most = emf**2 / (4 * 0.05)
    np.testing.assert_allclose(cells(most).bus, emf / 2, rtol=1e-5)
    np.testing.assert_allclose(cells(2 * most).bus, emf / 2, rtol=1e-5)
    assert cells(0.999999 * most, emf / 2).allowed.all()
    assert not cells(1.000001 * most, emf / 2).allowed.any()


def test_energy_of_the_cells_is_the_integral_of_voltage_over_charge():
    voltage = jax.jit(lambda q: CELLS.open_circuit_voltage(q))
    for drawn, energy in zip(DRAWN[1:], cells().energy[1:], strict=True):
        expected, _ = quad(lambda q: float(voltage(q)), 0.0, drawn)
        np.testing.assert_allclose(energy, expected, rtol=1e-12)


@jax.jit
def limit_for(ohms, top):
    return CELLS.limit(jnp.asarray(9000.0), lambda v: v**2 / ohms, top)


@pytest.mark.parametrize("ohms", [0.5, 4.0, 60.0])
def test_limit_for_a_resistor_is_the_voltage_divider(ohms):
    """P = v^2 / r behind R gives v = E r / (r + R), tight to the search's 20 nV; less is given as it is."""
    expected = (16.8 - 3.6 * 9000 / 36000) * ohms / (ohms + 0.05)
    found = limit_for(ohms, 40.0)
    assert expected - 1e-7 < found <= expected + 1e-12
    assert limit_for(ohms, 5.0) == 5.0


@pytest.mark.parametrize(
    "wrong", [dict(resistance=-1.0), dict(capacity=0.0), dict(full_voltage=12.0, empty_voltage=13.0)]
)
def test_impossible_batteries_are_refused(wrong):
    name = "empty_voltage" if "empty_voltage" in wrong else next(iter(wrong))
    with pytest.raises(BadInput, match=f"`{name}` must be"):
        battery(**wrong)


@eqx.filter_jit
def bus_of(plant, x, applied):
    return plant.power.bus_voltage(plant.thruster, x.thrusters, x.power, applied)


@eqx.filter_jit
def effort(plant, x, applied):
    return plant.effort(x, applied)


@eqx.filter_jit
def admissible(plant, x, volts):
    return plant.admissible(x, volts)


def tight(plant, x, applied, slack):
    """Whether the largest voltage is that of the bus, or the power the most that the battery has, up to a share."""
    bus = float(bus_of(plant, x, applied))
    emf = float(plant.power.battery.open_circuit_voltage(x.power.charge))
    power = float(effort(plant, x, applied).power.sum())
    most = emf**2 / (4 * float(plant.power.battery.resistance))
    return float(np.abs(applied).max()) >= bus * (1 - slack) or power >= most * (1 - 2 * slack)


@pytest.mark.parametrize(
    "fidelity", [name if name == "static" else pytest.param(name, marks=pytest.mark.full) for name in FIDELITIES]
)
def test_voltages_stay_within_what_the_battery_gives_and_reach_it(fidelity):
    """Asked for far too much: never above the bus under that load, as high as it goes, smaller ones untouched."""
    plant = hybrid_vehicle(odin(), t200(fidelity, supply=30.0), battery=battery(resistance=0.1))
    asked = np.array([40.0, -40.0, 25.0, 3.0, -3.0, 0.5, 0.0, 16.0])
    x = plant.initial_state()
    for drawn in (0.0, 30_000.0, 64_800.0):
        at = x._replace(power=x.power._replace(charge=jnp.asarray(drawn)))
        applied = np.asarray(admissible(plant, at, asked))
        assert np.abs(applied).max() <= bus_of(plant, at, applied) * (1 + 1e-12)
        assert tight(plant, at, applied, 1e-6)
        np.testing.assert_array_equal(applied[3:7], asked[3:7])
        cut = np.abs(applied) < np.abs(asked)
        assert cut[:3].all()
        np.testing.assert_array_equal(effort(plant, at, applied).saturated, cut.astype(float))
        assert effort(plant, at, 0.99 * applied).saturated.sum() == 0


@pytest.mark.slow
@pytest.mark.parametrize("fidelity", ["static", "shaft"])
def test_limit_holds_along_a_run_and_the_battery_sags(fidelity):
    """With speed controllers, which round down there: no voltage above the bus under the load that it makes."""
    loop = loop_of(t200(fidelity, supply=30.0), size=40.0, battery=battery(resistance=0.1, capacity=0.2), esc=esc())
    outcome = sampled.simulate(loop, duration=1.0, dt=5e-4, record_every=20)
    top, bus = np.abs(outcome.signals["input"]).max(1), np.asarray(outcome.signals["bus_voltage"])
    assert (top <= bus * (1 + 1e-12)).all()
    assert np.asarray(outcome.signals["saturated"]).any(1).mean() > 0.9
    x, _ = outcome.final
    assert tight(loop.plant, x, outcome.signals["input"][-1], 1 / 200)
    assert outcome.signals["state_of_charge"][-1] < 0.9


# ------------------------------------------------------------------------------------------------ speed controllers


def test_pulses_are_whole_clipped_and_dead_near_neutral():
    pulse, voltage = eqx.filter_jit(ESC.pulse), eqx.filter_jit(ESC.voltage)
    free, limited, part, bus = np.full(8, False), np.full(8, True), esc(), np.asarray(16.0)
    volts = np.array([0.0, 8.0, 8.013, 8.03, -8.0, 16.0, 99.0, -99.0])
    found = pulse(part, volts, bus, free)
    np.testing.assert_array_equal(found, [1500, 1700, 1700, 1701, 1300, 1900, 1900, 1100])
    pulses = np.array([1500.0, 1525.0, 1475.0, 1526.0, 1474.0, 1900.0, 2000.0, 1000.0])
    np.testing.assert_allclose(voltage(part, pulses, bus), [0, 0, 0, 1.04, -1.04, 16, 16, -16], rtol=1e-14)
    inward = pulse(part, np.resize([8.03, -8.03, 8.0, -16.0], 8), bus, limited)[:4]
    np.testing.assert_array_equal(inward, [1700, 1300, 1700, 1100], err_msg="towards neutral when there is no more")
    coarse = pulse(esc(resolution=4.0, dead_band=0.0), np.resize([0.05, 0.09, -0.09], 8), bus, free)[:3]
    np.testing.assert_array_equal(coarse, [1500, 1504, 1496])


def test_applied_voltages_are_whole_pulses_and_pass_unchanged_a_second_time():
    plant = hybrid_vehicle(odin(), t200("static", supply=16.0), esc=esc())
    x = plant.initial_state()
    applied = np.asarray(admissible(plant, x, np.linspace(-20.0, 20.0, 8)))
    pulses = applied / 16 * 400
    np.testing.assert_allclose(pulses, np.round(pulses), atol=1e-9)
    np.testing.assert_allclose(admissible(plant, x, applied), applied, rtol=1e-14)
    np.testing.assert_array_equal(effort(plant, x, applied).saturated, [1, 0, 0, 0, 0, 0, 0, 1])


def test_speed_controllers_need_a_bus_voltage():
    with pytest.raises(BadInput, match="`esc` must have a finite bus voltage"):
        hybrid_vehicle(odin(), paper_table3(), esc=esc())
    hybrid_vehicle(odin(), paper_table3(), esc=esc(), battery=battery())


# ------------------------------------------------------------------------------------------------------- gradients


@pytest.mark.full
def test_gradients_of_the_battery_are_finite_at_its_limit():
    for power in (0.0, 16.8**2 / 0.2, 5000.0):
        for of in (CELLS.bus_voltage, CELLS.current, CELLS.loss):
            assert np.isfinite(jax.grad(of, argnums=(0, 1))(0.0, power)).all()


@pytest.mark.full
@pytest.mark.parametrize(
    "fidelity",
    [
        "electromechanical",
        *(pytest.param(name, marks=pytest.mark.slow) for name in FIDELITIES if name != "electromechanical"),
    ],
)
def test_gradients_through_a_run_with_battery_and_books_are_finite(fidelity):
    """From rest, where square roots have none: energies and motion by size of the voltage and internal resistance."""

    @jax.jit
    def gradient(size, resistance):
        def total(size, resistance):
            plant = hybrid_vehicle(odin(), t200(fidelity, dead_zone=0.0), battery=battery())
            plant = eqx.tree_at(lambda of: of.power.battery.resistance, plant, resistance)
            volts = size * jnp.linspace(-1.0, 1.0, 8)

            def step(x, _):
                applied = plant.admissible(x, volts)
                return METHODS["euler"](lambda t, x: plant.dynamics(t, x, applied, plant.no_load()), 0.0, x, 1e-3), None

            x, _ = jax.lax.scan(step, plant.initial_state(), None, length=10)
            return sum(jnp.sum(leaf) for leaf in jax.tree.leaves((plant.diagnostics(x, volts), x)))

        return jax.grad(total, argnums=(0, 1))(size, resistance)

    for size in (0.0, 6.0, 60.0):
        assert np.isfinite(gradient(jnp.asarray(size), jnp.asarray(0.02))).all()
