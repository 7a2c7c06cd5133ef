"""Programs for a GPU: what its threads do when this processor does it for them."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from emulated_gpu import EmulatedGpu

from simdjit import Driver, Loop, Unsupported, nvidia

pytestmark = pytest.mark.compiler


@pytest.fixture
def gpu(monkeypatch):
    monkeypatch.setattr(nvidia, "ptx", lambda assembly, *rest: assembly)
    return EmulatedGpu()


def test_tables_and_functions_give_the_bits_of_vectors(gpu):
    """What lies in memory, and what is only called where a thread needs it."""

    def look(numbers, carry, k):
        x, place = numbers
        far = jnp.sin(x[place] * 1e9) + jnp.cos(jnp.asarray(np.arange(90.0) ** 9)[place])
        return far, (x * x)[place], jnp.sort(x[:5]), jnp.power(x[:2], 3.5)

    x, place = np.random.default_rng(3).normal(size=(70, 90)), np.arange(70)
    nothing = lambda numbers, *rest: np.zeros(())
    parts = (lambda numbers: numbers, nothing, lambda numbers, carry, k: carry, look)
    programs = (Loop(*parts, (x[0], place[0]), [False] * 2, driver=d) for d in (Driver(gpu), None))
    found, wanted = (program.run((x, place), 1, 1)[1] for program in programs)
    jax.tree.map(np.testing.assert_array_equal, found, wanted)


def test_sums_and_products_are_not_contracted(monkeypatch):
    """Only elementary functions have fused products, and those are written as such."""
    written = []
    monkeypatch.setattr(Driver, "load", lambda self, assembly, name: written.append(assembly))
    x, nothing = np.arange(1.0, 5.0), lambda numbers, *rest: np.zeros(())
    for look in (lambda numbers, *rest: numbers * numbers + 1 / numbers, lambda numbers, *rest: jnp.exp(numbers)):
        parts = (lambda numbers: numbers, nothing, lambda numbers, carry, k: carry, look)
        Loop(*parts, x, driver=Driver(EmulatedGpu()))
    plain, fused = (text.count("fma.rn.f64") for text in written)
    assert plain == 0 and "mul.rn.f64" in written[0] and fused > 0


def test_remainders_stay_on_the_processor(gpu):
    with pytest.raises(Unsupported):
        nvidia.Kernel("  %x = frem <1 x double> %a, %b", Driver(gpu))


def test_a_gpu_is_used_where_jax_sees_one_and_its_driver_loads(monkeypatch):
    """On any machine, with or without a GPU."""

    def missing():
        raise OSError("libcuda.so.1: cannot open shared object file")

    for backend, driver, found in (("cpu", object, False), ("gpu", missing, False), ("gpu", object, True)):
        monkeypatch.setattr(jax, "default_backend", lambda backend=backend: backend)
        monkeypatch.setattr(nvidia, "Driver", driver)
        assert (nvidia.gpu.__wrapped__() is not None) == found, (backend, found)
