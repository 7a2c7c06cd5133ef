"""The next experiment: information of blocks against finite differences, the choice, and the rehearsal in its room."""

import jax.numpy as jnp
import numpy as np
import pytest

from undertow.core.errors import BadInput
from undertow.core.runtime import in_precision
from undertow.report.answers.design_answer import answer_of_design
from undertow.report.experiment_page import write_design
from undertow.report.figures.experiment import rehearsal_figure
from undertow.scenario.build import build
from undertow.scenario.scenario_vehicle import vehicle_of
from undertow.studies.identification.block_choice import greedy_choice, least_shares, loss, shares_left
from undertow.studies.identification.design import STEP, design
from undertow.studies.identification.design_data import design_data
from undertow.studies.identification.design_result import DesignRequest
from undertow.studies.identification.dive import SENSOR_OF_RESIDUAL
from undertow.studies.identification.dive_information import information_of
from undertow.studies.identification.excitation_blocks import BLOCK, HELD, candidates, script
from undertow.studies.identification.experiment_scenario import LEAD, experiment_scenario, station_of
from undertow.studies.identification.free_parameters import chosen, parameters_of
from undertow.studies.identification.identified_vehicle import prior_vehicle
from undertow.studies.identification.model import Unknowns, all_residuals, model_of
from undertow.studies.identification.rehearsal import rehearse, with_vehicle
from undertow.studies.identification.segments import segments_of

NOISE = [0.02, 0.02, 0.02, 0.01, 0.01, 0.01]
FREE = ("added_mass.surge", "quadratic_damping.surge", "lag")
SCENARIO = {
    "plant": {"vehicle": "bluerov2_heavy", "thruster": {"kind": "t200", "supply": 16}},
    "controller": "pid",
    "reference": {"kind": "setpoint", "position": [1, 0, 0, 0, 0, 0.4]},
    "navigation": {"kind": "white_noise", "position": NOISE, "velocity": NOISE},
    "loop": {"dt": 0.05, "duration": 1, "record": 0.05},
}
ROOM = (3.0, 3.0, 2.0)


@pytest.fixture(scope="module")
def built():
    return build(SCENARIO)


@pytest.fixture(scope="module")
def information():
    """Of random candidates about four unknowns, some of which tell of one or two alone."""
    generator = np.random.default_rng(1)
    directions = generator.standard_normal((30, 4, 2)) * generator.choice([0.1, 1.0, 3.0], (30, 4, 1))
    return directions @ directions.transpose(0, 2, 1)


def test_scripts_hold_blocks_and_end_at_rest():
    blocks = candidates(np.array([100.0, 100.0, 80.0, 20.0, 0.0, 10.0]), ("a", "b", "c", "d", "e", "f"))
    rows = script(blocks[:3], lead=2.0, pause=10.0)
    assert (np.diff(rows[:, 0]) > 0).all()
    assert rows[-1].tolist() == [62.0, *np.zeros(6)]
    for number, block in enumerate(blocks[:3]):
        for time in (0.0, 3.3, 9.9):
            row = np.searchsorted(rows[:, 0], 2.0 + 20 * number + time + 1e-6, side="right") - 1
            np.testing.assert_allclose(rows[row, 1:], block.wrenches[round(time / HELD)], atol=1e-6)
    assert not any(block.wrenches[:, 4].any() for block in blocks)  # along an axis without thrusters
    assert all(len(block.wrenches) == round(BLOCK / HELD) for block in blocks)


def test_deviations_left_of_a_diagonal_information():
    np.testing.assert_allclose(shares_left(np.diag([3.0, 0.0, 99.0]), [0, 2]), [0.5, 0.1])


def test_choice_is_never_worse_than_random_ones(information):
    of_interest, slots = [0, 1, 3], 6
    can = least_shares(information, of_interest, slots) < 0.5
    chosen_loss = loss(information[greedy_choice(information, of_interest, slots)].sum(axis=0), of_interest, can)
    generator = np.random.default_rng(2)
    for _ in range(300):
        others = generator.integers(len(information), size=slots)
        assert chosen_loss <= loss(information[others].sum(axis=0), of_interest, can) + 1e-12


def test_choice_is_for_what_is_of_interest():
    """Two candidates, each of which tells of one unknown."""
    each = np.stack([np.diag([4.0, 0.0]), np.diag([0.0, 4.0])])
    assert greedy_choice(each, [0], 5) == [0] * 5
    assert sorted(greedy_choice(each, [0, 1], 4)) == [0, 0, 1, 1]


