"""Base class of laws written in continuous time; it samples them."""

import abc

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import PyTree

from undertow.core.contracts import AbstractController, Inputs, Measurement, Target, Time
from undertow.numerics.integrators import METHODS


class AbstractContinuousController(AbstractController):
    """A law given by `command` and dz/dt = `flow`, as in the paper's equations.

    The continuous loop integrates `flow` together with the plant as one ODE. The sampled loop holds y, r and u
    over one sampling time and takes `substeps` steps of `method`.
    """

    method: eqx.AbstractVar[str]  # of undertow.numerics.integrators
    substeps: eqx.AbstractVar[int]

    @abc.abstractmethod
    def flow(self, z: PyTree, y: Measurement, r: Target, u_applied: Inputs) -> PyTree:
        """dz/dt."""

    @abc.abstractmethod
    def project(self, z: PyTree) -> PyTree:
        """z projected onto its admissible set after a finite step; z itself where it has no bounds."""

    def advance(self, z: PyTree, y: Measurement, r: Target, u_applied: Inputs, dt: Time) -> PyTree:
        """State one sampling time later, with y, r and u held."""
        step = METHODS[self.method]
        start = jnp.zeros(())
        for _ in range(self.substeps):
            z = step(lambda _, z: self.flow(z, y, r, u_applied), start, z, dt / self.substeps)
            z = self.project(z)
        return z
