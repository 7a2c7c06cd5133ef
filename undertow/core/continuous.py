"""Laws written in continuous time, sampled here once for all of them."""

import abc

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import PyTree

from undertow.core.contracts import AbstractController, Inputs, Measurement, Target, Time
from undertow.numerics.integrators import METHODS


class AbstractContinuousController(AbstractController):
    """A law given by `command` and dz/dt = `flow`: exactly the paper's equations.

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
        """z moved back to where it must stay, after a step of finite length; z itself if it may be anywhere."""

    def advance(self, z: PyTree, y: Measurement, r: Target, u_applied: Inputs, dt: Time) -> PyTree:
        """State one sampling time later, y, r and u held."""
        step = METHODS[self.method]
        start = jnp.zeros(())
        for _ in range(self.substeps):
            z = step(lambda _, z: self.flow(z, y, r, u_applied), start, z, dt / self.substeps)
            z = self.project(z)
        return z
