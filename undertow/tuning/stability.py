"""Certificate of stability of tuned gains: spectral radii of the exactly linearised loop on every training plant."""

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
from undertow.tuning.evaluator import TrainingLoop
from undertow.tuning.training_runs import Trials

# Quantiles of the loads of a run at which the loop is linearised: the time constant of a motor depends on its speed.
_SHARES = (0.1, 0.5, 0.9)


class Certificate(NamedTuple):
    """Spectral radii of the closed loop over one control step, one per operating point, with the plant variant."""

    radii: tuple[float, ...]
    variants: tuple[str, ...]

    @property
    def worst(self) -> float:
        """The largest radius; the loop is stable at every operating point if it is below 1."""
        return max(self.radii)

    @property
    def worst_variant(self) -> str:
        """Plant variant with the largest radius; "" where there is only one."""
        return self.variants[self.radii.index(self.worst)]

    @property
    def holds(self) -> bool:
        """Whether every radius is below 1."""
        return bool(self.worst < 1)


class Certifier:
    """Controller -> certificate.

    Args:
        training_loop: the loop; the reference is frozen at the middle of the runs.
        trials: trials with the plant variants.
        first: controller with which the operating points are computed.
    """

    def __init__(self, training_loop: TrainingLoop, trials: Trials, first: AbstractController):
        self._training_loop = training_loop
        self._position = np.asarray(training_loop.loop.reference.at(jnp.asarray(training_loop.duration / 2)).position)
        self._variants = tuple(dict.fromkeys(trials.variants))
        once = [trials.variants.index(name) for name in self._variants]
        self._plants = [_plant(trials, i) for i in once]
        pairs = zip(self._plants, once, strict=True)
        self._loads = [self._operating_loads(plant, trials.keys[i], first) for plant, i in pairs]

    def __call__(self, law: AbstractController) -> Certificate:
        """Certificate of a controller."""
        dt = self._training_loop.settings.dt
        radii: list[float] = []
        variants: list[str] = []
        for name, plant, loads in zip(self._variants, self._plants, self._loads, strict=True):
            found = margins.certify(self._training_loop.with_parts(plant, law), dt, self._position, loads)
            radii += [radius if np.isfinite(radius) else float("inf") for radius in found]
            variants += [name] * len(found)
        return Certificate(tuple(radii), tuple(variants))

    def _operating_loads(self, plant: Any, key: Any, law: AbstractController) -> np.ndarray:
        loop, dt = self._training_loop.with_parts(plant, law), self._training_loop.settings.dt
        at = equilibrium(loop, dt, self._position, np.zeros_like(self._position))
        around = disturbance_profile(loop, at, key, round(self._training_loop.duration / dt), dt)
        return around.operating_loads(_SHARES)


def _plant(trials: Trials, number: int) -> Any:
    return jax.tree.map(lambda leaf: leaf[number] if eqx.is_array(leaf) else leaf, trials.plants)


def no_certificate(given: Certificate, tried: int) -> BadInput:
    """The error where none of the tried points is certified; `given` is the certificate of the scenario's own gains."""
    plant = f" on the plant variant {given.worst_variant}" if given.worst_variant else ""
    sets = ", use another nominal model, or leave this variant out of tune.train.sets" if plant else ""
    hint = f"With the given gains the loop has a spectral radius of {given.worst:.4g}{plant}. Widen the ranges{sets}"
    must, got = "allow gains for which the loop is stable", f"ranges in which none of {tried} points is certified"
    return BadInput("tune.parameters", must, got, hint=hint)
