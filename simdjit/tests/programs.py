"""Random programs of everything that lanes know, each step of which can be checked by itself."""

from collections.abc import Callable
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
import scipy.special
from jax import lax

FLOATS, WHOLES = ("float64", "float32"), ("int32", "int64", "uint32")
SIZE = 3  # entries of every value


class OperationCase(NamedTuple):
    """What a step does to values of SIZE entries.

    Attributes:
        function: of JAX.
        kinds: of its operands: f, a floating-point number; i, a whole number; b, a truth; equal letters, equal types.
        exact: what it must equal; None for the same by `jax.jit`.
        units: of the last place that it may be off.
        scale: from operands to what the error is measured by; None for the result.
    """

    function: Callable
    kinds: str
    exact: Callable | None = None
    units: float = 0
    scale: Callable | None = None


def _places(k):
    """Places in an array of SIZE entries, from any whole numbers."""
    return jnp.asarray(k % SIZE, dtype=int)


def _matrix(x):
    """A well-conditioned matrix of any numbers."""
    tame = jnp.tanh(jnp.nan_to_num(x))
    return jnp.outer(tame, tame[::-1]) / 2 + jnp.diag(jnp.asarray([2.0, -3.0, 4.0], x.dtype)[::-1])[:, [1, 0, 2]]


def _positive(x):
    tame = jnp.tanh(jnp.nan_to_num(x))
    return jnp.outer(tame, tame) + jnp.eye(SIZE, dtype=x.dtype)


def _total(*operands):
    return sum(np.abs(x).sum(axis=-1, keepdims=True) for x in operands)


def _extremes(x):
    """By NumPy: what XLA makes of a row in which something is no number depends on where it stands."""
    return np.stack([x.max(axis=-1), x.min(axis=-1), np.maximum(x[:, 0], x[:, 1])], axis=-1)


def _turned(x, k):
    """A loop that every lane leaves when it likes."""
    rounds = _places(k)[0]
    return lax.while_loop(lambda s: s[0] < rounds, lambda s: (s[0] + 1, jnp.maximum(-s[1], s[1][::-1])), (0, x))[1]


_NUMPY = {
    "exp": 2, "expm1": 3, "log": 2, "log1p": 3, "sin": 3, "cos": 3, "tan": 5, "tanh": 4, "sinh": 4, "cosh": 3, "exp2": 2,
    "arctan": 3, "arcsin": 4, "arccos": 4, "arcsinh": 4, "arccosh": 4, "arctanh": 4, "cbrt": 2, "sqrt": 0.5,
}  # fmt: skip
_ONE = "negative abs sign floor ceil trunc rint square isnan isfinite signbit reciprocal nan_to_num".split()
_TWO = "add subtract multiply divide maximum minimum less less_equal greater equal not_equal copysign fmax fmin".split()

