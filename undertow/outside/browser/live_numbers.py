"""Numbers of a scenario that somebody changes while it runs: sliders, and switches of what begins at a time.

Every position of a slider and every fault is a scenario, too. Its numbers are those arrays of the closed loop in which
the two scenarios differ, so that rules are kept: a wave height changes amplitudes, a bandwidth all gains that follow.
"""

import copy
from collections.abc import Mapping
from typing import Any, NamedTuple

import equinox as eqx
import jax
import numpy as np

from undertow.core.arrays import in_present_precision
from undertow.core.errors import BadInput
from undertow.core.numerics.random_keys import key_of_seed
from undertow.scenario.build import Built, build
from undertow.scenario.changed_values import put_value
from undertow.scenario.reading import Text
from undertow.simulation.loop.simd_batch import realized_disturbance
from undertow.studies.tuning.problem import gains_in_force

NEVER = 1e9  # s, the time of what does not happen


class Slider(NamedTuple):
    """A number of the scenario that a visitor changes.

    Attributes:
        label: for the page.
        unit: of the values.
        shown: value of each position, as the page writes it.
        base: position of the scenario as it is.
        of_law: whether it is a gain of the controller; others are of water and payload.
        tables: number of an array of the loop -> the array at each position.
    """

    label: str
    unit: str
    shown: list[float]
    base: int
    of_law: bool
    tables: dict[int, list[np.ndarray]]


class Switch(NamedTuple):
    """Something that begins at a time, an array of the loop that is `NEVER` until then.

    Attributes:
        label: for the page.
        leaf: number of the array.
        thruster: of a thruster, from 0; None for the payload.
    """

    label: str
    leaf: int
    thruster: int | None


class _Change(NamedTuple):
    """A slider before it is known which arrays it changes: the key of the scenario, and its value at each position."""

    label: str
    unit: str
    key: str
    values: list[Any]
    shown: list[float]
    base: int
    of_law: bool = False


class LiveNumbers(NamedTuple):
    """What may change while a scenario runs.

    Attributes:
        built: the scenario with the parts that begin later.
        base: arrays of its loop, and behind them those that its seed realizes of the disturbance.
        sliders, switches: what a visitor changes.
    """

    built: Built
    base: list[np.ndarray]
    sliders: list[Slider]
    switches: list[Switch]

    def leaves(self) -> list[int]:
        """Numbers of the arrays that change, in their order."""
        of_sliders = {leaf for slider in self.sliders for leaf in slider.tables}
        return sorted(of_sliders | {switch.leaf for switch in self.switches})


def live_numbers(text: Text, thrusters: int) -> LiveNumbers:
    """The sliders and switches of a scenario of a vehicle with so many thrusters, in the present precision."""
    text, keys = _with_switches(text, thrusters)
    built = build(text)
    base = _numbers_of(built)
    switches = []
    for number, key in enumerate(keys):
        is_thruster = number < thrusters
        label = f"thruster {number + 1}" if is_thruster else "payload"
        switches.append(Switch(label, _leaf_of(text, key, base), number if is_thruster else None))
    sliders: list[Slider] = []
    taken: set[int] = set()
    for change in _changes(text, built):
        tables = _tables(text, change, base)
        if tables is not None and not taken & set(tables):
            sliders.append(Slider(change.label, change.unit, change.shown, change.base, change.of_law, tables))
            taken |= set(tables)
    return LiveNumbers(built, base, sliders, switches)


def _with_switches(text: Text, thrusters: int) -> tuple[Text, list[str]]:
    """The scenario with parts that begin at `NEVER`, and the key of the time of each, the payload's last."""
    faults = list(text.data.get("faults") or [])
    given = text.data.get("disturbance") or []
    loads = list(given) if isinstance(given, list) else [given]
    keys = []
    for number in range(thrusters):
        keys.append(f"faults.{len(faults)}.onset")
        faults.append({"target": f"thruster {number + 1}", "mode": "off", "onset": NEVER})
    keys.append(f"disturbance.{len(loads)}.start")
    loads.append(_payload(_PAYLOADS[_PAYLOAD]))
    return text._replace(data=text.data | {"faults": faults, "disturbance": loads}), keys


_PAYLOADS, _PAYLOAD = (0.5, 1.0, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0), 3  # kg, and which at first
_WEIGHT = 6.0  # N/kg in water, of stone


