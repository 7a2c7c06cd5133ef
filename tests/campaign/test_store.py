"""The store: what is flown once is kept, what is torn is flown again, and two do not write at once."""

import errno
import itertools
import re
import shutil
from functools import partial

import numpy as np
import pytest
import xarray as xr
import zarr
from command import contents

from undertow.core.errors import BadInput
from undertow.core.status import Status
from undertow.simulation.executors import in_threads
from undertow.studies.campaign.fingerprint import identity
from undertow.studies.campaign.prepare import prepare
from undertow.studies.campaign.run_campaign import STORE, run_campaign
from undertow.studies.campaign.store_results import load

quiet = lambda tally: None
threads = partial(in_threads, threads=2)


def ran(path, out, executor=threads, watch=quiet):
    run_campaign(prepare(path), out, executor, watch)
    return contents(out)


def nothing(function, work):
    """An executor that flies nothing."""
    return iter(())


def backwards(function, work):
    """An executor that takes the last task first."""
    for i in reversed(range(len(work))):
        yield i, function(*work[i])


@pytest.fixture(scope="module")
def campaign_folder(tmp_path_factory):
    """One for all tests, so that the campaign is compiled once."""
    return tmp_path_factory.mktemp("campaigns")


FLOWN = {}


@pytest.fixture
def flown(campaign_file, campaign_folder):
    """Runs a campaign that no test has run before; its file, its results and their bytes, not to be touched."""

    def fly(**changes):
        path, asked = campaign_file("flown", **changes), repr(changes)
        if asked not in FLOWN:
            out = campaign_folder / f"out-{len(FLOWN)}"
            FLOWN[asked] = out, ran(path, out)
        return path, *FLOWN[asked]

    return fly


@pytest.fixture
def small(campaign_file, flown, tmp_path):
    """A campaign, and the bytes of its results; a copy of them in a folder `whole`."""
    _, out, whole = flown()
    shutil.copytree(out, tmp_path / "whole")
    return campaign_file(), whole


@pytest.mark.full
def test_two_lines_of_xarray_open_it(small, tmp_path):
    results = xr.open_zarr(tmp_path / "whole" / STORE, consolidated=False)
    assert results["position_rms"].sizes == {"sample": 40}
    assert results["position_rms"].attrs["units"] == "m"
    assert (results["status"] == 0).all() and results["done"].all()
    words = dict(
        zip(results["status"].attrs["flag_values"], results["status"].attrs["flag_meanings"].split(), strict=True)
    )
    assert words == {-1: "invalid"} | {int(status): status.word for status in Status}
    amplitude = results["vary:disturbance.amplitude"]
    assert 0.5 < float(amplitude.min()) < float(amplitude.max()) < 2.0
    assert np.corrcoef(amplitude, results["position_rms"])[0, 1] > 0.99


@pytest.mark.full
def test_order_and_threads_do_not_matter(small, tmp_path):
    path, whole = small
    assert ran(path, tmp_path / "backwards", backwards) == whole
    assert ran(path, tmp_path / "one", partial(in_threads, threads=1)) == whole


@pytest.mark.full
def test_what_is_done_is_not_flown_again(small, tmp_path):
    path, whole = small

    def never(function, work):
        assert not work
        return iter(())

    assert ran(path, tmp_path / "whole", never) == whole


def stop_after(count):
    """An executor whose machine dies after some tasks."""

    def executor(function, work):
        for i, one in enumerate(work):
            if i == count:
                raise KeyboardInterrupt
            yield i, function(*one)

    return executor


@pytest.mark.parametrize("count", [*(pytest.param(one, marks=pytest.mark.full) for one in (0, 2)), 1])
def test_an_interrupted_campaign_ends_where_it_would_have(small, tmp_path, count):
    path, whole = small
    with pytest.raises(KeyboardInterrupt):
        ran(path, tmp_path / "cut", stop_after(count))
    assert ran(path, tmp_path / "cut") == whole


