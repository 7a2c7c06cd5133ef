"""Functions of the parts of a scenario, compiled by the batch compiler and kept.

What a study computes beside the runs themselves is a function of the numbers of their parts: `for_each` of one instant,
`along_steps` of a whole recursion. The batch compiler's code for it is loaded in a tenth of the time that XLA takes for
its own, and is made more quickly. XLA computes what has no rule there, what has no key because it is code of others,
and everything where there is no batch compiler.
"""

import functools
import weakref
from collections.abc import Callable
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from undertow.core.arrays import with_arrays
from undertow.core.batch_compiler import Unsupported, simdjit, unavailable
from undertow.core.kept_loops import decides_structure, loop_of_key, numbers_contained
from undertow.core.kept_programs import briefly_compiled
from undertow.core.process_setup import cache_folder
from undertow.core.program_key import program_key
from undertow.core.structure_key import Constant

# Operations in all. Functions of a large vehicle and its law have 30 000; of many more, as of a law that solves for its
# command, XLA makes a program more quickly.
_MOST = 80_000


class Recursion(NamedTuple):
    """What goes on from step to step; functions of a module, because what they close over is part of the program.

    Attributes:
        prepare: subject -> what stays the same from step to step.
        start: prepared -> carry.
        step: prepared, carry, number of the step -> carry.
        record: prepared, carry, number of the step -> tree of arrays.
    """

    prepare: Callable[[Any], Any]
    start: Callable[[Any], Any]
    step: Callable[[Any, Any, Any], Any]
    record: Callable[[Any, Any, Any], Any]


def along_steps(recursion: Recursion, subject: Any, instants: int) -> tuple[Any, Any]:
    """A recursion from its start on.

    Args:
        recursion: what goes on.
        subject: a tree of parts.
        instants: how many are recorded, the start included.

    Returns:
        The carry at the last instant; and what is recorded, each array with a leading axis over instants. Rounding
        depends on who compiles it.
    """
    parts = _Parts.of(subject)

    def make(portable: bool) -> "simdjit.Loop":
        prepare = lambda arrays: recursion.prepare(parts.whole(arrays))
        cache = cache_folder() / "native"
        return simdjit.Loop(
            prepare,
            *recursion[1:],
            parts.arrays,
            parts.constant,
            1,
            cache=cache,
            portable=portable,
            optimize=False,
            most=_MOST,
        )

    loop = parts.loop(("steps", Constant(tuple(recursion))), make)
    if loop is None:
        return jax.device_get(_by_scan(recursion)(parts.whole(parts.arrays), instants))
    alone = loop.run(jax.tree.map(lambda leaf: np.asarray(leaf)[None], parts.arrays), instants - 1, 1)
    return jax.tree.map(lambda leaf: leaf[0], alone)


def for_each(function: Callable[[Any, Any, Any], Any], subject: Any, given: Any, rows: np.ndarray) -> Any:
    """What a function gives for each of several rows.

    Args:
        function: subject, given, row -> tree of arrays; one of a module, as those of a `Recursion`.
        subject: a part. As long as it lives, the program is looked for once.
        given: a tree of arrays, the same for all rows; whatever numbers they hold, the program is one.
        rows: arrays, with a leading axis over rows; likewise.

    Returns:
        The tree, each of its arrays with a leading axis over the rows. Rounding depends on who compiles it.
    """
    given = jax.tree.map(np.asarray, given)
    leaves, form = jax.tree.flatten((given, rows[0]))
    forms = form, tuple((leaf.shape, str(leaf.dtype)) for leaf in leaves)
    known = id(subject), function, forms
    if known not in _EACH:
        _EACH[known] = _each(function, subject, forms, given, rows[0])
        weakref.finalize(subject, _EACH.pop, known, None).atexit = False
    return _EACH[known](given, rows)


# What functions give for rows, by the identity of a subject that lives.
_EACH: dict[tuple[Any, ...], Callable[[Any, np.ndarray], Any]] = {}


def _each(
    function: Callable[[Any, Any, Any], Any], subject: Any, forms: tuple[Any, ...], given: Any, row: np.ndarray
) -> Callable[[Any, np.ndarray], Any]:
    parts = _Parts.of(subject)

    def make(portable: bool) -> "simdjit.Loop":
        of_arrays = lambda arrays, given, row: function(parts.whole(arrays), given, row)
        example = parts.arrays, given, row
        constant = [*parts.constant, *(False for _ in jax.tree.leaves((given, row)))]
        cache = cache_folder() / "native"
        return simdjit.Loop.recording(
            of_arrays, example, constant, cache=cache, portable=portable, optimize=False, most=_MOST
        )

    loop = parts.loop(("each", Constant(function), *forms), make)
    if loop is None:
        return lambda given, rows: jax.device_get(_by_vmap(function)(parts.whole(parts.arrays), given, rows))

    def run(given: Any, rows: np.ndarray) -> Any:
        shared = parts.arrays, given
        repeated = jax.tree.map(lambda leaf: np.broadcast_to(leaf, (len(rows), *leaf.shape)), shared)
        _, recorded = loop.run((*repeated, rows), 0, 1)
        return jax.tree.map(lambda leaf: leaf[:, 0], recorded)

    return run


class _Parts(NamedTuple):
    """A tree of parts as the batch compiler takes it: its arrays, the rest, and which arrays the program contains."""

    arrays: Any
    rest: Any
    constant: list[bool]

    @classmethod
    def of(cls, subject: Any) -> "_Parts":
        arrays, rest = eqx.partition(with_arrays(subject), eqx.is_array)
        return cls(arrays, rest, [decides_structure(leaf) for leaf in jax.tree.leaves(arrays)])

    def whole(self, arrays: Any) -> Any:
        """The tree with other arrays."""
        return eqx.combine(arrays, self.rest)

    def loop(self, structure: tuple[Any, ...], make: Callable[[bool], "simdjit.Loop"]) -> "simdjit.Loop | None":
        """The loop of a structure and these parts; None where XLA is to compile it."""
        contained = numbers_contained(self.arrays, self.constant)
        key = None if unavailable() else program_key(*structure, self.whole(self.arrays), contained)
        try:
            return None if key is None else loop_of_key(key, make)
        except Unsupported:
            return None


@functools.cache
def _by_scan(recursion: Recursion) -> Callable[[Any, int], Any]:
    @briefly_compiled
    def scanned(subject: Any, instants: int) -> Any:
        prepared, numbers = recursion.prepare(subject), jnp.arange(instants)
        first = recursion.start(prepared)
        last, before = jax.lax.scan(lambda carry, k: (recursion.step(prepared, carry, k), carry), first, numbers[:-1])
        carries = jax.tree.map(lambda series, end: jnp.concatenate([series, end[None]]), before, last)
        return last, jax.vmap(lambda carry, k: recursion.record(prepared, carry, k))(carries, numbers)

    return scanned


@functools.cache
def _by_vmap(function: Callable[[Any, Any, Any], Any]) -> Callable[[Any, Any, Any], Any]:
    @briefly_compiled
    def mapped(subject: Any, given: Any, rows: Any) -> Any:
        return jax.vmap(lambda row: function(subject, given, row))(rows)

    return mapped
