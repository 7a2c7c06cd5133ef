"""A controller as C99: a source file, a header, test vectors, an example and a Makefile.

The arithmetic is that of the batch compiler, operation by operation, so that in double precision the C code has the
bits of `Autopilot` and of a simulation. It needs no heap, no library but libm, and keeps its state in one struct.
"""

import re
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, NamedTuple

import jax
import numpy as np

from undertow.autopilot.functions import Functions
from undertow.autopilot.measured_motion import Format
from undertow.autopilot.output import output_of
from undertow.core import checks, runtime
from undertow.core.arrays import in_present_precision
from undertow.core.contracts import starting_at
from undertow.core.errors import BadInput
from undertow.loop.simd_batch import Unsupported, unavailable
from undertow.loop.stepped import Step, put
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

    def write(self, folder: Path, overwrite: bool = False) -> None:
        """Write the files; `overwrite` replaces those of an earlier export.

        Raises:
            BadInput: a file is there already.
            OSError: the folder cannot be written.
        """
        there = [name for name in self.files if (folder / name).exists()]
        if there and not overwrite:
            raise BadInput(
                "--c99", "be a folder without the files of an export", f"one with {there[0]}", hint="Use --overwrite"
            )
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
    checks.choice("precision", chosen, ("float64", "float32"))
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
        vectors = self._vectors(start, step, memory)
        files |= {f"{name}_vectors.h": vectors, f"{name}_test.c": _TEST.replace("NAME", name)}
        files |= {"example.c": _EXAMPLE.replace("NAME", name), "Makefile": _MAKEFILE.replace("NAME", name)}
        return Exported(files)

    def _vectors(self, start: Callable, step: Callable, memory: Any) -> str:
        """Random steps and what the batch compiler gives for them."""
        of, chance = self._of, np.random.default_rng(0)
        kept = jax.tree.map(lambda leaf: np.zeros(leaf.shape, leaf.dtype), memory)
        first = Step(lambda _, __, given: ((), start(given)), (), (), of.given)
        later = Step(lambda _, memory, given: step(memory, *given), (), kept, (of.given, of.applied, of.time))
        given, results = [], []
        for k in range(_VECTORS):
            taken = first if k == 0 else later
            random = lambda leaf: np.asarray(leaf + _SPREAD * chance.normal(size=leaf.shape), dtype=leaf.dtype)
            motion, applied = jax.tree.map(random, of.given), random(of.applied)
            whole = (motion, applied, np.asarray(self._period, dtype=of.time.dtype))
            put(taken.inputs, motion if k == 0 else whole)
            taken()
            if k == 0:
                put(later.state, first.outputs[0])
            given.append(_initialiser(jax.tree.leaves(whole)))
            results.append(_initialiser(jax.tree.leaves(first.outputs[1] if k == 0 else later.outputs)))
        name = self._name
        return _VECTORS_FILE.format(
            about=f"{_ABOUT} {self._said()}",
            name=name,
            count=_VECTORS,
            inputs=",\n    ".join(given),
            outputs=",\n    ".join(results),
        )

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


_SPREAD = 0.2  # of the random numbers of a test, m, rad, V

_VECTORS_FILE = """\
/* Steps of a test. {about} */
#include "{name}.h"

#define STEPS {count}

static const {name}_input INPUTS[STEPS] = {{
    {inputs}
}};

static const {name}_output OUTPUTS[STEPS] = {{
    {outputs}
}};
"""

_TEST = """\
/* Compares every output with that of undertow's own compiler, bit for bit. Exit code 0 where all are the same. */
#include <stdio.h>
#include <string.h>

#include "NAME_vectors.h"

int main(void) {
    static NAME_state state;
    NAME_output output;
    int different = 0;
    for (int k = 0; k < STEPS; ++k) {
        if (k == 0) {
            NAME_start(&state, &INPUTS[k], &output);
        } else {
            NAME_step(&state, &INPUTS[k], &output);
        }
        if (memcmp(&output, &OUTPUTS[k], sizeof output) != 0) {
            different += 1;
        }
    }
    printf("%d of %d steps differ; the state takes %u bytes\\n", different, STEPS, (unsigned)sizeof state);
    return (different == 0) ? 0 : 1;
}
"""

_EXAMPLE = """\
/* The controller in a loop: fill in what the comments say. */
#include "NAME.h"

int main(void) {
    static NAME_state state;
    NAME_input input = {0};
    NAME_output output;
    NAME_target target;
    input.dt = NAME_PERIOD;
    for (int k = 0; k < 100; ++k) {
        /* Measure: input.motion_position, input.motion_velocity and, of a vehicle, input.motion_attitude. */
        NAME_reference(k * NAME_PERIOD, &target);
        for (unsigned i = 0; i < sizeof target.position / sizeof target.position[0]; ++i) {
            input.target_position[i] = target.position[i];
            input.target_velocity[i] = target.velocity[i];
            input.target_acceleration[i] = target.acceleration[i];
        }
        (k == 0) ? NAME_start(&state, &input, &output) : NAME_step(&state, &input, &output);
        for (unsigned i = 0; i < sizeof output.command / sizeof output.command[0]; ++i) {
            input.applied[i] = output.command[i]; /* Or what was applied: less, where the supply sagged. */
        }
        /* Write output.output to the thrusters, and wait for the next period. */
    }
    return 0;
}
"""

_MAKEFILE = """\
# make test compares the code with undertow's own; any C99 compiler does.
CFLAGS ?= -O2
CFLAGS += -std=c99 -Wall -Wextra -Werror -pedantic -ffp-contract=off

test: NAME_test example
	./NAME_test
	./example

NAME_test: NAME_test.c NAME.c NAME.h NAME_vectors.h
	$(CC) $(CFLAGS) NAME_test.c NAME.c -o NAME_test -lm

example: example.c NAME.c NAME.h
	$(CC) $(CFLAGS) example.c NAME.c -o example -lm

clean:
	rm -f NAME_test example

.PHONY: test clean
"""

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


def _initialiser(leaves: list[np.ndarray]) -> str:
    """The arrays of a struct, in C."""
    from simdjit import c99

    def written(value: np.ndarray) -> str:
        if np.ndim(value) == 0:
            return c99.literal(value[()], str(value.dtype))
        return "{" + ", ".join(map(written, value)) + "}"

    return "{" + ", ".join(written(np.asarray(leaf)) for leaf in leaves if leaf.size) + "}"


def _struct(name: str, fields: list[Field], said: str) -> str:
    from simdjit import c99

    members = [
        f"    {c99.TYPES[one.dtype]} {one.name}{''.join(f'[{size}]' for size in one.shape)};"
        for one in fields
        if one.size
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
