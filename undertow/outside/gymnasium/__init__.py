"""Environments of Gymnasium made from scenarios: one vehicle, or thousands that are stepped as one program.

    from undertow.outside import gymnasium as ug
    env = ug.make("bluerov2_heavy.yaml")
    vector = ug.make_vec("bluerov2_heavy.yaml", 4096)

Importing this package registers `undertow/BlueROV2Heavy-v0` for `gymnasium.make` and `gymnasium.make_vec`, and
`undertow/Scenario-v0`, which takes `scenario=`.
"""

import importlib.util

if importlib.util.find_spec("gymnasium") is None:
    remedy = "In the folder of undertow, run: pip install -c constraints.txt '.[gym]'"
    raise ModuleNotFoundError(f"Gymnasium is not installed. {remedy}", name="gymnasium")

import gymnasium

from undertow.outside.gymnasium.env import Env as Env
from undertow.outside.gymnasium.env import make as make
from undertow.outside.gymnasium.episodes import QuadraticCost as QuadraticCost
from undertow.outside.gymnasium.stable_baselines import for_stable_baselines as for_stable_baselines
from undertow.outside.gymnasium.vector_env import VectorEnv as VectorEnv
from undertow.outside.gymnasium.vector_env import make_vec as make_vec

# Station keeping: from rest at a distance of up to some metres, in a current.
BLUEROV2_HEAVY = {
    "plant": {"vehicle": "bluerov2_heavy", "thruster": {"kind": "t200", "supply": 16.0}, "ledger": False},
    "reference": {"kind": "setpoint", "position": [2.0, 1.0, 1.0, 0.0, 0.0, 0.5]},
    "disturbance": {"kind": "current", "velocity": [0.2, 0.1, 0.0]},
    "loop": {"dt": 0.05, "duration": 20.0, "record": 0.05, "substeps": 5},
}

for name, options in (("BlueROV2Heavy", {"scenario": BLUEROV2_HEAVY}), ("Scenario", {})):
    gymnasium.register(
        f"undertow/{name}-v0",
        entry_point="undertow.outside.gymnasium.env:make",
        vector_entry_point="undertow.outside.gymnasium.vector_env:make_vec",
        kwargs=options,
    )