@pytest.mark.full
def test_a_chunk_that_was_torn_is_flown_again(small, tmp_path):
    path, whole = small
    torn = tmp_path / "whole" / STORE / "position_rms" / "c" / "1"
    torn.write_bytes(torn.read_bytes()[:-7])
    counted = []
    assert ran(path, tmp_path / "whole", watch=lambda tally: counted.append(tally.done)) == whole
    assert counted == [24, 40]


@pytest.mark.full
@pytest.mark.parametrize("name", ["position_rms", "status"])  # zeros, too
def test_a_chunk_that_is_gone_is_flown_again(small, tmp_path, name):
    path, whole = small
    (tmp_path / "whole" / STORE / name / "c" / "2").unlink()
    counted = []
    assert ran(path, tmp_path / "whole", watch=lambda tally: counted.append(tally.done)) == whole
    assert counted == [32, 40]


@pytest.mark.full
@pytest.mark.parametrize("harm", ["column", "its metadata", "flags", "coordinate"])
def test_what_is_missing_of_a_store_is_made_again(flown, tmp_path, harm):
    path, out, whole = flown(series={"signals": ["position"], "every": 0.5})
    store = shutil.copytree(out, tmp_path / "out") / STORE
    if harm == "its metadata":
        (store / "ended" / "zarr.json").write_text("")
    else:
        shutil.rmtree(store / {"column": "series:position", "flags": "done", "coordinate": "time"}[harm])
    assert ran(path, tmp_path / "out") == whole


@pytest.mark.full
def test_a_task_of_which_nothing_can_be_flown_is_done_once(campaign_file, tmp_path):
    """With series, too: their shape is that of the others."""
    vary = {"controller.frequency": {"choice": [-1.0, 2.0]}}
    asked = {"trials": 12, "seed": 5, "requirements": {}, "series": {"signals": ["position"], "every": 0.5}}
    path = campaign_file(chunk=1, vary=vary, **asked)
    whole, counted = ran(path, tmp_path / "out"), []
    assert ran(path, tmp_path / "out", watch=lambda tally: counted.append(tally.done)) == whole
    assert counted == [12]
    rows = xr.open_zarr(tmp_path / "out" / STORE, consolidated=False).load()
    invalid = rows["status"].values == -1
    assert 0 < invalid.sum() < 12
    assert (np.isnan(rows["series:position"].values).all(axis=(1, 2)) == invalid).all()


@pytest.mark.full
@pytest.mark.parametrize("at", [0, 3, 11, 30])
def test_a_full_disk_loses_nothing(small, tmp_path, monkeypatch, at):
    """Writing fails at some array of some task; what was done before stays, and the rest is flown later."""
    path, whole = small
    writes = iter(range(10**6))
    real = zarr.Array.__setitem__

    def full(array, key, value):
        if next(writes) == at:
            raise OSError(errno.ENOSPC, "No space left on device")
        real(array, key, value)

    monkeypatch.setattr(zarr.Array, "__setitem__", full)
    with pytest.raises(OSError, match="No space left"):
        ran(path, tmp_path / "full")
    monkeypatch.undo()
    assert zarr.Array.__setitem__ is real
    assert ran(path, tmp_path / "full") == whole


def test_another_campaign_is_refused(small, tmp_path, campaign_file):
    other = campaign_file("other", seed=8)
    with pytest.raises(BadInput, match=r"by the same versions, but is another one's: `seed` was 7, is 8 \("):
        ran(other, tmp_path / "whole")


@pytest.mark.parametrize("edited", [{"campaign": "trials: 2"}, {"campaign": "[1"}, {"campaign": 3}, {"chunk": None}])
def test_attributes_that_were_edited_are_an_error_of_one_line(small, tmp_path, edited):
    path, _ = small
    store = zarr.open_group(tmp_path / "whole" / STORE)
    store.attrs.update({"campaign_hash": "another"} | edited)
    with pytest.raises(BadInput, match="be the folder of the same campaign"):
        ran(path, tmp_path / "whole", nothing)


