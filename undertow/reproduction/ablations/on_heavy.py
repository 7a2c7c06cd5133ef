"""BlueROV2 Heavy with T200s at 16 V, at 100 Hz: for water, references and what else needs a real vehicle."""

from collections.abc import Sequence

from undertow.controllers.presets.paper import paper
from undertow.controllers.presets.robust import robust
from undertow.core.contracts import Model
from undertow.disturbances.adding import Together
from undertow.disturbances.gauss_markov_current import gauss_markov_current
from undertow.disturbances.tether import tether
from undertow.disturbances.waves import waves
from undertow.loop.closed_loop import ClosedLoop
from undertow.plants.hybrid_vehicle import hybrid_vehicle
from undertow.references.sine import sine
from undertow.reproduction.ablations.ablation import Schedule
from undertow.reproduction.ablations.on_axes import Law
from undertow.reproduction.ablations.rough_sensor import RoughSensor
from undertow.reproduction.setup import HAND_TUNED
from undertow.thrusters.t200 import t200
from undertow.vehicles.bluerov2_heavy import bluerov2_heavy

SCHEDULE = Schedule(duration=40.0, dt=0.01)

_NOISE = 2e-3  # m/s, rad/s

# Too little to matter, where a number must be positive.
_HARDLY = 1e-9


def hand_tuned(model: Model):
    """The paper's law with gains found by hand."""
    return paper(model, **HAND_TUNED)


def sound(model: Model):
    """Preset `robust`, no gain given."""
    return robust(model, sampling_time=SCHEDULE.dt)


def loop(
    law: Law,
    *,
    current: float = 0.0,
    height: float = 0.0,
    cable: float = 0.0,
    swing: Sequence[float] = (0.0,) * 6,
    rate: float = 0.5,
    middle: Sequence[float] = (0.0,) * 6,
    **model,
) -> ClosedLoop:
    """A law at sea.

    Args:
        law: from a model to a controller.
        current: mean north and deviation of it, m/s.
        height: significant wave height, m; period 5 s.
        cable: drag of 20 m of tether, N per m and (m/s)^2.
        swing: amplitude of the reference, m and rad.
        rate: its frequency, rad/s.
        middle: about which it swings, m and rad.
        model: what the law is told, such as `rate_term`.
    """
    plant = hybrid_vehicle(bluerov2_heavy(), t200(supply=16.0), ledger=False)
    water = (
        gauss_markov_current((current, 0.0, 0.0), (current / 3, current / 3, 0.0), 20.0, span=60.0),
        waves(height=max(height, _HARDLY), components=12),
        tether(stiffness=_HARDLY if cable == 0 else 200.0, drag=cable),
    )
    reference = sine(list(swing), rate, list(middle))
    sensor = RoughSensor(noise=_NOISE, position_noise=_NOISE)
    return ClosedLoop(plant, law(plant.model(**model)), reference, Together(water), sensor)
