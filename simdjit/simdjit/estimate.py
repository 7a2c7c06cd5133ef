"""What a program would cost, compiled here and by XLA: from numbers of operations, mostly to within a factor of two.

The constants are fits to what `python benchmarks/estimates.py` measures, beside which it prints the estimates, and to
the same figures of large simulations, on one core of an Intel Xeon (Sapphire Rapids, eight lanes). They are the same on
every machine, so that the choice between the two, and with it the bits of a result, depends on the program only.
"""

from typing import Any, NamedTuple

import numpy as np
from jax.extend.core import ClosedJaxpr, Jaxpr

# Here: seconds to compile per operation, which LLVM needs more of in a long program, and nanoseconds per operation of
# one run in eight lanes, which are more where code and numbers leave the caches.
_COMPILING, _COMPILING_LONG = 4e-5, 3e-9
_RUNNING, _RUNNING_LONG = 0.035, 4e-7

# XLA: seconds to compile, at least and per equation of the jaxpr; nanoseconds per run of a batch for an equation, for
# a number that it makes, for a value of an elementary function, and for a product in a product of matrices.
_XLA_LEAST, _XLA_COMPILING = 0.04, 1.5e-3
_XLA_EQUATION, _XLA_NUMBER, _XLA_FUNCTION, _XLA_PRODUCT = 0.6, 0.1, 2.0, 0.05

_FUNCTIONS = frozenset(
    "exp exp2 expm1 log log1p sin cos tan asin acos atan atan2 sinh cosh tanh asinh acosh atanh logistic pow cbrt"
    " erf_inv".split()
)


class Cost(NamedTuple):
    """Of a program.

    Attributes:
        compiling: s.
        step: ns per step and run of a batch, on one core.
    """

    compiling: float
    step: float

    def total(self, steps: int) -> float:
        """Seconds to compile it and to run so many steps, those of all runs together."""
        return self.compiling + 1e-9 * self.step * steps


def compiled_here(operations: int) -> Cost:
    """Cost of so many operations per step, but for those in loops over memory."""
    return Cost(
        operations * (_COMPILING + _COMPILING_LONG * operations), operations * (_RUNNING + _RUNNING_LONG * operations)
    )


def compiled_by_xla(step: ClosedJaxpr) -> Cost:
    """Cost of the same step by `jax.vmap`."""
    equations, nanoseconds = _counted(step.jaxpr)
    return Cost(_XLA_LEAST + _XLA_COMPILING * equations, nanoseconds)


def _counted(jaxpr: Jaxpr) -> tuple[int, float]:
    """Equations, and nanoseconds; a loop whose end is not known is done once, and all branches are."""
    equations, nanoseconds = 0, 0.0
    for equation in jaxpr.eqns:
        inner = [_counted(jaxpr_inside) for value in equation.params.values() for jaxpr_inside in _jaxprs(value)]
        rounds = equation.params["length"] if equation.primitive.name == "scan" else 1
        equations += sum(count for count, _ in inner) if inner else 1
        nanoseconds += rounds * sum(each for _, each in inner) if inner else _nanoseconds(equation)
    return equations, nanoseconds


def _jaxprs(value: Any) -> list[Jaxpr]:
    values = value if isinstance(value, tuple | list) else (value,)
    closed = (jaxpr.jaxpr if isinstance(jaxpr, ClosedJaxpr) else jaxpr for jaxpr in values)
    return [jaxpr for jaxpr in closed if isinstance(jaxpr, Jaxpr)]


def _nanoseconds(equation: Any) -> float:
    name = equation.primitive.name
    made, used = (
        sum(int(np.prod(getattr(variable.aval, "shape", ()))) for variable in variables)
        for variables in (equation.outvars, equation.invars[:1])
    )
    if name == "dot_general":
        (axes, _), _ = equation.params["dimension_numbers"]
        length = int(np.prod([equation.invars[0].aval.shape[axis] for axis in axes]))
        return _XLA_EQUATION + _XLA_PRODUCT * made * length
    if name in _FUNCTIONS:
        return _XLA_EQUATION + _XLA_FUNCTION * made
    reduced = name.startswith(("reduce", "cum", "arg"))
    return _XLA_EQUATION + _XLA_NUMBER * (used if reduced else made)


def reason_for_xla(operations: int, step: ClosedJaxpr, steps: int) -> str:
    """Why XLA is the better choice for so many steps of all runs together; empty where it is not."""
    cost_here, cost_by_xla = compiled_here(operations), compiled_by_xla(step)
    if cost_here.total(steps) <= cost_by_xla.total(steps):
        return ""
    by_xla = f"XLA takes less time by estimate: {_words(cost_by_xla)} and run"
    return f"{by_xla}; batch code of {spaced(operations)} operations takes {_words(cost_here)}"


def spaced(count: int) -> str:
    """A whole number as text, in groups of three digits."""
    return f"{count:,}".replace(",", " ")


def _words(cost: Cost) -> str:
    return f"{cost.compiling:.2g} s to compile and {cost.step / 1000:.2g} us per step"
