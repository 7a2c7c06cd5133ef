"""Every part of the catalogue, made once: what a part requires is found by the name of the argument."""

import functools
import inspect
from pathlib import Path

import numpy as np

from undertow.control.controllers.pid import pid
from undertow.core import catalogue
from undertow.core.catalogue import presets_of
from undertow.physics.plants.hybrid_vehicle import hybrid_vehicle
from undertow.physics.sensors import compass, depth, dvl, imu, position_fix
from undertow.physics.thrusters.paper_table3 import paper_table3
from undertow.physics.vehicles.odin import odin


@functools.cache
def required(argument):
    """A value for an argument without a default, whichever part asks for it."""
    thruster = paper_table3()
    rows = np.column_stack([np.linspace(0.0, 2.0, 5), np.random.default_rng(0).normal(size=(5, 6))])
    return {
        "vehicle": odin,
        "thruster": lambda: thruster,
        "model": lambda: hybrid_vehicle(odin(), thruster).model(),
        "law": lambda: pid(hybrid_vehicle(odin(), thruster).model()),
        "plant": lambda: hybrid_vehicle(odin(), thruster),
        "position": lambda: np.linspace(-0.5, 0.5, 6),
        "samples": lambda: rows,
        "commands": lambda: np.column_stack([rows, rows[:, 1:3]]),  # for eight thrusters
        "sensors": lambda: [imu(), dvl(), depth(), position_fix(), compass()],
        "points": lambda: rows[:, 1:4],
        "function": lambda: f"{Path(__file__).with_name('proportional_policy.py')}:act",
    }[argument]()


@functools.cache
def make(kind, name):
    """Part `name` of a kind, or `name:preset`, with its defaults."""
    name, _, preset = name.partition(":")
    part = catalogue.names(kind)[name]
    if preset:
        part = presets_of(part)[preset]
    empty = inspect.Parameter.empty
    needed = [p.name for p in inspect.signature(part).parameters.values() if p.default is empty]
    return part(**{argument: required(argument) for argument in needed})


def variants(kind, name):
    """The part, or each of its presets."""
    return [f"{name}:{preset}" for preset in presets_of(catalogue.names(kind)[name])] or [name]


ALL = [(kind, which) for kind in catalogue.KINDS for name in catalogue.names(kind) for which in variants(kind, name)]


def groups(left_out):
    """Parts of a kind that one program computes together: few where parts are large."""
    for kind in catalogue.KINDS:
        pairs = [pair for pair in ALL if pair[0] == kind and pair not in left_out]
        size = 4 if kind in ("controllers", "navigation") else 40
        yield from (pairs[k : k + size] for k in range(0, len(pairs), size))
