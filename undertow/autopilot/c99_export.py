"""A controller as C99: a source file, a header, test vectors, an example and a Makefile.

The arithmetic is that of the batch compiler, operation by operation, so that in double precision the C code has the
bits of `Autopilot` and of a simulation. It needs no heap, no library but libm, and keeps its state in one struct.
"""

import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

import jax
import numpy as np

from undertow.autopilot.functions import Functions
from undertow.autopilot.measured_motion import Format
from undertow.autopilot.output import output_of
from undertow.core import runtime
from undertow.core.arrays import in_present_precision
from undertow.core.contracts import starting_at
from undertow.core.errors import BadInput
from undertow.loop.simd_batch import Unsupported, unavailable
from undertow.power.esc import ESC
from undertow.scenario.build import Built

_NAME = re.compile(r"[a-z][a-z0-9_]{0,30}")
_VECTORS = 50  # steps of the test


class Field(NamedTuple):
    """Member of a struct."""

    name: str
    shape: tuple[int, ...]
    dtype: str

    @property
    def size(self) -> int:
        """Numbers in it."""
        return int(np.prod(self.shape))


class Exported(NamedTuple):
    """Files by name."""

    files: Mapping[str, str]

    def write(self, folder: Path) -> None:
        """Write the files.

        Raises:
            OSError: the folder cannot be written.
        """
        folder.mkdir(parents=True, exist_ok=True)
        for name, text in self.files.items():
            (folder / name).write_text(text, encoding="utf-8")


def export_c99(
    built: Built,
    name: str = "controller",
    *,
    precision: str | None = None,
    attitude: str = "euler",
    velocity: str = "body",
    output: str = "input",
    esc: ESC | None = None,
) -> Exported:
    """The controller of a scenario in C99.

    Args:
        built: the scenario.
        name: begins the names of files, types and functions; lower-case letters, digits and underscores.
        precision: float64 or float32; None for that of the scenario.
        attitude, velocity: formats of measured motions, as for `Autopilot`.
        output: what the vehicle takes, as for `Autopilot`.
        esc: speed controllers for `pulses`; None for usual ones.

    Raises:
        BadInput: a format is unknown, or the controller needs something that has no counterpart in C99.
    """
    if not _NAME.fullmatch(name):
        raise BadInput("name", "be lower-case letters, digits and underscores, at most 31", repr(name))
    if unavailable():
        raise BadInput("c99", "have the batch compiler installed", unavailable())
    chosen, form = precision or built.scenario.precision, Format(attitude, velocity)
    form.check()
    with runtime.on_processor(), runtime.in_precision(chosen):
        loop = in_present_precision(built.closed_loop)
        functions = Functions(loop, form, output_of(output, loop.plant, loop.controller, esc))
        try:
            return _Export(name, functions, built).exported()
        except Unsupported as error:
            must = "be made of operations that the batch compiler has"
            raise BadInput("controller", must, f"one that needs others: {error}") from None


