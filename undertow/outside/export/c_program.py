"""A system of two functions, its first step and the following ones, as a C program: source, header, test, Makefile.

The arithmetic is that of the batch compiler, operation by operation, so that in double precision the C code has the
bits of a simulation. It needs no heap, no library but libm, and keeps its state in one struct.
"""

import re
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import jax
import numpy as np

from undertow.core.atomic_io import write_whole
from undertow.core.batch_compiler import Unsupported, simdjit, unavailable
from undertow.core.errors import BadInput
from undertow.simulation.loop.stepped import CompiledStep, copy_into

_NAME = re.compile(r"[a-z][a-z0-9_]{0,30}")
_TAKEN = ("test", "example", "clean")  # a file of this name would be overwritten, or a target of the Makefile
_VECTORS = 50  # steps of the test


class System(NamedTuple):
    """What is exported.

    Attributes:
        name: begins the names of files, types and functions.
        about: sentences for the head of each file.
        meanings: of the structs `state`, `input` and `output`, of members as in `input.dt`, and of both functions.
        start: inputs -> (state, outputs), trees of arrays.
        step: (state, inputs) -> (state, outputs).
        inputs: example of them, in the precision of the program.
        sample: (random generator, step) -> inputs of a test.
        period: sampling time, s.
    """

    name: str
    about: str
    meanings: Mapping[str, str]
    start: Callable
    step: Callable
    inputs: Any
    sample: Callable[[np.random.Generator, int], Any]
    period: float


class CFunction(NamedTuple):
    """A further function (t) -> outputs of a program, `NAME_what(t, output)`, and the struct of its outputs."""

    what: str
    struct: str
    meaning: str
    of: Callable
    comment: str


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

    files: Mapping[str, str | bytes]

    def write(self, folder: Path, overwrite: bool = False, option: str = "--c99") -> None:
        """Write the files; `overwrite` replaces those of an earlier export, `option` is named in the error.

        Raises:
            BadInput: a file is there already.
            OSError: the folder cannot be written.
        """
        existing = [name for name in self.files if (folder / name).exists()]
        if existing and not overwrite:
            must = "be a folder without the files of an export"
            got = f"one with {existing[0]}"
            raise BadInput(option, must, got, hint="Use --overwrite")
        folder.mkdir(parents=True, exist_ok=True)
        for name, content in self.files.items():
            write_whole(folder / name, content)


class CProgram:
    """The C program of a system.

    Attributes:
        system: as given.
        kind: type of its real numbers in C.
        fields: members of the structs, by their names: `state`, `input`, `output`, and those of further functions.

    Raises:
        BadInput: the name is none for C, or there is no batch compiler.
        Unsupported: the system needs an operation that the batch compiler has no rule for.
    """

    def __init__(self, system: System, functions: Sequence[CFunction] = ()):
        if not _NAME.fullmatch(system.name):
            raise BadInput("name", "be lower-case letters, digits and underscores, at most 31", repr(system.name))
        if system.name in _TAKEN:
            raise BadInput("name", f"not be one of {', '.join(_TAKEN)}, which are in the Makefile", system.name)
        check_compiler()
        c99 = simdjit.c99
        self.system = system
        self._c99 = c99
        self._source = c99.Source()
        self._state, results = jax.eval_shape(system.start, system.inputs)
        self.fields = {"state": fields(self._state), "input": fields(system.inputs), "output": fields(results)}
        state_names, input_names, output_names = (places(struct, members) for struct, members in self.fields.items())
        name = system.name
        # Both functions write state and output. Only the step reads the state, which nothing has set before the start.
        written_names = [*state_names, *output_names]
        arguments = f"{name}_state *state, const {name}_input *input, {name}_output *output"
        step_inputs = (self._state, system.inputs)
        self._source.add(
            f"void {name}_start({arguments})", system.start, (system.inputs,), input_names, written_names, ("input",)
        )
        self._source.add(
            f"void {name}_step({arguments})", system.step, step_inputs, [*state_names, *input_names], written_names
        )
        self._functions = functions
        self._meanings = dict(system.meanings)
        time = np.zeros((), dtype=_real(system.inputs))
        self.kind = c99.TYPES[str(time.dtype)]
        for function in functions:
            self.fields[function.struct] = fields(jax.eval_shape(function.of, time))
            self._meanings[function.struct] = function.meaning
            signature = self._signature(function)
            target = places(function.struct, self.fields[function.struct])
            self._source.add(signature, function.of, (time,), ["t"], target, ("t",))

    def files(self) -> dict[str, str]:
        """Source, header, test with its steps, and a Makefile."""
        name = self.system.name
        files = {f"{name}.h": self.header(), f"{name}.c": self.text(), f"{name}_vectors.h": self._vectors()}
        return files | {f"{name}_test.c": _TEST.replace("NAME", name), "Makefile": _MAKEFILE.replace("NAME", name)}

    def text(self) -> str:
        """The source file."""
        about = f"/* {self.system.about} */"
        head = f'#include "{self.system.name}.h"\n\n{self._c99.HEAD}'
        return "\n\n".join([about, head, *self._source.functions, ""])

    def header(self) -> str:
        """The header file."""
        system = self.system
        name = self.system.name
        structs = [self._struct(struct, members) for struct, members in self.fields.items()]
        further = [f"/* {function.comment} */\n{self._signature(function)};\n" for function in self._functions]
        return _HEADER.format(
            about=system.about,
            guard=f"{name.upper()}_H",
            name=name,
            period=float(system.period).hex(),
            seconds=f"{system.period:g}",
            defaults=self._initialiser(jax.tree.leaves(system.inputs)),
            structs="\n".join(structs),
            start=system.meanings["start"],
            step=system.meanings["step"],
            further="\n".join(further) + "\n" if further else "",
        )

    def _signature(self, function: CFunction) -> str:
        name = self.system.name
        return f"void {name}_{function.what}({self.kind} t, {name}_{function.struct} *{function.struct})"

    def _struct(self, struct: str, members: list[Field]) -> str:
        lines = [
            f"    {self._c99.TYPES[member.dtype]} {member.name}{''.join(f'[{size}]' for size in member.shape)};"
            + (f" /* {meaning} */" if (meaning := self._meanings.get(f"{struct}.{member.name}")) else "")
            for member in members
            if member.size
        ]
        # C has no struct without a member.
        lines = lines or ["    char nothing;"]
        head = f"/* {self._meanings[struct]} */"
        return "\n".join([head, "typedef struct {", *lines, f"}} {self.system.name}_{struct};", ""])

    def _vectors(self) -> str:
        """Random steps and what the batch compiler gives for them."""
        system = self.system
        chance = np.random.default_rng(0)
        zero_state = jax.tree.map(lambda leaf: np.zeros(leaf.shape, leaf.dtype), self._state)
        first = CompiledStep(lambda _, __, inputs: ((), system.start(inputs)), (), (), system.inputs)
        later = CompiledStep(lambda _, state, inputs: system.step(state, inputs), (), zero_state, system.inputs)
        rows_of_inputs, rows_of_outputs = [], []
        for k in range(_VECTORS):
            compiled = later if k else first
            inputs = system.sample(chance, k)
            copy_into(compiled.inputs, inputs)
            compiled()
            if k == 0:
                copy_into(later.state, first.outputs[0])
            rows_of_inputs.append(self._initialiser(jax.tree.leaves(compiled.inputs)))
            rows_of_outputs.append(self._initialiser(jax.tree.leaves(later.outputs if k else first.outputs[1])))
        inputs, outputs = (",\n    ".join(rows) for rows in (rows_of_inputs, rows_of_outputs))
        return _VECTORS_FILE.format(
            about=system.about, name=system.name, count=_VECTORS, inputs=inputs, outputs=outputs
        )

    def _initialiser(self, leaves: list[np.ndarray]) -> str:
        """The arrays of a struct, in C."""

        def written(value: np.ndarray) -> str:
            if np.ndim(value) == 0:
                return self._c99.literal(value[()], str(value.dtype))
            return "{" + ", ".join(map(written, value)) + "}"

        return "{" + ", ".join(written(np.asarray(leaf)) for leaf in leaves if leaf.size) + "}"


