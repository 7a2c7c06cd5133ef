"""Robustness of signals in closed form; the text of formulas; the smooth robustness and its gradient."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from undertow.analysis.temporal.formula import NUMPY, smooth
from undertow.analysis.temporal.parsing import Entries, FormulaNames, parse_formula
from undertow.analysis.temporal.requirements import Requirement, evaluate_requirements
from undertow.core.errors import BadInput
from undertow.core.status import Status

PERIOD, SIZE = 0.1, 201  # s, to 20 s
TIME = PERIOD * np.arange(SIZE)
KNOWN = FormulaNames(
    {
        "error": Entries(("north", "yaw")),
        "input": Entries(("0", "1")),
        "saturated": Entries(("0", "1")),
        "depth": Entries(()),
    },
    ("m", "rad"),
)
SIGNALS = {
    "error": np.stack([np.exp(-TIME), 0.5 * np.cos(TIME)], axis=-1),
    "input": np.stack([TIME, -2 * TIME], axis=-1),
    "saturated": np.stack([(TIME >= 5) & (TIME < 7), TIME < 0], axis=-1).astype(float),
    "depth": 20 - TIME,
}


def robustness(text, by=NUMPY, signals=SIGNALS):
    return parse_formula(text, KNOWN).robustness(signals, PERIOD, by)


@pytest.mark.parametrize(
    ("text", "value"),
    [
        # What decays is largest at the beginning of the interval: 1 - exp(-10) / 0.1.
        ("always[10, 20] position_error < 0.1", 1 - np.exp(-10) / 0.1),
        ("always position_error < 0.1", 1 - 1 / 0.1),
        # Within 10 s and then always is always from 10 s on, because the error decays.
        ("within 10 s always position_error < 0.1", 1 - np.exp(-10) / 0.1),
        ("eventually[0, 3] position_error < 0.1", 1 - np.exp(-3) / 0.1),
        ("never abs(error[yaw]) > 0.6", 1 / 6),
        ("always attitude_error < 30 deg", 1 - 0.5 / np.radians(30)),
        # Above a limit, relative to it; and the limit zero, of which the robustness is no share.
        ("always[0, 4] depth > 15", 1 / 15),
        ("always[0, 4] depth > 0", 16),
        ("always[0, 4] largest(input) < 10", 0.2),
        ("always[4, 4] norm(input) < 10", 1 - 4 * np.sqrt(5) / 10),
        ("always[4, 4] input[1] < -6", 1 / 3),
        ("always[4, 4] mean(input) > -4", 1 / 2),
        # Two of any five seconds are saturated, in one of two inputs.
        ("always mean(largest(saturated), 5 s) < 0.5", 1 - 0.4 / 0.5),
        ("always mean(mean(saturated), 5 s) < 0.5", 1 - 0.2 / 0.5),
        ("always mean(largest(saturated), 5 s) < 0.3", 1 - 0.4 / 0.3),
        # A mean over the last 2 s of t is t - 0.95 on this grid.
        ("always[4, 4] mean(input[0], 2 s) < 10", 1 - 3.05 / 10),
        ("not always depth > 15", 1.0),
        ("always[0, 4] depth > 15 and always[0, 4] depth < 40", 1 / 15),
        ("always[0, 4] depth > 15 or always[0, 4] depth < 40", 0.5),
        # Until t the input is t at most and the depth 20 - t: the best instant of the grid is 5.7 s, or 4.2 s.
        ("input[0] < 6 until depth < 15", 0.7 / 15),
        ("input[0] < 4 until depth < 15", -0.8 / 15),
        ("input[0] < 6 until[0, 4] depth < 15", -1 / 15),
        ("input[0] < 6 until[5.8, 10] depth < 15", 0.2 / 6),
    ],
)
def test_robustness_in_closed_form(text, value):
    np.testing.assert_allclose(robustness(text)[0], value, rtol=1e-9, atol=1e-12)


def brute_until(first, second, start, stop):
    """By the definition, for every instant."""
    found = []
    for t in range(len(first)):
        ends = range(t + start, min(t + stop, len(first) - 1) + 1)
        found.append(max((min(second[end], first[t : end + 1].min()) for end in ends), default=-np.inf))
    return np.array(found)


@pytest.mark.parametrize(("start", "stop"), [(0, 200), (0, 7), (3, 12), (190, 200)])
def test_windows_and_until_by_their_definitions(start, stop):
    chance = np.random.default_rng(2)
    signals = SIGNALS | {"depth": chance.normal(size=SIZE), "input": chance.normal(size=(SIZE, 2))}
    interval = f"[{start * PERIOD:g}, {stop * PERIOD:g}]"
    depth, force = -signals["depth"], -signals["input"][:, 0]
    windows = [range(t + start, min(t + stop, SIZE - 1) + 1) for t in range(SIZE)]
    least = [min((depth[k] for k in window), default=np.inf) for window in windows]
    most = [max((depth[k] for k in window), default=-np.inf) for window in windows]
    np.testing.assert_array_equal(robustness(f"always{interval} depth < 0", signals=signals), least)
    np.testing.assert_array_equal(robustness(f"eventually{interval} depth < 0", signals=signals), most)
    until = robustness(f"input[0] < 0 until{interval} depth < 0", signals=signals)
    np.testing.assert_array_equal(until, brute_until(force, depth, start, stop))


TEXTS = (
    "within 2 s always[0, 5] position_error < 0.1",
    "input[0] < 6 until[1, 10] depth < 15",
    "always mean(largest(saturated), 5 s) < 0.5",
)


@pytest.mark.full
@pytest.mark.parametrize("text", TEXTS)
def test_smooth_robustness_is_near_the_exact_one(text):
    exact, found = robustness(text)[0], jax.jit(lambda sharpness: robustness(text, smooth(sharpness))[0])
    for sharpness in (100.0, 1000.0):
        # At most four nested extrema over at most SIZE instants.
        assert abs(float(found(sharpness)) - exact) < 4 * np.log(SIZE) / sharpness


@pytest.mark.full
@pytest.mark.parametrize("text", TEXTS[:2])
def test_gradient_of_the_smooth_robustness(text):
    """Against central differences of the same."""
    both = jax.jit(
        jax.value_and_grad(
            lambda scale: robustness(text, smooth(20.0), {name: scale * jnp.asarray(s) for name, s in SIGNALS.items()})[
                0
            ]
        )
    )
    at = lambda scale: both(scale)[0]
    slope, step = both(1.3)[1], 1e-5
    difference = (at(1.3 + step) - at(1.3 - step)) / (2 * step)
    assert abs(difference) > 1e-3
    np.testing.assert_allclose(slope, difference, rtol=1e-5)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("always", "must name a signal, after `always`, but is the end"),
        ("always positon_error < 0.1", "but is `positon_error`. Did you mean `position_error`?"),
        ("always error < 0.1", "Its entries are north, yaw: write `error[north]`, or `norm(error)`"),
        ("always error[surge] < 1", "must name an entry of `error`, but is 'surge'"),
        ("always norm(depth) < 1", "must use `norm` for a signal with several entries, but is `depth`"),
        ("always depth < deep", "must have a number, after `always depth <`, but is 'deep'"),
        ("always depth", "must compare a value with a number by `<` or `>`"),
        ("always[5, 2] depth < 1", "but is [5, 2]"),
        ("within 0 s depth < 1", "must have positive times"),
        ("(depth < 1", "must have `)`"),
        ("depth < 1 depth > 0", "must end, or go on with"),
        ("depth ~ 1", "must be a formula such as"),
        (5000 * "(" + "depth < 1" + 5000 * ")", "must have at most 40 formulas inside one another"),
        (5000 * "not " + "depth < 1", "must have at most 40 formulas inside one another"),
        ("depth[", "must name an entry, after `depth[`, but is the end"),
        ("", "must name a signal, at the beginning"),
    ],
)
def test_texts_that_are_no_formulas(text, said):
    with pytest.raises(BadInput) as error:
        parse_formula(text, KNOWN)
    assert said in str(error.value)


def test_verdicts_of_runs():
    """A bound of a metric, a run that failed, and what is not defined."""
    formula = Requirement("settles", parse_formula("always[10, 20] position_error < 0.1", KNOWN))
    bound = Requirement("energy", below=-2.0)
    judge = lambda metrics, status, ended, signals=SIGNALS: evaluate_requirements(
        (formula, bound), signals, PERIOD, metrics, int(status), ended, 20.0
    )
    kept = judge({"energy": -3.0}, Status.OK, 20.0)
    assert kept["energy"] == (0.5, True) and kept["settles"].holds
    np.testing.assert_allclose(kept["settles"].robustness, 1 - np.exp(-10) / 0.1, rtol=1e-12)
    assert judge({"energy": -1.0}, Status.OK, 20.0)["energy"] == (-0.5, False)
    assert judge({}, Status.OK, 20.0)["energy"] == (-1.0, False)
    failed = judge({"energy": -3.0}, Status.NOT_FINITE, 5.0)
    assert failed == {"settles": (-1.75, False), "energy": (-1.75, False)}
    undefined = SIGNALS | {"error": np.full((SIZE, 2), np.nan)}
    assert judge({"energy": -3.0}, Status.OK, 20.0, undefined)["settles"] == (-1.0, False)
