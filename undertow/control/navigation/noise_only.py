"""What navigations have in common that know their noise, and report nothing else."""

import jax.numpy as jnp

from undertow.core.contracts import AbstractInformedNavigation


class AbstractNoiseOnly(AbstractInformedNavigation):
    """A navigation that ignores no readings and declares no signals."""

    def ignored(self, state):
        return jnp.zeros((), dtype=int)

    def signals(self):
        return {}

    def diagnostics(self, state):
        return {}