def _payload(mass: float) -> dict[str, Any]:
    return {"kind": "payload", "mass": mass, "weight": _WEIGHT * mass, "start": NEVER, "stop": 2 * NEVER}


def _numbers_of(built: Built) -> list[np.ndarray]:
    """The arrays of the loop, and behind them those that its seed realizes of the disturbance.

    The latter are made as a simulation makes them, because the C code would round them in another way.
    """
    loop = in_present_precision(built.closed_loop).starting_at(built.scenario.initial.position)
    random = realized_disturbance(loop, key_of_seed(built.scenario.seed))
    return [np.asarray(leaf) for leaf in (*jax.tree.leaves(eqx.filter(loop, eqx.is_array)), *jax.tree.leaves(random))]


def _changed(text: Text, key: str, value: Any) -> list[np.ndarray]:
    """Numbers of the scenario with another value."""
    data = copy.deepcopy(text.data)
    put_value(data, key, value)
    return _numbers_of(build(text._replace(data=data)))


def _leaf_of(text: Text, key: str, base: list[np.ndarray]) -> int:
    """The array of the loop that holds a time of the scenario."""
    other = _changed(text, key, NEVER / 2)
    (leaf,) = (i for i, (one, two) in enumerate(zip(base, other, strict=True)) if not np.array_equal(one, two))
    return leaf


_OF_SEA = (0.0, 0.25, 0.5, 0.75, 1.0, 1.25, 1.5, 1.75, 2.0)  # multiples of the scenario's current and wave height
_OF_GAIN = (0.5, 0.6, 0.7, 0.8, 0.9, 1.0, 1.1, 1.2, 1.3)
_NO_WAVE = 0.01  # of the scenario's height: zero is no wave


def _changes(text: Text, built: Built) -> list[_Change]:
    """Sea state, payload and gain, where the scenario has them."""
    changes = []
    loads = text.data["disturbance"]
    for number, part in enumerate(loads[:-1]):
        kind = part.get("kind") if isinstance(part, Mapping) else None
        if kind == "current" and "velocity" in part:
            values = _multiples(part["velocity"], _OF_SEA)
            shown = [float(np.linalg.norm(value)) for value in values]
            changes.append(_Change("current", "m/s", f"disturbance.{number}.velocity", values, shown, 4))
        if kind == "waves" and "height" in part:
            values = _multiples(part["height"], (_NO_WAVE, *_OF_SEA[1:]))
            changes.append(_Change("wave height", "m", f"disturbance.{number}.height", values, values, 4))
    payloads = [_payload(mass) for mass in _PAYLOADS]
    changes.append(_Change("payload", "kg", f"disturbance.{len(loads) - 1}", payloads, list(_PAYLOADS), _PAYLOAD))
    for key in ("bandwidth", "frequency"):
        bandwidth = _gain(built, key)
        if bandwidth is not None:
            values = _multiples(bandwidth, _OF_GAIN)
            shown = [float(np.max(value)) for value in values]
            label = f"{key} of the controller"
            changes.append(_Change(label, "rad/s", f"controller.{key}", values, shown, 5, of_law=True))
    return changes


def _multiples(value: Any, factors: tuple[float, ...]) -> list[Any]:
    return [(np.asarray(value, dtype=float) * factor).tolist() for factor in factors]


def _gain(built: Built, key: str) -> Any:
    """A gain of the law, as the scenario gives it or as its rule chose it; None for a law that has or keeps none."""
    options = built.resolved["controller"]
    if options.get(key) is not None:
        return options[key]
    gains = gains_in_force(built, key) if key in options else None
    return None if gains is None else gains.tolist()


def _tables(text: Text, change: _Change, base: list[np.ndarray]) -> dict[int, list[np.ndarray]] | None:
    """Arrays that a slider decides, at each position; None where one gives no loop, or one of another structure."""
    positions = []
    for number, value in enumerate(change.values):
        try:
            arrays = base if number == change.base else _changed(text, change.key, value)
        except BadInput:
            return None
        if [leaf.shape for leaf in arrays] != [leaf.shape for leaf in base]:
            return None
        positions.append(arrays)
    changed = [i for i, leaf in enumerate(base) if any(not np.array_equal(at[i], leaf) for at in positions)]
    return {i: [at[i] for at in positions] for i in changed}
