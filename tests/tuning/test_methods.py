"""The methods on costs whose minimum is known; certificates and journals."""

import json
from concurrent.futures import Future

import numpy as np
import pytest

from undertow.core import atomic_io
from undertow.core.errors import BadInput
from undertow.simulation.checkpoint import Checkpoint, OutOfTime
from undertow.studies.tuning.objective import Objective
from undertow.studies.tuning.search import descend, evolve, search
from undertow.studies.tuning.stability import Certificate, no_certificate

RNG = np.random.default_rng(4)
ROOT = RNG.normal(size=(3, 3))
MATRIX = ROOT @ ROOT.T + 0.1 * np.eye(3)
CENTRE = np.array([0.3, 0.6, 0.55])
START = np.array([0.9, 0.1, 0.9])


class Bowl:
    """(x - c)^T A (x - c) + 1."""

    def __init__(self, centre=CENTRE):
        self.centre, self.asked = centre, 0

    def costs(self, points):
        self.asked += 1
        off = points - self.centre
        return 1 + np.einsum("pi,ij,pj->p", off, MATRIX, off)

    def slope(self, point):
        self.asked += 1
        return 2 * MATRIX @ (point - self.centre)


def stable(point):
    return Certificate((0.9, 0.5), ("", ""))


def objective(tmp_path, bowl, certify=stable, resume=False, budget=1e9):
    return Objective(bowl, certify, Checkpoint(tmp_path / "j", "bowl", budget, resume), lambda best, evaluations: None)


def tune(asked, method, iterations=60):
    asked.costs(START[None])
    if method == "gradient":
        descend(asked, START, asked.best.cost, iterations)
    elif method == "evolution":
        evolve(asked, START, asked.best.cost, iterations, seed=1)
    else:
        search(asked, START, iterations, seed=1)
    return asked.best


@pytest.mark.parametrize("method", ["gradient", "search", "evolution"])
def test_minimum_of_a_quadratic(tmp_path, method):
    best = tune(objective(tmp_path, Bowl()), method)
    np.testing.assert_allclose(best.point, CENTRE, atol=2e-2)
    assert best.cost < 1 + 1e-3


def test_slope_that_lies(tmp_path):
    """Uphill: it looks around instead, and comes nearly as low."""
    bowl = Bowl()
    bowl.slope = lambda point: -2 * MATRIX @ (point - CENTRE)
    best = tune(objective(tmp_path, bowl), "gradient")
    assert best.cost - 1 < 0.1 * (Bowl().costs(START[None])[0] - 1)


@pytest.mark.parametrize("method", ["gradient", "search", "evolution"])
def test_minimum_at_a_bound(tmp_path, method):
    """Outside the box in one direction: against a grid."""
    bowl = Bowl(np.array([-0.3, 0.5, 0.5]))
    free = MATRIX[1:, 1:]
    rest = bowl.centre[1:] - np.linalg.solve(free, MATRIX[1:, 0]) * 0.3
    assert ((rest > 0) & (rest < 1)).all()
    best = tune(objective(tmp_path, bowl), method)
    np.testing.assert_allclose(best.point, [0.0, *rest], atol=2e-2)


@pytest.mark.parametrize("method", ["gradient", "search", "evolution"])
def test_nothing_is_accepted_without_certificate(tmp_path, method):
    """Unstable below x_1 = 0.5, where the minimum lies."""
    fenced = lambda point: Certificate((0.9 if point[0] >= 0.5 else 1.01,), ("",))
    asked = objective(tmp_path, Bowl(), fenced)
    best = tune(asked, method)
    assert asked.rejected > 0
    assert all(step.point[0] >= 0.5 and step.radius < 1 for step in asked.steps)
    assert best.cost < asked.steps[0].cost


@pytest.mark.parametrize("method", ["gradient", "search", "evolution"])
@pytest.mark.parametrize("lines", [1, 5, 8])
def test_resumed_is_the_same_as_uninterrupted(tmp_path, method, lines):
    """The checkpoint as a kill leaves it: cut off after some lines, and in the middle of the next."""
    bowl = Bowl()
    whole = objective(tmp_path, bowl)
    tune(whole, method, iterations=6)
    written = (tmp_path / "j").read_text().splitlines(keepends=True)
    assert len(written) > lines + 1
    (tmp_path / "j").write_text("".join(written[:lines]) + written[lines][:7])
    again = Bowl()
    resumed = objective(tmp_path, again, resume=True)
    tune(resumed, method, iterations=6)
    assert [step._replace(elapsed=0.0) for step in resumed.steps] == [
        step._replace(elapsed=0.0) for step in whole.steps
    ]
    assert 0 < again.asked <= bowl.asked
    unlike = lambda text: [{**json.loads(line), "elapsed": 0} for line in text.splitlines()]
    assert unlike((tmp_path / "j").read_text()) == unlike("".join(written))


def test_budget_ends_it(tmp_path):
    asked = objective(tmp_path, Bowl(), budget=0.0)
    with pytest.raises(OutOfTime):
        for _ in range(3):
            asked.costs(START[None])


class Clock:
    """A clock that somebody sets."""

    now = 100.0

    def __call__(self):
        return self.now


class Compiling(Future):
    """Something that takes some time on a clock and cannot be interrupted."""

    def __init__(self, clock, seconds):
        super().__init__()
        self.clock, self.ends = clock, clock.now + seconds

    def result(self, timeout=None):
        assert timeout is not None, "would wait for ever"
        self.clock.now += max(0.0, min(timeout, self.ends - self.clock.now))
        if self.clock.now >= self.ends and not self.done():
            self.set_result("program")
        return super().result(timeout=0)


