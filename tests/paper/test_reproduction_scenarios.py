"""Scenarios of the reproduction, of which a quick one runs a part."""

import pytest

from undertow.paper import claims, horizons, lag_map
from undertow.paper.robust_variant import fidelity
from undertow.scenario.build import build
from undertow.scenario.part_cache import PartCache


@pytest.mark.slow
def test_what_only_the_full_reproduction_runs_can_be_built():
    """A `BadInput` would come after ten minutes of it."""
    sources = (fidelity.scenarios, claims.scenarios, claims.batched, horizons.scenarios, lag_map.scenarios)
    quick, full = ({name: one for of in sources for name, one in of(quick).items()} for quick in (True, False))
    further, cache = {name: full[name] for name in full.keys() - quick.keys()}, PartCache()
    assert {"robust_variant_station_pid", "robust_variant_station_robust"} <= set(further)
    for name, scenario in further.items():
        assert build(scenario, cache).scenario.loop.duration > 0, name
