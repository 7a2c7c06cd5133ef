"""The fault-tolerant law in closed loop: detection with the right index, and nothing else changes."""

import functools

import jax
import numpy as np
import pytest

import undertow as ut
from undertow.control.supervision.fault_tolerant_law import fault_tolerant
from undertow.core.contracts import Target
from undertow.core.measurement import measurement_of_outputs
from undertow.scenario.fault_injection import with_faults
from undertow.scenario.schema import Fault
from undertow.simulation.loop.closed_loop import ClosedLoop
from undertow.simulation.loop.loop_runs import RunPlan
from undertow.simulation.prepared_run import prepare_loop
from undertow.simulation.run_many import run_together

DT, ONSET, DURATION = 0.02, 15.0, 18.0
PLANT = ut.HybridVehicle(ut.vehicles.bluerov2_heavy(), ut.thrusters.t200(fidelity="static"))
LAW = ut.controllers.pid(PLANT.model(), sampling_time=DT, frequency=4.8)


def losses():
    """Nothing lost, then each thruster off, then each reversed."""
    shares = [(1, 1.0)] + [(number, share) for share in (0.0, -1.0) for number in range(1, 9)]
    return [Fault(target=f"thruster {i}", mode="fraction", severity=share, onset=ONSET) for i, share in shares]


def loops(law, faults):
    reference = ut.references.lissajous((1.0, 1.0, 0.5, 0.5), (0.3, 0.35, 0.25, 0.3))
    noise, current = ut.navigation.white_noise(0.005, 0.005), ut.disturbances.current([0.5, 0.2, 0.2])
    healthy = ClosedLoop(PLANT, law, reference, current, noise)
    return [with_faults(healthy, [fault], sampling_time=DT)[0] for fault in faults]


def batch(several, signals, every=1):
    plan = RunPlan(round(DURATION / DT), DT, every, signals)
    return run_together([prepare_loop(loop, plan, 3) for loop in several])


@pytest.fixture(scope="module")
def found():
    signals = ("lost_thrusters", "lost_axes", "input", "position")
    return batch(loops(fault_tolerant(LAW, DT), losses()), signals).signals


@pytest.mark.full
def test_the_batch_compiler_takes_it_and_without_a_fault_the_run_has_the_bits_of_the_law_alone(found):
    alone = batch(loops(LAW, losses()[:2]), ("input", "position")).signals
    np.testing.assert_array_equal(found["input"][0], alone["input"][0])
    np.testing.assert_array_equal(found["position"][0], alone["position"][0])
    assert not found["lost_thrusters"][0].any() and not found["lost_axes"][0].any()


@pytest.mark.full
def test_a_thruster_that_works_and_fails_is_found_within_half_a_second_and_no_other_ever(found):
    lost, start = found["lost_thrusters"][1:] > 0, round(ONSET / DT)
    failing = np.tile(np.eye(8, dtype=bool), (2, 1))
    assert not lost[:, :start].any() and not (lost[:, -1] & ~failing).any()
    working = np.abs(found["input"][0, start]) > 4.5  # V; 16 are the limit
    assert working.sum() >= 4
    times = (lost.any(-1).argmax(-1) - start) * DT
    assert lost[:, -1].any(-1)[np.tile(working, 2)].all() and (times[np.tile(working, 2)] <= 0.5).all()


@pytest.mark.full
def test_a_lost_thruster_gets_no_command_and_seven_of_eight_control_every_axis(found):
    lost = found["lost_thrusters"] > 0
    assert lost.any() and (found["input"][lost] == 0.0).all() and not found["lost_axes"].any()


@functools.cache
def stepped():
    law, target = fault_tolerant(LAW, DT), Target(np.array([0.3, 0.0, 0.2, 0.0, 0.0, 0.1]), *np.zeros((2, 6)))

    @jax.jit
    def begun(position, velocity):
        y = measurement_of_outputs(position, velocity)
        return law.init(y, target), y

    return law, *begun(np.zeros(6), np.zeros(6)), target


@jax.jit
def commanded(z, y):
    """Command and signals of the law."""
    law, _, _, target = stepped()
    return law.command(z, y, target)


@jax.jit
def restarted(z, y):
    """State of the law where it begins anew with what it knew, and that of one that begins."""
    law, _, _, target = stepped()
    return law.restarted(law.knowledge(z), y, target), law.init(y, target)


def knowing(z, lost):
    """The state of a law whose monitor has found some actuators lost."""
    findings = z.monitor.findings._replace(lost=np.isin(np.arange(8), lost).astype(float))
    return z._replace(monitor=z.monitor._replace(findings=findings))


@pytest.mark.full
def test_an_announced_failure_acts_at_once_and_ends_with_the_announcement():
    _, z, y, target = stepped()
    failed = y._replace(health=np.array([1.0, 0, 1, 1, 0, 1, 1, 1]))
    u, signals = jax.tree.map(np.asarray, commanded(z, failed))
    np.testing.assert_array_equal(signals["lost_thrusters"], [0, 1, 0, 0, 1, 0, 0, 0])
    assert u[1] == u[4] == 0.0 and (np.delete(u, [1, 4]) != 0).all()
    over, healthy = commanded(z, y)
    np.testing.assert_allclose(over, jax.jit(lambda z: LAW.command(z, y, target)[0])(z.law), rtol=1e-12)
    assert not healthy["lost_thrusters"].any()


@pytest.mark.full
def test_a_restarted_law_knows_what_is_lost():
    _, z, y, _ = stepped()
    again, first = restarted(knowing(z, [2]), y)
    u, signals = jax.tree.map(np.asarray, commanded(again, y))
    assert u[2] == 0.0 and signals["lost_thrusters"][2] == 1.0
    for one, other in zip(jax.tree.leaves(again.law), jax.tree.leaves(first.law), strict=True):
        np.testing.assert_array_equal(one, other)


def test_axes_that_are_lost_are_announced():
    _, z, y, _ = stepped()
    _, signals = commanded(knowing(z, [1, 3, 4, 5, 6, 7]), y)
    assert np.asarray(signals["lost_axes"]).sum() >= 4
