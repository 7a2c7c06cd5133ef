"""Sensitivity to what the seeds determine: a made-up campaign whose errors a realized bias causes."""

import json

import numpy as np
import pytest

from undertow.cli.main import run
from undertow.core.numerics.random_keys import key_of_seed
from undertow.scenario.part_cache import PartCache
from undertow.studies.campaign.build_trials import build_trial
from undertow.studies.campaign.prepare import prepare
from undertow.studies.campaign.random_scalars import realized_scalars

pytestmark = pytest.mark.full

PUSH = """
import jax
from jaxtyping import Float

from undertow.core.contracts import AbstractDisturbance
from undertow.core.param import Param, param


class Push(AbstractDisturbance):
    deviation: Float[Param, ""] = param("m/s^2", "of the bias")

    def realize(self, key):
        bias, unused, series = jax.random.split(key, 3)
        draw = jax.random.normal
        found = {"bias": self.deviation * draw(bias), "unused": draw(unused, (2,)), "series": draw(series, (40,))}
        return found | {"share": 0.5, "typed": jax.random.key(1)}

    def at(self, realization, t, pose, load):
        return load._replace(acceleration=load.acceleration + realization["bias"])

    def jumps(self, duration):
        return ()


def push(deviation: float = 1.0):
    return Push(deviation)
"""


def pushed(campaign_file, folder, **changes):
    (folder / "push.py").write_text(PUSH, encoding="utf-8")
    scenario = {
        "plant": {"kind": "double_integrator", "axes": 1, "limit": 20.0},
        "controller": {"kind": "pid", "frequency": 2.0},
        "reference": {"kind": "setpoint", "position": [0.0]},
        "disturbance": {"kind": "./push.py:push"},
        "loop": {"duration": 2.0, "dt": 0.02, "record": 0.1},
    }
    vary = {"disturbance.deviation": {"uniform": [0.9, 1.1]}}
    return campaign_file(scenario=scenario, vary=vary, requirements={}, **changes)


def test_a_realized_bias_that_causes_the_error_is_found(
    campaign_file, campaign_folder, tmp_path, whole_figures, capsys
):
    path, out = pushed(campaign_file, campaign_folder), tmp_path / "out"
    assert run(["campaign", str(path), "--out", str(out)]) == 0
    found = json.loads((out / "summary.json").read_text())["sensitivity"]
    names = list(found)
    assert names[:2] == ["disturbance.deviation", "|disturbance.bias| (push)"]
    assert "disturbance.bias (push)" in names and "disturbance.unused[1] (push)" in names
    assert not any("series" in name for name in names), "a process is no scalar"
    assert found[names[1]]["position_rms"] > 0.98
    assert abs(found["disturbance.bias (push)"]["position_rms"]) < 0.5
    assert abs(found["disturbance.unused[0] (push)"]["position_rms"]) < 0.5
    assert "scalars that the seed of a trial determines" in (out / "campaign.html").read_text()


def test_the_scalars_are_those_of_the_runs(campaign_file, campaign_folder):
    several = prepare(pushed(campaign_file, campaign_folder, name="again"), False).trials
    rows = [0, 1, 2, 5]
    found = realized_scalars(several, rows)["disturbance.bias (push)"]
    for value, row in zip(found, rows, strict=True):
        built = build_trial(several, PartCache(), row)
        realization = built.closed_loop.realize(key_of_seed(built.scenario.seed))
        np.testing.assert_allclose(value, realization.disturbance_realization["bias"], rtol=1e-6)
    assert realized_scalars(several, []) == {}


def test_noise_alone_is_no_scalar(campaign_file):
    several = prepare(campaign_file(name="noise"), False).trials
    assert realized_scalars(several, range(8)) == {}


def test_random_faults_are_scalars_of_their_entries(campaign_file):
    """By the place of the entry in the scenario, whatever the order in which the loop has them."""
    scenario = {
        "plant": {"kind": "double_integrator", "axes": 2, "limit": 20.0},
        "controller": {"kind": "pid", "frequency": 2.0},
        "reference": {"kind": "setpoint", "position": [0.0, 0.0]},
        "faults": [
            {"target": "input", "number": "random", "mode": "scale", "severity": 0.5},
            {"target": "position", "mode": "bias", "severity": 0.1, "onset": [0.5, 1.0]},
        ],
        "loop": {"duration": 2.0, "dt": 0.02, "record": 0.1},
    }
    several = prepare(campaign_file(scenario=scenario, vary={}, requirements={}, name="faults"), False).trials
    scalars = realized_scalars(several, range(8))
    affected = ["faults[0].affected[0] (scale)", "faults[0].affected[1] (scale)"]
    assert set(scalars) == {*affected, "faults[1].onset (bias)"}
    np.testing.assert_array_equal(scalars[affected[0]] + scalars[affected[1]], 1.0)
    onsets = scalars["faults[1].onset (bias)"]
    assert (onsets >= 0.5).all() and (onsets <= 1.0).all() and len(set(onsets)) == 8
