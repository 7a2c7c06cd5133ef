"""Stability of tuned gains, by the spectrum of the exactly linearised loop: on every true plant of the training."""

from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from undertow.analysis.linearization import margins
from undertow.analysis.linearization.disturbance_profile import disturbance_profile
from undertow.analysis.linearization.equilibrium import equilibrium
from undertow.core.contracts import AbstractController
from undertow.core.errors import BadInput
from undertow.tuning.evaluator import Bench
from undertow.tuning.training_runs import Trials

# Shares of the run's loads, by size, at which the loop is linearised: motors answer otherwise at every speed.
_SHARES = (0.1, 0.5, 0.9)


class Certificate(NamedTuple):
    """Spectral radii of the closed loop from step to step, one per operating point, and which plant it was."""

    radii: tuple[float, ...]
    variants: tuple[str, ...]

    @property
    def worst(self) -> float:
        """The largest; the loop is stable at every operating point if it is below 1."""
        return max(self.radii)

    @property
    def worst_variant(self) -> str:
        """Parameter set of the plant that has it; "" where there is but one."""
        return self.variants[self.radii.index(self.worst)]

    @property
    def holds(self) -> bool:
        """Whether every radius is below 1."""
        return bool(self.worst < 1)


class Certifier:
    """Law -> certificate.

    Args:
        bench: the loop; the reference rests where it is at the middle of the runs.
        trials: the true plants are those that appear there, each once.
        first: law with which the operating points are looked for.
    """

    def __init__(self, bench: Bench, trials: Trials, first: AbstractController):
        self._bench = bench
        self._position = np.asarray(bench.loop.reference.at(jnp.asarray(bench.duration / 2)).position)
        self._variants = tuple(dict.fromkeys(trials.variants))
        once = [trials.variants.index(name) for name in self._variants]
        self._plants = [_plant(trials, i) for i in once]
        pairs = zip(self._plants, once, strict=True)
        self._loads = [self._operating_loads(plant, trials.keys[i], first) for plant, i in pairs]

    def __call__(self, law: AbstractController) -> Certificate:
        """Certificate of a law."""
        dt = self._bench.settings.dt
        radii: list[float] = []
        variants: list[str] = []
        for name, plant, loads in zip(self._variants, self._plants, self._loads, strict=True):
            found = margins.certify(self._bench.with_parts(plant, law), dt, self._position, loads)
            radii += [radius if np.isfinite(radius) else float("inf") for radius in found]
            variants += [name] * len(found)
        return Certificate(tuple(radii), tuple(variants))

    def _operating_loads(self, plant: Any, key: Any, law: AbstractController) -> np.ndarray:
        loop, dt = self._bench.with_parts(plant, law), self._bench.settings.dt
        at = equilibrium(loop, dt, self._position, np.zeros_like(self._position))
        around = disturbance_profile(loop, at, key, round(self._bench.duration / dt), dt)
        return around.operating_loads(_SHARES)


def _plant(trials: Trials, number: int) -> Any:
    return jax.tree.map(lambda leaf: leaf[number] if eqx.is_array(leaf) else leaf, trials.plants)


def no_certificate(given: Certificate, tried: int) -> BadInput:
    """What to say where no gains are certified.

    Args:
        given: certificate of the gains of the scenario.
        tried: how many points were tried.
    """
    truth = f" with the parameter set {given.worst_variant} as the truth" if given.worst_variant else ""
    sets = ", tell the controller another set or leave this one out of tune.train.sets" if truth else ""
    hint = f"As given, the loop has a spectral radius of {given.worst:.4g}{truth}. Widen the ranges{sets}"
    must, got = "allow gains with which the loop is stable", f"so that none of {tried} points is certified"
    return BadInput("tune.parameters", must, got, hint=hint)
