"""One step of what preset `learning` remembers, against its equations in NumPy: inertia, evidence and the memory itself."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from two_axes import DT, GAINS, GOAL, THETA, A, E, R, V, Y, same

from undertow.control.controllers import rcaf
from undertow.control.controllers.robust import evidence
from undertow.control.controllers.robust.estimator import EstimatorState
from undertow.control.controllers.robust.evidence import Evidence
from undertow.control.controllers.robust.inertia import InertiaIdentification, InertiaState
from undertow.control.controllers.robust.memory import MemoryState, TrainingSample, memory
from undertow.control.controllers.robust.robust_law import RobustState
from undertow.core.contracts import TrackingError
from undertow.physics.plants import double_integrator

RNG = np.random.default_rng(11)
PROBED = {"duration": 50.0, "horizon": 400.0, "window": 5.0, "plausible": 0.4, "error_share": 0.25}
AMPLITUDE, FREQUENCY, EXPECTED = np.array([0.1, 0.0]), np.array([4.0, 6.0]), np.array([1.2, 0.9])


def inertia_state(since):
    sums = iter(RNG.uniform(0.5, 1.5, (20, 2)))
    pair = lambda scale: scale * np.stack([next(sums), next(sums)])
    response = pair(0.02)
    applied = (1.7 + 0.2j) * 1j * FREQUENCY * (response[0] + 1j * response[1])
    return InertiaState(
        angle=np.array([6.2, 1.3]),
        time=np.array([12.0, 20.0]),
        counted=np.array([11.0, 15.0]),
        response=response,
        applied=np.stack([applied.real, applied.imag]),
        since=np.array(since),
        window_response=pair(0.01),
        window_applied=pair(0.05),
        window_size=0.1 * next(sums),
        noise=1e-3 * next(sums),
        square=np.array([1e-4, 4e-4]),
    )


def response_of(z):
    """N / (j w V) of complex sums."""
    v, n = (one[0] + 1j * one[1] for one in (z.response, z.applied))
    motion = 1j * FREQUENCY * v
    return (n * motion.conj()).real / np.abs(motion) ** 2, (n * motion.conj()).imag / np.abs(motion) ** 2


def standard_error(z):
    real, _ = response_of(z)
    size = (np.abs(z.response[0] + 1j * z.response[1]) * FREQUENCY) ** 2
    beyond = real - np.clip(real, 1 / 2.5, 2.5)
    return np.sqrt(5.0 * z.noise / (2 * size) + (5.0 / z.counted) ** 4 + beyond**2)


def ratio_of(z):
    real, error = response_of(z)[0], standard_error(z)
    found = np.clip(EXPECTED + (real - EXPECTED) * 0.16 / (0.16 + error**2), 0.4, 2.5)
    return np.where(AMPLITUDE > 0, found, EXPECTED)


def motion_of(z):
    left = np.sqrt(1 - z.time / 50.0)
    size = left * np.minimum(AMPLITUDE, 0.25 * FREQUENCY**2 * np.sqrt(z.square))
    turning = size * np.exp(1j * z.angle)
    return turning.imag / FREQUENCY**2, turning.real / FREQUENCY, -turning.imag, size, left


def probed(z, error, rate, nominal, free):
    """Sums one step later, as complex numbers; at the end of a window they enter what is found."""
    span = free * DT
    displacement, _, _, size, share = motion_of(z)
    v = z.window_response[0] + 1j * z.window_response[1] + span * rate * np.exp(-1j * z.angle)
    n = z.window_applied[0] + 1j * z.window_applied[1]
    n = n + span * nominal * np.exp(-1j * (z.angle + FREQUENCY * DT / 2))
    real, imaginary = response_of(z)
    left = np.abs(n - (real + 1j * imaginary) * 1j * FREQUENCY * v) ** 2 / 5.0
    total = z.window_size + span * size
    most = 5.0 * 9.0 * z.noise / z.counted + (total / 2) ** 2 / 5.0
    ended = z.since + span >= 5.0
    weight = most / (most + left) if ended else 0.0
    kept, running = 1 - span / 400.0, 0.0 if ended else 1.0
    pair = lambda one: np.stack([one.real, one.imag])
    return InertiaState(
        angle=np.mod(z.angle + FREQUENCY * DT, 2 * np.pi),
        time=kept * z.time + span * share**2,
        counted=kept * z.counted + share**2 * weight * 5.0,
        response=kept * z.response + share * weight * pair(v),
        applied=kept * z.applied + share * weight * pair(n),
        since=running * (z.since + span),
        window_response=running * pair(v),
        window_applied=running * pair(n),
        window_size=running * total,
        noise=kept * z.noise + share**2 * weight * left,
        square=z.square + DT / 5.0 * ((error + displacement) ** 2 - z.square),
    )


def test_one_step_of_the_identification_of_inertia():
    """Within a window, at its end, and while limits bind."""
    one = InertiaIdentification(AMPLITUDE, FREQUENCY, expected=jnp.asarray(EXPECTED), **PROBED)
    error, rate, nominal = np.array([0.02, -0.01]), np.array([0.03, 0.05]), np.array([0.2, -0.3])
    states = [inertia_state(since) for since in (1.0, 4.99, 4.99)]

    def step(case):
        z, free = case
        identified = one.ratio(z), one.used(z), one.error(z), one.motion(z)
        return identified, one.advance(z, *map(jnp.asarray, (error, rate, nominal)), free, jnp.asarray(DT))

    frees = np.array([1.0, 1.0, 0.0])
    cases = jax.tree.map(lambda *each: np.stack(each), *states), frees
    identified, after = jax.jit(lambda cases: jax.lax.map(step, cases))(cases)
    for place, (z, free) in enumerate(zip(states, frees, strict=True)):
        ratio, used, found_error, motion = (
            np.asarray(each)[..., place, :] for each in (*identified[:3], np.stack(identified[3]))
        )
        np.testing.assert_allclose(ratio, ratio_of(z), rtol=1e-4)  # what is too small to be judged is left out here
        np.testing.assert_allclose(used, np.maximum(ratio, 1.0))
        np.testing.assert_allclose(found_error, np.where(AMPLITUDE > 0, standard_error(z), 1e3), rtol=1e-4)
        same(motion, np.stack(motion_of(z)[:3]))
        same([leaf[place] for leaf in after], list(probed(z, error, rate, nominal, free)), rtol=1e-5)


def test_what_is_implausible_or_not_seen_is_doubted():
    """An inertia of five is taken for 2.5 at most, and its excess for an error; before two windows nothing is known."""
    one = InertiaIdentification(AMPLITUDE[:1], FREQUENCY[:1], plausible=1e3, window=5.0)
    still = jax.tree.map(np.asarray, one.init(1))
    v = 0.3 + 0.4j
    n = 5.0 * 1j * 4.0 * v
    heavy = still._replace(
        response=np.array([[v.real], [v.imag]]), applied=np.array([[n.real], [n.imag]]), counted=np.array([1e6])
    )
    ratio_and_error = jax.jit(jax.vmap(lambda z: (one.ratio(z), one.error(z))))
    ratio, error = ratio_and_error(jax.tree.map(lambda *each: np.stack(each), still, heavy))
    np.testing.assert_allclose(ratio[:, 0], [1.0, 2.5])
    np.testing.assert_allclose(error[:, 0], [1000.0, 2.5], rtol=1e-6)


JUDGING, HORIZON, RATE = 20.0, 60.0, 7.0


def best_share(found):
    """g of least squares and twice its standard error, with a correlation time of 1 s."""
    left = found.alone * found.explained - found.shared**2
    return found.shared / found.explained, 2 * np.sqrt(left / max(float(found.time), 1.0)) / found.explained


def test_evidence_counts_and_forgets():
    before = Evidence(np.array(3.0), *np.array([[4e-3, 5e-3], [1e-3, -2e-3], [3e-3, 6e-3]]))
    unsure = before._replace(explained=np.array([1e-13, 6e-3]))
    new = np.array([[0.05, -0.03], [0.02, 0.04]])
    rules = lambda found: (*evidence.best_share(found), evidence.trust(found), evidence.wrong(found))
    step = jax.jit(
        lambda *each: (evidence.gathered(each[0], *new, jnp.asarray(DT), JUDGING), *(rules(one) for one in each))
    )
    after, found, doubtful = step(*jax.tree.map(jnp.asarray, (before, unsure)))
    fresh = (1.0, new[0] ** 2, new[0] * new[1], new[1] ** 2)
    same(after, tuple((1 - DT / JUDGING) * old + DT * one for old, one in zip(before, fresh, strict=True)))
    share, spread = best_share(before)
    wrong = np.clip(np.abs(share - 1) - spread, 0, 1).max()
    same(found, (share, spread, np.clip(share + spread, 0, 1), wrong))
    assert 0 < found[2][1] < 1 or found[2][1] == 0
    same((doubtful[0][0], doubtful[1][0], doubtful[2][0]), (1.0, 1.0, 1.0))


def remembered(inertia):
    """A memory of two axes with a linear regressor of seven entries, and a state of it."""
    part = memory(
        2, regressor="linear", speeds=[0.5, 0.8], horizon=HORIZON, learning_rate=RATE, bound=0.6, judging_time=JUDGING,
        inertia=inertia,
    )  # fmt: skip
    root = RNG.normal(size=(7, 7))
    state = MemoryState(
        weights=RNG.uniform(-0.6, 0.6, (7, 2)),
        covariance=root @ root.T / 7,
        lagged=RNG.normal(size=7),
        ahead=0.1 * RNG.normal(size=7),
        evidence=Evidence(np.array(9.0), *np.array([[4e-4, 5e-3], [4e-4, 5e-3], [3e-3, 6e-3]])),
        taken=np.array([0.1, -0.2]),
        inertia=None if inertia is None else inertia_state(4.99),
    )
    return part, state


@eqx.filter_jit
def memory_step(part, z, seen, gains, free):
    """Regressors, what the memory says of the state of `two_axes`, and the memory after a step."""
    phi = part.regressors(Y, jnp.asarray(V), TrackingError(E, R, A), False)
    rules = part.value(z, phi, seen.correction), part.inertia_ratio(z), part.probing(z, jnp.asarray(GAINS))
    return phi, rules, part.advance(z, phi, seen, gains, free, jnp.asarray(DT))


@pytest.mark.parametrize("with_inertia", [False, True])
def test_one_step_of_the_memory(with_inertia):
    """Recursive least squares that forgets what is excited; the observer loses what the memory gains."""
    one = InertiaIdentification(AMPLITUDE, FREQUENCY, expected=jnp.asarray(EXPECTED), **PROBED)
    part, z = remembered(one if with_inertia else None)
    seen = TrainingSample(*RNG.normal(size=(6, 2)) * 0.3)
    gains = np.array(0.2), np.array(1.9)
    share = (V + R) / [0.5, 0.8]
    phi = np.concatenate([[1.0], A, share, share * np.abs(share)])
    best, spread = best_share(z.evidence)
    trust, wrong = np.clip(best + spread, 0, 1), np.clip(np.abs(best - 1) - spread, 0, 1).max()
    assert 0 < trust.min() < 1
    assert wrong > 0
    h, probing = np.ones(2), np.zeros(2)
    if with_inertia:
        h, moved = np.maximum(ratio_of(z.inertia), 1.0), motion_of(z.inertia)
        assert h[0] > 1
        probing = moved[2] + GAINS[:, 0] * moved[0] + GAINS[:, 1] * moved[1]
    value = trust * (z.weights.T @ phi) + (1 - h) * seen.correction
    for free in (1.0, 0.0):
        found_phi, rules, (after, lost) = memory_step(part, z, seen, gains, np.asarray(free))
        same(found_phi, phi)
        same(rules, (value, h, probing), rtol=1e-4)
        innovation = h * seen.estimate - (1 - trust) * (z.weights.T @ z.lagged)
        towards = z.covariance @ z.lagged
        size = DT * z.lagged @ towards
        kept = 1 - DT / HORIZON / size
        assert 0 < kept < 1
        explained = z.weights.T @ z.ahead
        alone = h * seen.error + trust * explained
        reopened = wrong * free * DT / JUDGING
        expected = {
            "weights": np.clip(z.weights + free * DT / (1 + size) * np.outer(towards, innovation), -0.6, 0.6),
            "covariance": z.covariance
            - kept * free * DT / (1 + kept * size) * np.outer(towards, towards)
            + reopened * (RATE * np.eye(7) - z.covariance),
            "lagged": z.lagged - 1.9 * z.ahead,
            "ahead": z.ahead + DT * (z.lagged - phi) - 0.2 * z.ahead,
        }
        for name, wanted in expected.items():
            same(getattr(after, name), wanted, rtol=1e-4)
        fresh = (1.0, alone**2, alone * explained, explained**2)
        forgets = 1 - free * DT / JUDGING
        same(
            after.evidence,
            tuple(forgets * old + free * DT * one for old, one in zip(z.evidence, fresh, strict=True)),
            rtol=1e-4,
        )
        later, later_spread = best_share(after.evidence)
        after_trust = np.clip(later + later_spread, 0, 1)
        after_h = np.ones(2)
        if with_inertia:
            nominal = seen.nominal + trust * (z.weights.T @ phi)
            same(list(after.inertia), list(probed(z.inertia, seen.tracking_error, seen.rate, nominal, free)), rtol=1e-5)
            after_h = np.maximum(ratio_of(jax.tree.map(np.asarray, after.inertia)), 1.0)
        gained = after_trust * (np.asarray(after.weights).T @ phi) + (1 - after_h) * seen.correction - value
        same((lost, after.taken - z.taken), (gained / after_h, gained / after_h), rtol=1e-3, atol=1e-6)


def test_a_memory_that_only_harms_is_not_used():
    """Its best share, shared / explained, is -2 with a standard error far below that; one that helps half is used so."""
    found = Evidence(jnp.asarray(1e6), jnp.array([8.0, 2.0]), jnp.array([-4.0, 1.0]), jnp.array([2.0, 2.0]))
    share, spread = evidence.best_share(found)
    np.testing.assert_allclose(share, [-2.0, 0.5])
    assert float(jnp.max(spread)) < 0.1
    np.testing.assert_allclose(evidence.trust(found), [0.0, 0.5 + spread[1]])
    assert float(evidence.wrong(found)) == 1.0


def test_the_law_uses_what_it_remembers():
    """Command and estimator of preset `learning` with an inertia that is known: on what the memory itself gives.

    Where limits leave less than what was commanded, the memory learns nothing.
    """
    law = rcaf(
        double_integrator(2).model(), preset="learning", sampling_time=DT, bandwidth=6.0, feedback=GAINS, damping=1.0,
        reference_frequency=0.0, actuator_rate=9.0, regressor="linear", probing=[0.1, 0.2], weights_bound=50.0,
    )  # fmt: skip
    probed = law.memory.inertia
    np.testing.assert_array_equal(probed.amplitude, [0.1, 0.2])
    np.testing.assert_allclose(probed.frequency, np.sqrt(np.sqrt(GAINS[:, 0]) * 6.0) * [0.8, 1.2])
    part, kept = remembered(InertiaIdentification(AMPLITUDE, FREQUENCY, expected=jnp.asarray(EXPECTED), **PROBED))
    law = eqx.tree_at(lambda law: law.memory, law, part)
    z = RobustState(EstimatorState(np.array([0.9, -0.4]), THETA), (), None, kept)

    double, eps = 1 - np.exp(-6.0 * DT), np.array([0.9, -0.4]) - V

    @eqx.filter_jit
    def step(z):
        u, signals = law.command(z, Y, GOAL)
        observer = law.estimator.estimate(z.estimator, jnp.asarray(V))
        # For its weights, in which the acceleration does not enter.
        alone = law.estimator.advance(z.estimator, observer, u, jnp.zeros(2), jnp.asarray(DT))
        advanced = jax.lax.map(lambda given: law.advance(z, Y, GOAL, given * u, jnp.asarray(DT)), jnp.array([1, 0.5]))
        return u, signals, advanced, observer.uncertainty, alone

    u, signals, advanced, rest, alone = jax.tree.map(np.asarray, step(jax.tree.map(jnp.asarray, z)))
    after, limited = (jax.tree.map(lambda leaf, row=row: leaf[row], advanced) for row in range(2))
    gains = np.array(2 * double), np.array(double**2 / DT)
    of_memory = lambda *seen, free=1.0: jax.tree.map(
        np.asarray, memory_step(part, kept, TrainingSample(*seen), gains, np.array(free))
    )
    phi, (_, h, probing), _ = of_memory(*np.zeros((6, 2)))
    desired = A + GAINS[:, 0] * E + GAINS[:, 1] * R + probing
    correction = desired - A - rest
    _, _, (memory_after, lost) = of_memory(rest, eps, E, correction, -R, u - A)
    value = signals["memory_trust"] * (kept.weights.T @ phi) + (1 - h) * correction
    # What differs from the desired acceleration acts on the inertia that was learnt.
    known = u + (1 / h - 1) * (u + rest + value - desired)
    assert h.max() > 1
    assert np.abs(value).min() > 0.01
    same((signals["memory"], signals["estimate"], u), (value, rest + value, desired - rest - value))
    same(signals["memory_variance"], np.diagonal(kept.covariance) / RATE)
    same(after.estimator.rates, [0.9, -0.4] + DT * (known + rest + value) - 2 * double * eps)
    same(after.memory, memory_after, rtol=1e-8)
    same(after.estimator.weights, alone.weights - lost[:, None])
    still, _ = of_memory(rest, eps, E, correction, -R, u / 2 - A, free=0.0)[2]
    same(limited.memory, still, rtol=1e-8)