def test_what_cannot_be_interrupted_is_left_when_the_budget_ends(tmp_path):
    """Compiling takes 1,000 s of a budget of 60 s; every few seconds there is a word."""
    clock, said = Clock(), []
    checkpoint = Checkpoint(tmp_path / "j", "x", 60.0, False, started=95.0, clock=clock)
    with pytest.raises(OutOfTime):
        checkpoint.wait(Compiling(clock, 1000.0), "compiling", said.append)
    assert clock.now == pytest.approx(155.0)  # 60 s after the start of the command
    assert said[:2] == ["compiling: 15 s so far", "compiling: 25 s so far"] and len(said) == 6


def test_what_ends_within_the_budget_is_used(tmp_path):
    clock = Clock()
    checkpoint = Checkpoint(tmp_path / "j", "x", 60.0, False, clock=clock)
    assert checkpoint.wait(Compiling(clock, 35.0), "compiling", lambda words: None) == "program"
    assert clock.now == 135.0
    clock.now += 100.0
    late: Future[str] = Future()
    late.set_result("program")
    assert checkpoint.wait(late, "compiling", lambda words: None) == "program"  # it is there


def test_earlier_sessions_leave_time_to_compile(tmp_path):
    """Their evaluations took 50 s of 60 s; what compiles for ever is left all the same."""
    clock = Clock()
    before = Checkpoint(tmp_path / "j", "x", 60.0, False, started=clock.now - 50.0, clock=clock)
    before.ask("costs", np.zeros(1), lambda: [1.0])
    again = Checkpoint(tmp_path / "j", "x", 60.0, True, clock=clock)
    assert again.wait(Compiling(clock, 35.0), "compiling", lambda words: None) == "program"
    with pytest.raises(OutOfTime):
        again.wait(Compiling(clock, 1000.0), "compiling", lambda words: None)


def test_a_failure_while_waiting_is_told(tmp_path):
    failed: Future[str] = Future()
    failed.set_exception(TimeoutError("of its own"))
    with pytest.raises(TimeoutError, match="of its own"):
        Checkpoint(tmp_path / "j", "x", 60.0, False, clock=Clock()).wait(failed, "compiling", lambda words: None)


def test_budget_in_evaluations(tmp_path):
    """Points that were evaluated before take none, of a batch only as many as are left; a gradient takes two each."""
    bowl = Bowl()
    asked = Objective(bowl, stable, Checkpoint(tmp_path / "j", "bowl", 1e9, False), lambda best, count: None, most=11)
    points = np.random.default_rng(0).random((6, 3))
    first = asked.costs(points[:3])
    np.testing.assert_array_equal(asked.costs(points[[2, 0, 2]]), first[[2, 0, 2]])
    assert asked.evaluations == 3
    asked.slope(points[0])
    assert asked.evaluations == 9
    found = asked.costs(points[2:])
    assert asked.evaluations == 11 and np.isfinite(found[:3]).all() and np.isinf(found[3])
    np.testing.assert_array_equal(asked.costs(points[:5]), np.append(first, found[1:3]))  # nothing new
    for ask in (lambda: asked.costs(points[5:]), lambda: asked.slope(points[0])):
        with pytest.raises(OutOfTime):
            ask()


def test_journal_of_something_else(tmp_path):
    with pytest.raises(BadInput, match="unfinished tuning"):
        Checkpoint(tmp_path / "j", "one", 1.0, resume=True)
    Checkpoint(tmp_path / "j", "one", 1.0, resume=False)
    with pytest.raises(BadInput, match="resume"):
        Checkpoint(tmp_path / "j", "one", 1.0, resume=False)
    with pytest.raises(BadInput, match="given with others"):
        Checkpoint(tmp_path / "j", "two", 1.0, resume=True)


def test_where_nothing_is_certified_the_worst_variant_is_named():
    given = Certificate((0.9, 1.25, 0.8), ("wu2018", "px4", "px4"))
    tried = {f"frequency {radius}": Certificate((radius,), ("wu2018",)) for radius in (1.07, 1.02, 1.05)}
    said = str(no_certificate(given, tried, 12))
    assert "none of 12 points is certified" in said and "1.25 on the plant variant px4" in said
    assert "the nearest point has 1.02, with frequency 1.02. Widen the ranges beyond this point" in said
    assert "variant wu2018 (3 of 4 times the least stable one)" in said
    assert "variant" not in str(no_certificate(Certificate((1.1,), ("",)), {}, 12))


def test_a_full_disk_costs_no_evaluation(tmp_path, monkeypatch):
    """The last line was cut off by a kill; leaving it out must not lose those before it."""
    objective(tmp_path, Bowl()).costs(np.linspace([0.0] * len(START), [1.0] * len(START), 5))
    file = tmp_path / "j"
    with file.open("a") as stream:
        stream.write('{"what": "co')
    before = file.read_bytes()

    def full(descriptor):
        raise OSError("No space left on device")

    monkeypatch.setattr(atomic_io.os, "fsync", full)
    with pytest.raises(OSError, match="No space"):
        objective(tmp_path, Bowl(), resume=True)
    assert file.read_bytes() == before
    monkeypatch.undo()
    objective(tmp_path, Bowl(), resume=True)
    assert file.read_bytes() == before[: before.rindex(b"\n") + 1]
