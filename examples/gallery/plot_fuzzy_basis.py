"""
Fuzzy basis functions
=====================

The fuzzy system estimates the lumped uncertainty: weights times basis functions, which are Gaussian memberships divided
by their sum. The paper uses five sets on the modelling error. The robust variant uses sets so wide that the basis is
nearly constant.
"""

import jax
import jax.numpy as jnp
import matplotlib.pyplot as plt

from undertow.control.estimation.fuzzy_system import gaussian_sets

jax.config.update("jax_enable_x64", True)  # outside of a run, the precision is yours to choose

error = jnp.linspace(-2.0, 2.0, 401)[:, None]  # m/s
paper, wide = gaussian_sets(5, reach=(1.0,)), gaussian_sets(5, reach=(50.0,))

# %%
figure, panels = plt.subplots(1, 2, figsize=(8, 3.0), sharey=True, layout="constrained")
for panel, (title, fuzzy) in zip(
    panels, {"sets from -1 to 1": paper, "sets from -50 to 50": wide}.items(), strict=True
):
    panel.plot(error, fuzzy.basis(error))
    panel.set(title=title, xlabel="modelling error, m/s")
panels[0].set_ylabel("basis functions")
plt.show()

# %%
# They always sum to one. For small errors a single number matters: the squared norm of the basis at zero, which
# multiplies the adaptation gain.

print(f"Largest departure of the sum from one: {float(jnp.abs(paper.basis(error).sum(1) - 1).max()):.1e}")
print(f"Squared norm at zero: {float(paper.basis_norm_squared()):.3f} and {float(wide.basis_norm_squared()):.3f}")