class _Export:
    """Files of one controller."""

    def __init__(self, name: str, of: Functions, built: Built):
        from simdjit import c99

        self._name, self._of, self._built, self._c99 = name, of, built, c99
        self._period = built.scenario.loop.dt
        self._source = c99.Source()

    def exported(self) -> Exported:
        of, name = self._of, self._name
        reference = starting_at(of.reference, of.given.target.position)

        def start(given):
            memory, answer = of.first(of.controller, given)
            return memory, (answer.command, of.output.of(answer.command))

        def step(memory, given, applied, dt):
            memory, answer = of.following(of.controller, memory, given, applied, dt)
            return memory, (answer.command, of.output.of(answer.command))

        memory = jax.eval_shape(start, of.given)[0]
        self._state = _fields(memory, "")
        self._first = _fields(of.given, "")
        self._given = [*self._first, *_fields((of.applied, of.time), "", ("applied", "dt"))]
        self._results = _fields(jax.eval_shape(start, of.given)[1], "", ("command", "output"))
        self._targets = _fields(of.given.target, "")
        state, results = _places("state", self._state), _places("output", self._results)
        kind = self._c99.TYPES[str(of.time.dtype)]
        arguments = f"{name}_state *state, const {name}_input *input, {name}_output *output"
        both, later = [*state, *results], (memory, of.given, of.applied, of.time)
        first, given = _places("input", self._first), _places("input", self._given)
        self._source.add(f"void {name}_start({arguments})", start, (of.given,), first, both)
        self._source.add(f"void {name}_step({arguments})", step, later, [*state, *given], both)
        signature = f"void {name}_reference({kind} t, {name}_target *target)"
        self._source.add(signature, reference.at, (of.time,), ["t"], _places("target", self._targets), ("t",))
        files = {f"{name}.h": self._header(kind), f"{name}.c": self._text()}
        return Exported(files)

    def _text(self) -> str:
        """The source file."""
        about = f"/* {_ABOUT} {self._said()} */"
        return "\n\n".join([about, f'#include "{self._name}.h"\n\n{self._c99.HEAD}', *self._source.functions, ""])

    def _header(self, kind: str) -> str:
        """The header file."""
        name, guard = self._name, f"{self._name.upper()}_H"
        structs = {
            "state": (self._state, "State of the controller; keep it between the steps."),
            "input": (self._given, f"What a step is given. {self._formats()}"),
            "output": (self._results, f"What a step gives: the law's command and the output, {self._of.output.unit}."),
            "target": (self._targets, "Target of the scenario's reference at a time."),
        }
        texts = [_struct(f"{name}_{what}", fields, said) for what, (fields, said) in structs.items()]
        return _HEADER.format(
            about=f"{_ABOUT} {self._said()}",
            guard=guard,
            name=name,
            kind=kind,
            period=float(self._period).hex(),
            seconds=f"{self._period:g}",
            structs="\n".join(texts),
        )

    def _said(self) -> str:
        what = self._built.scenario.description or "scenario without a description"
        return f"Made by undertow from: {' '.join(what.split())}".replace("*/", "* /")

    def _formats(self) -> str:
        form = self._of.form
        if form is None:
            return "Position and velocity are the outputs of the plant and their rates."
        turned = {"euler": "roll, pitch, yaw, rad", "quaternion": "w, x, y, z, body to world"}[form.attitude]
        return f"Position north, east, down, m; attitude {turned}; velocity `{form.velocity}`, m/s and rad/s."


_ABOUT = "Controller of an underwater vehicle. Do not edit."

_HEADER = """\
/* {about} */
#ifndef {guard}
#define {guard}

#include <stdbool.h>
#include <stdint.h>

/* Sampling time for which the controller was designed, s: {seconds}. */
#define {name}_PERIOD {period}

{structs}

/* The first step: sets the state. */
void {name}_start({name}_state *state, const {name}_input *input, {name}_output *output);

/* A step input->dt after the last one, with input->applied applied since then. What was not measured is NAN. */
void {name}_step({name}_state *state, const {name}_input *input, {name}_output *output);

/* Target of the scenario's reference at t, s. */
void {name}_reference({kind} t, {name}_target *target);

#endif
"""


def _struct(name: str, fields: list[Field], said: str) -> str:
    from simdjit.c99 import TYPES

    members = [
        f"    {TYPES[one.dtype]} {one.name}{''.join(f'[{size}]' for size in one.shape)};" for one in fields if one.size
    ]
    return "\n".join([f"/* {said} */", "typedef struct {", *members, f"}} {name};", ""])


def _fields(tree: Any, prefix: str, names: tuple[str, ...] = ()) -> list[Field]:
    """Members for the arrays of a tree, named by their paths; `names` are those of the entries of a tuple."""
    found = []
    for path, leaf in jax.tree_util.tree_flatten_with_path(tree)[0]:
        steps = [getattr(step, "name", getattr(step, "key", getattr(step, "idx", ""))) for step in path]
        if names:
            steps[0] = names[int(steps[0])]
        name = "_".join(map(str, steps)) or prefix
        found.append(Field(name, tuple(leaf.shape), str(leaf.dtype)))
    return found


def _places(struct: str, fields: list[Field]) -> list[str]:
    """Where each number of some members lies."""
    pointer = f"{struct}->"
    return [
        f"{pointer}{one.name}{''.join(f'[{i}]' for i in index)}" for one in fields for index in np.ndindex(*one.shape)
    ]
