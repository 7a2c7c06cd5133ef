"""Programs in C99 have the bits of the batch compiler, at every level of optimisation, and no undefined behaviour."""

import ctypes
import shutil
import subprocess

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from programs import SIZE, number, program
from test_differential import bits, with_zeros

import simdjit
from simdjit import c99
from simdjit.c99 import literal

pytestmark = pytest.mark.compiler

ROWS = 8
COMPILERS = [name for name in ("gcc", "clang") if shutil.which(name)]


def test_there_is_a_compiler():
    assert COMPILERS, "These tests need gcc or clang"


def in_c(functions, folder, compiler, *flags):
    """Functions of arrays, each with its examples, as functions of rows of arrays, by a C compiler."""
    source, kinds = c99.Source(), c99.TYPES
    shapes = []
    for i, (function, example) in enumerate(functions):
        results = jax.eval_shape(lambda *given, f=function: tuple(jax.tree.leaves(f(*given))), *example)
        names = [f"const {kinds[str(leaf.dtype)]} *a{k}" for k, leaf in enumerate(example)]
        names += [f"{kinds[str(leaf.dtype)]} *r{k}" for k, leaf in enumerate(results)]
        read = [f"a{k}[{j}]" for k, leaf in enumerate(example) for j in range(leaf.size)]
        write = [f"r{k}[{j}]" for k, leaf in enumerate(results) for j in range(leaf.size)]
        idle = [name.rpartition("*")[2] for name in names]
        source.add(f"void f{i}({', '.join(names)})", function, tuple(example), read, write, idle)
        shapes.append(results)
    declared = [text.split("{")[0].strip() + ";" for text in source.functions if text.startswith("void ")]
    (folder / "all.c").write_text("\n\n".join([c99.HEAD, *declared, *source.functions, ""]))
    library = folder / f"{compiler}{len(flags)}{abs(hash(flags))}.so"
    options = ["-std=c99", "-Wall", "-Wextra", "-Werror", "-pedantic", "-shared", "-fPIC", *flags]
    done = subprocess.run(
        [compiler, *options, "all.c", "-o", library, "-lm"], cwd=folder, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr
    code = ctypes.CDLL(str(library))

    def run(i, rows):
        found = [np.zeros((len(rows[0]), *leaf.shape), leaf.dtype) for leaf in shapes[i]]
        for row in range(len(rows[0])):
            given = [np.ascontiguousarray(x[row]) for x in rows]
            getattr(code, f"f{i}")(
                *(ctypes.c_void_p(x.ctypes.data) for x in [*given, *(out[row : row + 1] for out in found)])
            )
        return found

    return run


def examined(seeds, length, folder):
    """Random programs by both compilers of C, and by ours."""
    programs, rows = [], []
    for seed in seeds:
        rng = np.random.default_rng(seed)
        one = next(one for one in iter(lambda rng=rng: program(rng, length), None) if not with_zeros(one))
        programs.append((one, [number(rng, dtype, (ROWS, SIZE)) for dtype in one.inputs]))
        rows.append(programs[-1][1])
    functions = [(lambda *given, one=one: one(*given), [jnp.asarray(x[0]) for x in given]) for one, given in programs]
    for compiler in COMPILERS:
        for flags in (("-O0",), ("-O2",), ("-O3", "-march=native")):
            run = in_c(functions, folder, compiler, *flags)
            for i, (one, given) in enumerate(programs):
                ours = simdjit.compile(lambda *x, one=one: tuple(one(*x)), *(x[0] for x in given), lanes=1)(*given)
                for (name, _), own, wanted in zip(one.steps, run(i, given), ours, strict=True):
                    np.testing.assert_array_equal(bits(own), bits(wanted), err_msg=f"{name}, {compiler} {flags}")


def test_random_programs(tmp_path):
    examined(range(3), 15, tmp_path)


@pytest.mark.slow
@pytest.mark.parametrize("first", range(0, 200, 10))
def test_many_random_programs(tmp_path, first):
    examined(range(first, first + 10), 40, tmp_path)


def newton(x):
    """A loop whose end only the numbers know."""
    return jax.lax.while_loop(lambda y: jnp.abs(y * y - x) > 1e-12 * x, lambda y: (y + x / y) / 2, x)


def carried(carry):
    """A round of a loop that carries, beside a count, a number that it only writes."""
    count, x, _ = carry
    return count + 1, 2 * x, x


def test_loops_branches_tables_and_products(tmp_path):
    """What is more than one operation: regions, called functions, entries of tables, products that are loops."""
    chance = np.random.default_rng(0)
    table = jnp.asarray(chance.normal(size=50))
    matrix, vector = chance.normal(size=(ROWS, 20, 20)), chance.normal(size=(ROWS, 20))
    positive, place = chance.uniform(0.1, 1e6, (ROWS, 3)), chance.integers(0, 50, (ROWS, 3))
    large = chance.normal(size=(ROWS, 3)) * 1e30  # angles whose sine takes the long way
    cases = [
        (lambda x: newton(x[0]) + newton(x[1]), [positive]),
        (lambda x: jnp.sin(x) + jnp.exp(-(x**2)) * jnp.arctan2(x, 1.0), [large]),
        (lambda i: table[i], [place]),
        (lambda a, b: (a @ a) @ b, [matrix, vector]),
        (lambda x: jax.lax.cond(x[0] > 5e5, lambda: jnp.cumsum(x), lambda: jnp.sort(x)), [positive]),
        (lambda x: x.astype("float32") * jnp.float32(1.1), [positive]),
        (lambda x: jax.lax.while_loop(lambda c: c[0] < 3, carried, (0, x, x))[1], [positive]),
    ]
    functions = [(function, [jnp.asarray(x[0]) for x in rows]) for function, rows in cases]
    for compiler in COMPILERS:
        sanitized = [("-O1", "-fsanitize=undefined", "-fno-sanitize-recover=all")] if compiler == "gcc" else []
        for flags in (("-O2",), *sanitized):
            run = in_c(functions, tmp_path, compiler, *flags)
            for i, (function, rows) in enumerate(cases):
                wanted = simdjit.compile(function, *(x[0] for x in rows), lanes=1)(*rows)
                np.testing.assert_array_equal(bits(run(i, rows)[0]), bits(wanted))


def test_literals_are_exact():
    chance = np.random.default_rng(0)
    for value in [*chance.normal(size=20), 1e-310, np.inf, -np.inf, 0.1]:
        text = literal(np.float64(value), "float64").strip("()")
        expected = {"INFINITY": np.inf, "-INFINITY": -np.inf}.get(text)
        assert (float.fromhex(text) if expected is None else expected) == value
    assert literal(np.int64(-(2**63)), "int64") == "(-9223372036854775807LL - 1)"
    assert literal(np.float32(0.1), "float32").endswith("f")
