"""What holds a compiled program is not copied: a copy would go on with the numbers of the original, or with old ones."""

import copy
import functools
import pickle

import pytest

import undertow as ut
from undertow.core.errors import BadInput
from undertow.outside.gymnasium.env import make
from undertow.outside.gymnasium.vector_env import make_vec
from undertow.simulation.loop.stepped import CompiledStep

PENDULUM = {
    "plant": "inverted_pendulum",
    "reference": {"kind": "setpoint", "position": [0]},
    "loop": {"duration": 1.0, "dt": 0.01},
}


@pytest.fixture(scope="module", params=[make, functools.partial(make_vec, num_envs=2), ut.Autopilot])
def compiled(request):
    return request.param(PENDULUM)


@pytest.mark.full
@pytest.mark.parametrize("how", [copy.copy, copy.deepcopy, pickle.dumps])
def test_copying_is_refused_with_the_remedy(compiled, how):
    with pytest.raises(BadInput, match="must not be copied"):
        how(compiled)


def test_no_part_of_it_is_copied_either():
    with pytest.raises(BadInput, match="`CompiledStep` must not be copied"):
        copy.deepcopy({"inside": CompiledStep(lambda numbers, state, inputs: ((), inputs + numbers), 1.0, (), 2.0)})