@pytest.mark.parametrize(
    "before, now, said",
    [
        (
            {},
            {"vary": {"disturbance.amplitude": {"uniform": [0.5, 3.0]}}},
            "`vary.disturbance.amplitude.uniform[1]` was 2, is 3",
        ),
        pytest.param(
            {},
            {"series": {}},
            "`series` was not given, is {'signals': ['position', 'error'], 'every': 1.0}",
            marks=pytest.mark.full,
        ),
        pytest.param(
            {},
            {"trials": 80, "requirements": {}, "design": "latin"},
            "`design` was random, is latin",
            marks=pytest.mark.full,
        ),
        pytest.param({}, {"trials": 39}, "`trials` was 40, is 39", marks=pytest.mark.full),
        pytest.param(
            {"design": "latin"}, {"design": "latin", "trials": 41}, "`trials` was 40, is 41", marks=pytest.mark.full
        ),
        pytest.param(
            {"cross": {"controller.frequency": [1.0, 2.0]}},
            {"cross": {"controller.frequency": [2.0, 1.0]}},
            "`order of cross.controller.frequency` was 1.0, 2.0, is 2.0, 1.0",
            marks=pytest.mark.full,
        ),
    ],
)
def test_what_differs_is_named(campaign_file, tmp_path, before, now, said):
    """Of a Latin hypercube every point depends on how many there are, and the numbers of trials on some orders."""
    one, other = (
        identity(asked.text, asked.named) for asked in (prepare(campaign_file(**each)) for each in (before, now))
    )
    with pytest.raises(BadInput, match=re.escape(f"another one's: {said} (")):
        other.check_same({**one.attributes, "campaign": one.asked}, tmp_path)


@pytest.mark.full
def test_spelling_makes_no_other_campaign(campaign, campaign_file, small, tmp_path):
    """Neither 2 for 2.0 nor the order of the scenario's keys."""
    scenario = campaign()["scenario"]
    scenario["controller"]["frequency"] = 2
    other = campaign_file("other", scenario=dict(reversed(scenario.items())), trials=44)
    assert ran(other, tmp_path / "whole") == ran(other, tmp_path / "at once")


GROWING = {"cross": {"controller.frequency": [2.0, 3.0]}, "series": {"signals": ["position"], "every": 0.5}}


@pytest.mark.full
@pytest.mark.parametrize(
    ("design", "changes", "before"),  # also where not even the first few samples are there
    [
        pytest.param(*one, marks=() if one in (("sobol", {}, 40),) else pytest.mark.slow)
        for one in itertools.product(("random", "sobol"), ({}, GROWING), (1, 40))
    ],
)
def test_further_trials_are_flown_beside_those_that_are_there(campaign_file, tmp_path, design, changes, before):
    """The store is the same to the byte as if all had been asked for at first; only their tasks are flown."""
    chunk, after, kept = {1: (1, 7, 1), 40: (16, 70, 32)}[before]
    asked = lambda trials: campaign_file(trials=trials, design=design, chunk=chunk, **changes)
    combinations, counted = 2 if changes else 1, []
    ran(asked(before), tmp_path / "out")
    grown = ran(asked(after), tmp_path / "out", watch=lambda tally: counted.append(tally.done))
    assert counted[0] == kept * combinations and counted[-1] == after * combinations
    assert grown == ran(asked(after), tmp_path / "at once")


@pytest.mark.full
@pytest.mark.parametrize(
    "kind, name, at",
    [
        pytest.param(zarr.Array, "__setitem__", 0, marks=pytest.mark.slow),
        pytest.param(zarr.Array, "__setitem__", 1, marks=pytest.mark.slow),
        (zarr.Array, "resize", 0),
        (zarr.Array, "resize", 9),
        (zarr.Group, "update_attributes", 0),
    ],
)
def test_a_growth_that_is_cut_short_loses_nothing(campaign_file, flown, tmp_path, monkeypatch, kind, name, at):
    """Among the flags of tasks that get more trials, among the arrays, before it is said that there are more trials."""
    _, _, at_once = flown(trials=70, **GROWING)
    path, before, whole = flown(**GROWING)
    more, out = campaign_file("more", trials=70, **GROWING), shutil.copytree(before, tmp_path / "out")
    real, steps = getattr(kind, name), iter(range(at))

    def cut(*given):
        if next(steps, None) is None:
            raise KeyboardInterrupt
        return real(*given)

    monkeypatch.setattr(kind, name, cut)
    with pytest.raises(KeyboardInterrupt):
        ran(more, out, nothing)
    monkeypatch.undo()
    results = load(out)
    assert results.total == 80 and 64 <= results.rows.sizes["trial"] <= 80
    assert np.isfinite(results.rows["position_rms"]).all()
    assert ran(path, out) == whole  # nobody has been told of more
    assert ran(more, out) == at_once


