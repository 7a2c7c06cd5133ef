"""A result file says of itself whether it is as it was written: numbers, metrics, how it ended, units, scenario."""

import pytest
from good_scenario import SMALL

from undertow.scenario.provenance import checksum
from undertow.scenario.reading import parse, read
from undertow.scenario.results.netcdf import save
from undertow.scenario.results.repetition import compare
from undertow.scenario.results.run_scenario import run_scenario

pytestmark = pytest.mark.full


@pytest.fixture(scope="module")
def dataset(tmp_path_factory):
    return run_scenario(parse(SMALL, "s.yaml", tmp_path_factory.mktemp("none"), "SCENARIO")).dataset


@pytest.fixture
def written(dataset, tmp_path):
    """Write the result with a change, and with a checksum of before or after it."""

    def write(change, mended=False):
        copy = dataset.copy(deep=True)
        change(copy)
        if mended:
            copy.attrs["checksum"] = checksum(copy)
        save(copy, tmp_path / "changed.nc")
        return tmp_path / "changed.nc"

    return write


def better(dataset):
    dataset.attrs["metrics"] = dataset.attrs["metrics"].replace('"position_rms": ', '"position_rms": 1')


HARM = {
    "a number": lambda dataset: dataset["position"].values.__setitem__((3, 0), 1.0),
    "a metric": better,
    "metrics that are none": lambda dataset: dataset.attrs.update(metrics="{"),
    "how it ended": lambda dataset: dataset.attrs.update(status="diverged"),
    "when it ended": lambda dataset: dataset.attrs.update(ended=0.05),
    "a unit": lambda dataset: dataset["position"].attrs.update(units="ft"),
    "the scenario": lambda dataset: dataset.attrs.update(
        scenario=dataset.attrs["scenario"].replace("setpoint", "circle")
    ),
}


@pytest.mark.parametrize("harm", HARM)
def test_what_was_changed_is_refused(written, refused, harm):
    written(HARM[harm])
    said = refused("simulate", "changed.nc", "--out", "again")
    assert said.startswith("`changed.nc` must be ")
    assert ("its checksum does not hold" in said) == (harm != "metrics that are none")


def test_what_was_not_is_taken(written, dataset):
    assert read(written(lambda dataset: None)).data["seed"] == 3


def test_another_metric_is_a_difference_though_all_numbers_are_equal(written, dataset):
    """By somebody who has mended the checksum."""
    found = compare(written(better, mended=True), dataset)
    said = "with the same versions. Differences: metrics.steady.position_rms, metrics.whole.position_rms"
    assert not found.equal and not found.explained and found.sentence.endswith(said)


def test_torn_file_is_refused(written, refused):
    path = written(lambda dataset: None)
    whole = path.read_bytes()
    for size in (0, 7, 100, len(whole) // 2, len(whole) - 1):
        path.write_bytes(whole[:size])
        assert refused("simulate", "changed.nc").startswith("`changed.nc` must be a result file of undertow, but is ")
