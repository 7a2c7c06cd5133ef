"""Numbers derived from a vehicle's data, for inspection."""

import numpy as np

from undertow.checks.vehicle_lint.layout import scaled
from undertow.vehicles.facts import Facts


def derived(facts: Facts) -> tuple[tuple[str, str, str], ...]:
    """Rows (what, value, unit)."""
    eigenvalues = np.linalg.eigvalsh(0.5 * (facts.mass_matrix + facts.mass_matrix.T))
    sizes = np.linalg.svd(facts.thruster_matrix, compute_uv=False)
    even = np.linalg.svd(scaled(facts.thruster_matrix), compute_uv=False)
    rank = int((sizes > 1e-9 * sizes[0]).sum())
    drag = np.diag(facts.linear_damping) + np.diag(facts.quadratic_damping)
    righting = facts.weight * facts.r_g[2] - facts.buoyancy * facts.r_b[2]
    return (
        ("mass, displaced mass", _row([facts.mass, facts.displaced_mass]), "kg"),
        ("(B - W) / W", f"{100 * (facts.buoyancy / facts.weight - 1):+.2f}", "%"),
        ("radii of gyration, roll, pitch, yaw", _row(facts.radii_of_gyration), "m"),
        ("eigenvalues of M", _row(eigenvalues), "kg, kg m^2"),
        ("added mass / displaced mass", _row(np.diag(facts.added_mass)[:3] / facts.displaced_mass), ""),
        ("drag at 1 m/s, surge, sway, heave", _row(drag[:3]), "N"),
        ("centre of buoyancy above centre of gravity", f"{1e3 * (facts.r_g[2] - facts.r_b[2]):.4g}", "mm"),
        ("righting moment", f"{righting:.4g}", "N m/rad"),
        ("thrusters, rank of their matrix", f"{len(facts.positions)}, {rank}", ""),
        ("singular values of the thruster matrix", _row(sizes), ""),
        ("condition, moments per longest arm", f"{even[0] / even[-1]:.3g}" if len(even) == rank == 6 else "-", ""),
    )


def _row(values) -> str:
    return ", ".join(f"{value:.4g}" for value in values)