@pytest.mark.full
def test_the_size_of_tasks_may_change_on_the_way(small, tmp_path, campaign_file):
    path, whole = small
    with pytest.raises(KeyboardInterrupt):
        ran(path, tmp_path / "cut", stop_after(1))
    assert ran(campaign_file("other", chunk=5), tmp_path / "cut") == whole


@pytest.mark.full
def test_two_do_not_write_at_once(small, tmp_path):
    path, _ = small

    def during(function, work):
        with pytest.raises(BadInput, match="nothing else writes to"):
            ran(path, tmp_path / "two")
        return threads(function, work)

    ran(path, tmp_path / "two", during)


@pytest.mark.full
def test_a_row_is_less_than_a_kilobyte(campaign_file, tmp_path):
    whole = ran(campaign_file(trials=500, chunk=250), tmp_path / "large")
    assert sum(map(len, whole.values())) / 500 < 300


@pytest.mark.full
def test_what_a_killed_process_left_is_cleared_away(small, tmp_path):
    path, whole = small
    ran(path, tmp_path / "again")
    left = next((tmp_path / "again" / STORE).rglob("c")) / "0.0123456789abcdef.partial"
    left.write_bytes(b"half")
    assert ran(path, tmp_path / "again") == whole


@pytest.mark.full
@pytest.mark.parametrize("content", [b"", b"\xff\x00junk"])
def test_a_torn_flag_is_no_flag(small, tmp_path, content):
    """As a power cut leaves it: the task is done again, the status of the campaign can be told all the while."""
    path, whole = small
    (tmp_path / "whole" / STORE / "done" / "c" / "1").write_bytes(content)
    assert load(tmp_path / "whole").rows.sizes["trial"] == 24
    counted = []
    assert ran(path, tmp_path / "whole", watch=lambda tally: counted.append(tally.done)) == whole
    assert counted == [24, 40]


EDITS = {
    "codecs": ('"endian": "little"', '"endian": "big"'),
    "attributes": ('"units": "m"', '"units": "ft, rad"'),
    "data_type": ('"data_type": "float64"', '"data_type": "int64"'),
    "fill_value": ('"fill_value": "NaN"', '"fill_value": 0.0'),
    "chunk_grid": ('"chunk_shape": [\n        16', '"chunk_shape": [\n        8'),
    "dimension_names": ('"sample"\n', '"drew"\n'),
    "attributes ": ('"units":', '"scale_factor": 2.0, "units":'),
}


@pytest.mark.full
@pytest.mark.parametrize("key", EDITS)
def test_metadata_that_were_edited_are_told(small, tmp_path, key):
    """With others the same chunks are other numbers. Nothing is read, and nothing flown, until they are put back."""
    path, whole = small
    file = tmp_path / "whole" / STORE / "position_rms" / "zarr.json"
    before = file.read_text()
    old, new = EDITS[key]
    assert old in before
    edited = before.replace(old, new).replace('"NaN"', "0") if key == "data_type" else before.replace(old, new)
    file.write_text(edited)
    said = re.escape(f"{file} with another {key.strip()}")
    for attempt in (lambda: load(tmp_path / "whole"), lambda: ran(path, tmp_path / "whole", nothing)):
        with pytest.raises(BadInput, match=f"must hold a store as it was written, but is {said}"):
            attempt()
    file.write_text(before)
    assert ran(path, tmp_path / "whole", nothing) == whole
