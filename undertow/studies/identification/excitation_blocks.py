"""Candidates of an experiment: ten seconds of forces along some axes of a vehicle, in several forms and sizes."""

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

BLOCK = 10.0  # s; the length of the segments of an identification, whose information adds up
HELD = 0.1  # s for which a force is held at least

_STEPS = round(BLOCK / HELD)
# Shares of the largest force of the thrusters along an axis; what leaves the room is not used.
_SIZES = (0.03, 0.08, 0.2, 0.45)
_LINES = 8  # sines of a multisine
_LOWEST, _HIGHEST = 0.1, 1.2  # Hz
_GROUPS = {"horizontal": (0, 1, 5), "rotation": (3, 4, 5), "translation": (0, 1, 2), "all axes": (0, 1, 2, 3, 4, 5)}


class ExcitationBlock(NamedTuple):
    """A candidate.

    Attributes:
        form: telegraph, slow telegraph, multisine, steps or decay.
        axes: numbers of the axes, 0 for surge to 5 for yaw.
        where: these axes in words.
        size: share of the largest force.
        wrenches: force and moment, N and N m, each held for 0.1 s, (100, 6).
    """

    form: str
    axes: tuple[int, ...]
    where: str
    size: float
    wrenches: np.ndarray


def candidates(largest: np.ndarray, axis_names: Sequence[str], seed: int = 0) -> list[ExcitationBlock]:
    """Candidates for a vehicle.

    Args:
        largest: force and moment that the thrusters can give along each axis, N and N m, (6,); 0 along an axis in which
            none acts.
        axis_names: of the six axes.
        seed: of telegraphs and phases.
    """
    acting = [axis for axis in range(6) if largest[axis] > 0]
    groups = {axis_names[axis]: (axis,) for axis in acting}
    groups |= {name: tuple(a for a in axes if a in acting) for name, axes in _GROUPS.items() if len(acting) > 1}
    blocks: list[ExcitationBlock] = []
    for where, axes in groups.items():
        forms = _FORMS if len(axes) == 1 else _RANDOM_FORMS
        for form, signal in forms.items():
            generator = np.random.default_rng([seed, *axes, len(blocks)])
            unit = np.zeros((_STEPS, 6))
            for axis in axes:
                unit[:, axis] = largest[axis] * signal(generator)
            together = np.sqrt(len(axes))
            blocks += [ExcitationBlock(form, axes, where, size, size / together * unit) for size in _SIZES]
    return blocks


def _telegraph(generator: np.random.Generator, shortest: float, longest: float) -> np.ndarray:
    """Jumps between -1, 0 and 1 at random times; its sum is about zero, so that the vehicle does not leave."""
    signal = np.zeros(_STEPS)
    begin, sign = 0, generator.choice([-1.0, 1.0])
    while begin < _STEPS:
        length = max(1, round(generator.uniform(shortest, longest) / HELD))
        signal[begin : begin + length] = sign
        signal[begin + length : begin + 2 * length] = -sign
        pause = max(1, round(generator.uniform(0.0, longest) / HELD))
        begin, sign = begin + 2 * length + pause, generator.choice([-1.0, 1.0])
    return signal


def _multisine(generator: np.random.Generator) -> np.ndarray:
    """Sines with random phases whose largest value is 1; whole periods in the block."""
    time = HELD * np.arange(_STEPS)
    first, last = max(1, round(_LOWEST * BLOCK)), round(_HIGHEST * BLOCK)
    frequencies = np.unique(np.round(np.geomspace(first, last, _LINES))) / BLOCK
    phases = generator.uniform(0, 2 * np.pi, len(frequencies))
    signal = np.sin(2 * np.pi * frequencies * time[:, None] + phases).sum(axis=1)
    return signal / np.abs(signal).max()


def _steps(generator: np.random.Generator) -> np.ndarray:
    """Forward, back for twice as long, and forward."""
    quarter = _STEPS // 4
    return generator.choice([-1.0, 1.0]) * np.repeat([1.0, -1.0, -1.0, 1.0], quarter)


def _decay(generator: np.random.Generator) -> np.ndarray:
    """A push, and then nothing."""
    signal = np.zeros(_STEPS)
    signal[: _STEPS // 5] = generator.choice([-1.0, 1.0])
    return signal


_Signal = Callable[[np.random.Generator], np.ndarray]
_RANDOM_FORMS: dict[str, _Signal] = {
    "telegraph": lambda generator: _telegraph(generator, 0.3, 1.0),
    "slow telegraph": lambda generator: _telegraph(generator, 0.8, 2.0),
    "multisine": _multisine,
}
_FORMS = _RANDOM_FORMS | {"steps": _steps, "decay": _decay}


def script(blocks: Sequence[ExcitationBlock], lead: float, pause: float = 0.0) -> np.ndarray:
    """Rows (t, X, Y, Z, K, M, N) of blocks one after the other, each row held until the next; the last ends the script.

    Args:
        blocks: in their order.
        lead: s of rest before the first.
        pause: s of rest after each.
    """
    rows: list[np.ndarray] = []
    for number, block in enumerate(blocks):
        begin = lead + number * (BLOCK + pause)
        times = begin + HELD * np.arange(_STEPS)
        rows.append(np.column_stack([times, block.wrenches]))
        if pause:
            rows.append(np.array([[begin + BLOCK, *np.zeros(6)]]))
    end = lead + len(blocks) * (BLOCK + pause)
    rows.append(np.array([[end, *np.zeros(6)]]))
    joined = np.round(np.concatenate(rows), 6)
    changes = np.concatenate([[True], (joined[1:, 1:] != joined[:-1, 1:]).any(axis=1)])
    changes[-1] = True
    return joined[changes]