STEPS: dict[str, OperationCase] = {
    **{name: OperationCase(getattr(jnp, name), "f", getattr(np, name), units) for name, units in _NUMPY.items()},
    **{name: OperationCase(getattr(jnp, name), "f") for name in _ONE},
    **{name: OperationCase(getattr(jnp, name), "ff") for name in _TWO},
    "power": OperationCase(jnp.power, "ff", np.power, 2),
    "power_of_whole": OperationCase(lax.pow, "fi", np.power, 2),
    "arctan2": OperationCase(jnp.arctan2, "ff", np.arctan2, 3),
    "erf_inv": OperationCase(jax.scipy.special.erfinv, "f", lambda x: scipy.special.erfinv(x.astype(float)), 14),
    "sigmoid": OperationCase(jax.nn.sigmoid, "f", lambda x: scipy.special.expit(x.astype(float)), 6),
    "rsqrt": OperationCase(lax.rsqrt, "f", units=2),
    "round_away": OperationCase(lax.round, "f"),
    "fmod": OperationCase(jnp.fmod, "ff"),
    "remainder": OperationCase(jnp.remainder, "ff"),
    "hypot": OperationCase(jnp.hypot, "ff", units=6),
    "clip": OperationCase(lambda x, a, b: lax.clamp(a, x, b), "fff"),
    "where": OperationCase(jnp.where, "bff"),
    "where_whole": OperationCase(jnp.where, "bii"),
    **{f"cube_{n}": OperationCase(lambda x, n=n: x**n, "f", units=4) for n in (0, 3, -1, -3)},
    **{f"to_{name}": OperationCase(lambda x, name=name: x.astype(name), "f") for name in (*FLOATS, *WHOLES, "bool")},
    **{
        f"whole_to_{name}": OperationCase(lambda x, name=name: x.astype(name), "i")
        for name in (*FLOATS, *WHOLES, "bool")
    },
    **{f"truth_to_{name}": OperationCase(lambda x, name=name: x.astype(name), "b") for name in ("float32", "int64")},
    **{
        f"whole_{name}": OperationCase(getattr(jnp, name), "ii")
        for name in "add subtract multiply maximum minimum less".split()
    },
    **{f"bits_{name}": OperationCase(getattr(jnp, f"bitwise_{name}"), "ii") for name in ("and", "or", "xor")},
    **{f"truth_{name}": OperationCase(getattr(jnp, f"logical_{name}"), "bb") for name in ("and", "or", "xor")},
    "not": OperationCase(jnp.logical_not, "b"),
    "bits_not": OperationCase(jnp.bitwise_not, "i"),
    "whole_negative": OperationCase(jnp.negative, "i"),
    "whole_abs": OperationCase(jnp.abs, "i"),
    "whole_sign": OperationCase(jnp.sign, "i"),
    "quotient": OperationCase(lax.div, "ii"),
    "rest": OperationCase(lax.rem, "ii"),
    "floor_quotient": OperationCase(jnp.floor_divide, "ii"),
    "floor_rest": OperationCase(jnp.remainder, "ii"),
    "guarded": OperationCase(lambda a, b: jnp.where(b == 0, 0, a // b), "ii"),
    "gcd": OperationCase(lambda a, b: jnp.gcd(a % 97, b % 12), "ii"),  # of the least number JAX does not end
    "whole_power": OperationCase(lambda x: x**3, "i"),
    "left": OperationCase(lax.shift_left, "ii"),
    "right": OperationCase(lax.shift_right_logical, "ii"),
    "right_signed": OperationCase(lax.shift_right_arithmetic, "ii"),
    "sum": OperationCase(lambda x: jnp.full(SIZE, x.sum()), "f", units=4, scale=_total),
    "running": OperationCase(jnp.cumsum, "f", units=4, scale=_total),
    "product": OperationCase(lambda x: jnp.full(SIZE, jnp.prod(jnp.clip(x, -1e3, 1e3))), "f", units=4),
    "extremes": OperationCase(lambda x: jnp.stack([x.max(), x.min(), lax.cummax(x)[1]]), "f", _extremes),
    "where_extreme": OperationCase(lambda x: jnp.stack([jnp.argmax(x), jnp.argmin(x), jnp.argmax(x[1:])]), "f"),
    "whole_sum": OperationCase(lambda x: jnp.full(SIZE, x.sum()), "i"),
    "any": OperationCase(lambda x: jnp.stack([x.any(), x.all(), x[0]]), "b"),
    "dot": OperationCase(lambda x, y: jnp.full(SIZE, x @ y), "ff", units=4, scale=lambda x, y: _total(x * y)),
    "sort": OperationCase(jnp.sort, "f"),
    "whole_sort": OperationCase(jnp.sort, "i"),
    "argsort": OperationCase(jnp.argsort, "f"),
    "sorted_by": OperationCase(lambda k, x: lax.sort_key_val(k, x)[1], "if"),
    "median": OperationCase(lambda x: jnp.full(SIZE, jnp.median(x)), "f", units=1),
    "take": OperationCase(lambda x, k: x[_places(k)], "fi"),
    "take_beyond": OperationCase(lambda x, k: x.at[k].get(mode="fill", fill_value=7.0), "fi"),
    "take_of_many": OperationCase(lambda x, k: jnp.concatenate([x] * 20)[_places(k) * 19], "fi"),
    "put": OperationCase(lambda x, k: x.at[_places(k)[0]].set(x[1] * 2), "fi"),
    "add_at": OperationCase(lambda x, k: x.at[_places(k)].add(x), "fi", units=2, scale=_total),
    "multiply_at": OperationCase(lambda x, k: x.at[_places(k)[:2]].multiply(x[1:]), "fi", units=4),
    "largest_at": OperationCase(lambda x, k: x.at[_places(k)].max(x[::-1]).at[_places(k)].min(x), "fi"),
    "window": OperationCase(lambda x, k: lax.dynamic_slice(jnp.concatenate([x, x]), (_places(k)[0],), (SIZE,)), "fi"),
    "pad": OperationCase(lambda x: lax.pad(x, x[0], [(-1, 2, 1)])[:SIZE], "f"),
    "sought": OperationCase(lambda x, y: jnp.searchsorted(jnp.sort(x), y), "ff"),
    "interpolated": OperationCase(
        lambda x: jnp.interp(x, jnp.linspace(-2, 2, 50, dtype=x.dtype), jnp.linspace(0, 9, 50, dtype=x.dtype) ** 2),
        "f",
        units=200,
        scale=lambda x: 81.0,
    ),
    "branch": OperationCase(lambda b, x: lax.cond(b[0], lambda: x[::-1], lambda: jnp.sin(x) * 0.5), "bf", units=4),
    "switch": OperationCase(lambda k, x: lax.switch(_places(k)[0], [lambda: x, lambda: -x, lambda: x[::-1]]), "if"),
    "scan": OperationCase(lambda x: lax.scan(lambda c, e: (jnp.maximum(c, e), c - e), x[0], x)[1], "f"),
    "loop": OperationCase(_turned, "fi"),
    "solve": OperationCase(
        lambda x, y: jnp.linalg.solve(_matrix(x), jnp.tanh(y)), "ff", units=200, scale=lambda x, y: 1.0
    ),
    "inverse": OperationCase(lambda x: jnp.linalg.inv(_matrix(x))[0], "f", units=200, scale=lambda x: 1.0),
    "determinant": OperationCase(
        lambda x: jnp.full(SIZE, jnp.linalg.det(_matrix(x))), "f", units=200, scale=lambda x: 30.0
    ),
    "cholesky": OperationCase(lambda x: jnp.linalg.cholesky(_positive(x))[2], "f", units=200, scale=lambda x: 1.0),
}

# What overflows in one order of additions and not in another is not compared.
LARGE = {"sum", "running", "dot", "add_at"}

_SPECIAL = (0.0, -0.0, np.inf, -np.inf, np.nan, 1.0, -1.0, 0.5, 2.0, -2.0, 3.0, 1e-300, -1e300, 1e20, 1e8, 709.7, -745.0,
            88.6, 1024.0, np.pi, 5e-324, 1.7e308, 2.0**53)  # fmt: skip
_WHOLE = (0, 1, -1, 2, 3, 7, -5, 31, 32, 64, 1000, 2**31 - 1, -(2**31), 2**63 - 1, -(2**63))


def number(rng: np.random.Generator, dtype: str, size: tuple[int, ...]) -> np.ndarray:
    """Numbers of a type: ordinary ones, and every third a special one."""
    special = rng.random(size) < 0.3
    with np.errstate(all="ignore"):
        if dtype == "bool":
            return rng.random(size) < 0.5
        if dtype in FLOATS:
            ordinary = rng.normal(size=size) * 10.0 ** rng.choice([-3, 0, 0, 0, 2, 6], size)
            return np.where(special, rng.choice(_SPECIAL, size), ordinary).astype(dtype)
        ordinary = rng.integers(-9, 10, size)
        return np.where(special, rng.choice(_WHOLE, size), ordinary).astype(np.int64).astype(dtype)


class RandomProgram(NamedTuple):
    """Steps one after another.

    Attributes:
        inputs: types of its arguments.
        constants: values that stand in it.
        steps: name and places of operands, among inputs, constants and results so far.
    """

    inputs: list[str]
    constants: list[np.ndarray]
    steps: list[tuple[str, list[int]]]

    def __call__(self, *arguments: Any) -> list[Any]:
        """Results of all steps."""
        values = [*arguments, *map(jnp.asarray, self.constants)]
        for name, places in self.steps:
            values.append(STEPS[name].function(*(values[place] for place in places)))
        return values[len(arguments) + len(self.constants) :]


def program(rng: np.random.Generator, length: int) -> RandomProgram:
    """A random one."""
    inputs = [str(dtype) for dtype in rng.choice([*FLOATS, "float64", *WHOLES, "bool"], 5)] + [
        "float64",
        "int64",
        "bool",
    ]
    constants = [number(rng, dtype, (SIZE,)) for dtype in rng.choice([*FLOATS, "int32"], 2)]
    for values in constants:
        values[values == 0] = 1  # a product with a constant zero is one
    types, steps = [*inputs, *(str(values.dtype) for values in constants)], []
    while len(steps) < length:
        name = str(rng.choice(list(STEPS)))
        chosen: dict[str, str] = {}
        places = []
        for kind in STEPS[name].kinds:
            among = {"f": FLOATS, "i": WHOLES, "b": ("bool",)}[kind]
            fitting = [i for i, dtype in enumerate(types) if dtype == chosen.get(kind, dtype) and dtype in among]
            places.append(int(rng.choice(fitting)))
            chosen[kind] = types[places[-1]]
        shapes = [jax.ShapeDtypeStruct((SIZE,), types[place]) for place in places]
        types.append(str(jax.eval_shape(STEPS[name].function, *shapes).dtype))
        steps.append((name, places))
    return RandomProgram(inputs, constants, steps)
