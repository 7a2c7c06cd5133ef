"""Largest errors of the batch compiler's elementary functions, in units of the last place of a double.

    python benchmarks/function_errors.py

Each function is compared with NumPy's in extended precision (80 bits on x86), at two million random points of each
range.
"""

import jax

jax.config.update("jax_enable_x64", True)

import jax.numpy as jnp
import numpy as np

import simdjit

POINTS = 2_000_000

# Function, and ranges: (from, to) is sampled uniformly; (least, most, "sizes") by the logarithm, with both signs.
FUNCTIONS = {
    "exp": [(-700, 700), (-1, 1)],
    "exp2": [(-1000, 1000), (-1, 1)],
    "expm1": [(-40, 700), (-1, 1), (1e-9, 1, "sizes")],
    "log": [(1e-3, 1e3), (0.5, 2)],
    "log1p": [(-0.9, 3), (1e-9, 0.9, "sizes")],
    "cbrt": [(-1e3, 1e3), (1e-300, 1e300, "sizes")],
    "sin": [(-3.2, 3.2), (-100, 100), (1e-9, 1, "sizes"), (1, 1e12, "sizes")],
    "cos": [(-3.2, 3.2), (-100, 100), (1, 1e12, "sizes")],
    "tan": [(-1.5, 1.5), (-10, 10)],
    "arcsin": [(-1, 1), (1e-9, 1, "sizes")],
    "arccos": [(-1, 1)],
    "arctan": [(-50, 50), (-1, 1), (1e-9, 1e9, "sizes")],
    "sinh": [(-30, 30), (1e-9, 700, "sizes")],
    "cosh": [(-30, 30)],
    "tanh": [(-25, 25), (1e-9, 20, "sizes")],
    "arcsinh": [(-1e3, 1e3), (1e-9, 1e12, "sizes")],
    "arccosh": [(1, 1e3), (1, 1.1)],
    "arctanh": [(-1, 1), (1e-9, 0.99, "sizes")],
    "power": [(0, 5, -3, 3)],
    "arctan2": [(-3, 3, -3, 3)],
}


def samples(chance: np.random.Generator, bounds: tuple) -> list[np.ndarray]:
    """Arguments in a range: one array, or two for a function of two."""
    if bounds[-1] == "sizes":
        size = np.exp(chance.uniform(*np.log(bounds[:2]), POINTS))
        return [size * chance.choice([-1, 1], POINTS)]
    return [chance.uniform(*bounds[i : i + 2], POINTS) for i in range(0, len(bounds), 2)]


def error(name: str, arguments: list[np.ndarray]) -> float:
    """Largest error, in units of the last place."""
    compiled = simdjit.compile(getattr(jnp, name), *(np.zeros(()) for _ in arguments))
    expected = getattr(np, name)(*(x.astype(np.longdouble) for x in arguments))
    unit = np.spacing(np.abs(expected.astype(float)))
    return float((np.abs(compiled(*arguments) - expected) / unit).max())


if __name__ == "__main__":
    chance = np.random.default_rng(0)
    for name, ranges in FUNCTIONS.items():
        print(f"{name:8s} {max(error(name, samples(chance, bounds)) for bounds in ranges):.2f}")
