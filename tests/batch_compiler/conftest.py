"""A function in lanes, to be compared with the same function by JAX."""

import jax
import numpy as np
import pytest

from simdjit import Loop


@pytest.fixture
def in_lanes():
    """`in_lanes(f)(x, ...)`: f of each row of arrays, in lanes; `constant` says which arguments are constants."""

    def compiled(function, constant=(), lanes=0):
        def run(*rows):
            example = tuple(jax.numpy.asarray(row[0]) for row in rows)
            fixed = [i in constant for i in range(len(rows))]
            nothing = np.zeros(())
            program = Loop(
                lambda numbers: numbers,
                lambda numbers: nothing,
                lambda numbers, carry, k: carry,
                lambda numbers, carry, k: function(*numbers),
                example,
                fixed,
                lanes,
            )
            _, looked = program.run(tuple(map(np.asarray, rows)), steps=1, every=1)
            return jax.tree.map(lambda leaf: leaf[:, 0], looked)

        return run

    return compiled