def check_compiler() -> None:
    """Check that there is a batch compiler, whose operations are written in C.

    Raises:
        BadInput: there is none.
    """
    if unavailable():
        raise BadInput("", "", f"nothing can be exported: {unavailable()}")


def has_counterpart(function: Callable, *arguments: Any) -> bool:
    """Whether a function of arrays can be written in C."""
    c99 = simdjit.c99
    count = sum(leaf.size for leaf in jax.tree.leaves(jax.eval_shape(function, *arguments)))
    numbers = sum(np.size(leaf) for leaf in jax.tree.leaves(arguments))
    try:
        c99.Source().add("void tried(void)", function, arguments, ["x"] * numbers, ["x"] * count)
    except Unsupported:
        return False
    return True


def fields(tree: Any) -> list[Field]:
    """Members for the arrays of a tree, named by their paths."""
    members = []
    for path, leaf in jax.tree_util.tree_flatten_with_path(tree)[0]:
        steps = [getattr(step, "name", getattr(step, "key", getattr(step, "idx", ""))) for step in path]
        members.append(Field("_".join(map(str, steps)), tuple(leaf.shape), str(leaf.dtype)))
    return members


def places(struct: str, members: list[Field]) -> list[str]:
    """Where each number of some members lies."""
    return [
        f"{struct}->{member.name}{''.join(f'[{i}]' for i in index)}"
        for member in members
        for index in np.ndindex(*member.shape)
    ]


def made_from(what: str, description: str) -> str:
    """The sentences at the head of a file."""
    scenario = " ".join((description or "scenario without a description").split())
    scenario = "".join(letter for letter in scenario if letter.isprintable())
    for mark in ("/*", "*/"):  # of comments
        scenario = scenario.replace(mark, " ".join(mark))
    return f"{what}. Do not edit. Made by undertow from: {scenario}"


def _real(inputs: Any) -> np.dtype:
    """Type of the real numbers among the inputs."""
    return next(leaf.dtype for leaf in jax.tree.leaves(inputs) if np.issubdtype(leaf.dtype, np.floating))


_HEADER = """\
/* {about} */
#ifndef {guard}
#define {guard}

#include <stdbool.h>
#include <stdint.h>

/* Sampling time, s: {seconds}. */
#define {name}_PERIOD {period}

/* Initialiser of an input: that of the scenario's start. */
#define {name}_DEFAULTS \\
    {defaults}

{structs}
/* {start} */
void {name}_start({name}_state *state, const {name}_input *input, {name}_output *output);

/* {step} */
void {name}_step({name}_state *state, const {name}_input *input, {name}_output *output);

{further}#endif
"""

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
