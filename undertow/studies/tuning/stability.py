"""Certificate of stability of tuned gains: spectral radii of the exactly linearised loop on every training plant."""

from collections import Counter
from collections.abc import Mapping
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from undertow.analysis.linearization import margins
from undertow.analysis.linearization.disturbance_profile import OperatingConditions, disturbance_profile
from undertow.analysis.linearization.equilibrium import equilibrium
from undertow.core.contracts import AbstractController
from undertow.core.errors import BadInput
from undertow.studies.tuning.evaluator import TrainingLoop
from undertow.studies.tuning.training_runs import PlantVariants

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

    def __init__(self, training_loop: TrainingLoop, trials: PlantVariants, first: AbstractController):
        self._training_loop = training_loop
        self._position = np.asarray(training_loop.loop.reference.at(jnp.asarray(training_loop.duration / 2)).position)
        self._variants = tuple(dict.fromkeys(trials.variants))
        once = [trials.variants.index(name) for name in self._variants]
        self._plants = [_plant(trials, i) for i in once]
        pairs = zip(self._plants, once, strict=True)
        self._points = [self._operating_points(plant, trials.keys[i], first) for plant, i in pairs]
        self._first = [
            margins.equilibria(
                training_loop.with_parts(plant, first), training_loop.settings.dt, self._position, points
            )
            for plant, points in zip(self._plants, self._points, strict=True)
        ]

    def __call__(self, law: AbstractController) -> Certificate:
        """Certificate of a controller."""
        dt = self._training_loop.settings.dt
        radii: list[float] = []
        variants: list[str] = []
        columns = zip(self._variants, self._plants, self._points, self._first, strict=True)
        for name, plant, points, near in columns:
            loop = self._training_loop.with_parts(plant, law)
            radii_of_plant = margins.certify(loop, dt, self._position, points, near)
            radii += [radius if np.isfinite(radius) else float("inf") for radius in radii_of_plant]
            variants += [name] * len(radii_of_plant)
        return Certificate(tuple(radii), tuple(variants))

    def _operating_points(self, plant: Any, key: Any, law: AbstractController) -> list[OperatingConditions]:
        loop, dt = self._training_loop.with_parts(plant, law), self._training_loop.settings.dt
        at = equilibrium(loop, dt, self._position, np.zeros_like(self._position))
        around = disturbance_profile(loop, at, key, round(self._training_loop.duration / dt), dt)
        return around.operating_points(_SHARES)


def _plant(trials: PlantVariants, number: int) -> Any:
    return jax.tree.map(lambda leaf: leaf[number] if eqx.is_array(leaf) else leaf, trials.plants)


class NoCertificate(BadInput):
    """None of the tried points is certified."""


def no_certificate(initial: Certificate, tried: Mapping[str, Certificate], points: int) -> NoCertificate:
    """The error where none of the tried points is certified, with the point that came nearest.

    Args:
        initial: certificate of the given gains, each moved to the nearest bound where it is outside its range.
        tried: certificates by gains in words; without those that an earlier, interrupted tuning computed.
        points: number of points that were tried.
    """
    radius = f"the given gains, within the ranges, have {initial.worst:.4g}{_on(initial)}"
    sentences = [f"A loop is stable with a spectral radius below 1: {radius}"]
    remedies = ["Widen the ranges"]
    if tried:
        nearest = min(tried, key=lambda gains: tried[gains].worst)
        sentences.append(f"the nearest point has {tried[nearest].worst:.4g}, with {nearest}")
        remedies = ["Widen the ranges beyond this point"]
    certificates = (initial, *tried.values())
    (variant, times), *_ = Counter(certificate.worst_variant for certificate in certificates).most_common()
    if variant:
        often = f" ({times} of {1 + len(tried)} times the least stable one)" if tried else ""
        remedies += ["use another nominal model", f"leave variant {variant}{often} out of tune.train.sets"]
    must, got = "allow gains for which the loop is stable", f"ranges in which none of {points} points is certified"
    hint = f"{', '.join(sentences)}. {', or '.join(remedies)}"
    return NoCertificate("tune.parameters", must, got, hint=hint)


def _on(certificate: Certificate) -> str:
    return f" on the plant variant {certificate.worst_variant}" if certificate.worst_variant else ""