@pytest.mark.full
def test_information_is_that_of_finite_differences(built):
    """Also by the begin of each segment, which is eliminated: Schur's complement of the whole information."""
    with in_precision("float64"):
        plant = vehicle_of(built)
        parameters = chosen(parameters_of(plant), FREE)
        model, count = model_of(prior_vehicle(plant), parameters), len(Unknowns(tuple(parameters), 1).all())
        block = next(b for b in candidates(np.full(6, 20.0), "abcdef") if b.form == "telegraph" and b.size == 0.2)
        station = station_of(built, ROOM, None)
        simulated = rehearse(build(experiment_scenario(built, script([block], LEAD), station)), station, STEP).dive
        found = information_of(model, np.zeros(count), simulated, BLOCK)[1]
        segments = segments_of([simulated.dive], BLOCK)
        counts = segments.counts[1][:, SENSOR_OF_RESIDUAL]
        weights = np.where(counts > 0, counts / simulated.noise**2, 0.0).reshape(-1)

        def residuals(unknowns):
            both = jnp.asarray(unknowns)
            return np.asarray(
                all_residuals(
                    model, both[:count], jnp.broadcast_to(both[count:], (len(segments.dive), 12)), segments, STEP
                )
            )[1].reshape(-1)

        steps = 1e-4 * np.eye(count + 12)
        derivative = np.stack([(residuals(step) - residuals(-step)) / 2e-4 for step in steps], axis=1)
        whole = derivative.T @ (weights[:, None] * derivative)
        a, b, c = whole[:count, :count], whole[:count, count:], whole[count:, count:] + np.eye(12)
        expected = a - b @ np.linalg.solve(c, b.T)
    np.testing.assert_allclose(found, expected, rtol=1e-4, atol=1e-5 * np.abs(expected).max())
    np.testing.assert_allclose(simulated.noise[:3], 0.02, rtol=0.2)


@pytest.fixture(scope="module")
def designed(built):
    with in_precision("float64"):
        return design(built, DesignRequest(ROOM, 74.0, free=FREE))


@pytest.mark.full
def test_page_has_the_rehearsal_and_every_number(designed, tmp_path):
    data = design_data(designed)
    assert write_design("rov", designed, data, tmp_path, tmp_path) == []
    page = (tmp_path / "experiment.html").read_text("utf-8")
    assert answer_of_design(data, tmp_path).verdict in page
    numbers, _, script = page.partition('id="script"')
    for parameter in data["parameters"].values():
        assert f">{100 * parameter['deviation_left']:.0f} %<" in numbers
    assert script.count("<tr>") == 1 + len(designed.blocks) + 1 + 5  # with two heads, and five limits
    assert {path.name for path in (tmp_path / "figures").glob("*.svg")} == {"rehearsal.svg", "deviations.svg"}


def test_figure_of_the_rehearsal_has_the_limits_of_the_room():
    time = np.linspace(0.0, 10.0, 11)
    panels = rehearsal_figure(time, np.column_stack([0.1 * time, -0.1 * time, 0 * time]), ROOM).axes
    for panel, length, last in zip(panels, ROOM, (1.0, -1.0, 0.0), strict=True):
        way, low, high = panel.get_lines()
        assert way.get_ydata()[-1] == pytest.approx(last)
        assert (low.get_ydata()[0], high.get_ydata()[0]) == (-length / 2, length / 2)


@pytest.mark.full
def test_experiment_keeps_its_room_and_lowers_the_deviations(built, designed):
    """A minute, rehearsed anew from the scenario that is written, also with another vehicle."""
    with in_precision("float64"):
        assert len(designed.blocks) == 6
        assert all(expected.share < 0.5 for expected in designed.expected)
        assert max(designed.use) < 1
        station = designed.scenario["reference"]["position"]
        assert station[2] == ROOM[2] / 2 + 0.5  # where the reference is at the surface
        scenario = {key: value for key, value in designed.scenario.items() if key != "supervisor"}
        z = np.concatenate([[0.2, -0.2, 0.2], np.zeros(5)])
        again = rehearse(with_vehicle(build(scenario), designed.model, z), station, STEP)
        assert again.abort == 0
        assert (np.abs(again.away) < np.array(ROOM) / 2).all()
        assert np.ptp(again.away[:, 0]) > 0.3  # it moves
        narrow = rehearse(
            build(scenario | {"controller": scenario["controller"] | {"room": [0.1, 3, 2]}}), station, STEP
        )
        assert narrow.abort == 1
        assert np.abs(narrow.away[-20:, 0]).max() < 0.3  # it is back


@pytest.mark.parametrize(
    ("request_", "words"),
    [
        (DesignRequest((3.0, 0.0, 2.0)), "room"),
        (DesignRequest(ROOM, duration=23.0), "duration"),
        (DesignRequest(ROOM, max_rate=-1.0), "max_rate"),
        (DesignRequest(ROOM, of_interest=("added_mas.surge",)), "added_mass.surge"),
    ],
)
def test_requests_that_cannot_be_met(built, request_, words):
    with pytest.raises(BadInput, match=words):
        design(built, request_)
