"""Hypotheses of the stability proof, checked along a recorded run: Eqs. (33), (38), (41), (43), U6 and U7."""

from collections.abc import Iterator
from typing import NamedTuple

import jax
import numpy as np
import xarray as xr
from jaxtyping import Array, Float

from undertow.analysis.certificate.function import minimax_weight, size_of_basis
from undertow.control.controllers.composite_law import RCAF
from undertow.control.controllers.robust.robust_law import RobustRCAF
from undertow.control.estimation.fuzzy_system import FuzzySystem
from undertow.core.arrays import as_array
from undertow.core.contracts import Model
from undertow.core.kept_programs import kept_program

# Smaller departures are rounding: shares, or m/s^2 and rad/s^2.
ROUNDING = 1e-9

# |xi(eps)|^2 divides the steps of the robust law's weights; its function takes it for |xi(0)|^2.
_SAME_BASIS = 0.01


class Hypothesis(NamedTuple):
    """One hypothesis of the proof; per record whether it held, None where the record does not show it."""

    name: str
    sentence: str
    held: np.ndarray | None  # (time,)
    unknown: str = ""  # why the record does not show it


def of_any(law: RCAF | RobustRCAF, bound: np.ndarray, run: xr.Dataset) -> Iterator[Hypothesis]:
    """Hypotheses of both controllers; `bound` is theta_max of each axis, (n,)."""
    d = run["uncertainty"].values
    true = lambda name: (run[f"measured_{name}"].values == run[name].values).all(-1)
    yield Hypothesis("limits", "no input is at its limit", (run["saturated"].values == 0).all(-1))
    full = run["attained_share"].values >= 1 - ROUNDING
    yield Hypothesis("demand", "the command gives the whole required acceleration (sigma = 0)", full)
    unknown = "G depends on what the actuators report"
    yield Hypothesis("rank", "G has full rank: every axis can be accelerated", _full_rank(law.model, run), unknown)
    yield Hypothesis("measurement", "the measurement is the truth", true("position") & true("velocity"))
    yield Hypothesis("weights", "no weight is at its bound (projection idle)", run["weights_at_bound"].values == 0)
    yield Hypothesis("box", "|d| is inside the box of the weights", np.all(np.abs(d) <= bound, axis=-1))
    yield Hypothesis("constant", "d is constant: theta* = d does not move", _constant(d))


def of_paper(law: RCAF, run: xr.Dataset) -> Iterator[Hypothesis]:
    """The two amplitudes: omega is what no constant theta* explains, at best half the range of d."""
    omega = np.abs(minimax_weight(run) - run["uncertainty"].values)
    unsaturated = (run["saturated"].values == 0).all(-1) & (run["attained_share"].values >= 1 - ROUNDING)
    sentence = "w_bar >= |omega + sigma|, Eq. (43), with sigma = 0 (else it is not recorded)"
    yield Hypothesis("robust_gain", sentence, unsaturated & (omega <= np.asarray(law.robust_gain)).all(-1))
    amplitude = np.asarray(law.identification.compensation_gain)
    if law.modification is not None or law.identification_input != "applied":
        sentence = "the weights follow Eq. (44), Eq. (32) is driven by the applied input"
        yield Hypothesis("adaptation", sentence, np.zeros(run.sizes["time"], bool))
    yield Hypothesis("compensation_gain", "omega_bar >= |omega|, Eq. (33)", np.all(omega <= amplitude, axis=-1))


def of_robust(law: RobustRCAF, run: xr.Dataset) -> Iterator[Hypothesis]:
    """What the discrete function asks of the basis, and what bounds the estimation error where d moves."""
    fuzzy, eps = law.estimator.fuzzy, run["modelling_error"].values
    basis = _basis(fuzzy, as_array(eps.reshape(-1, 1)))
    rho = (np.asarray(basis) ** 2).sum(-1).reshape(eps.shape)
    basis_is_constant = (np.abs(rho / float(size_of_basis(fuzzy)) - 1) <= _SAME_BASIS).all(-1)
    yield Hypothesis("basis", "eps is small beside the fuzzy sets: |xi|^2 within 1 % of |xi(0)|^2", basis_is_constant)
    yield Hypothesis("rate", "|d_dot| is bounded by what the records show", None, "d between records is not recorded")


@kept_program
def _basis(fuzzy: FuzzySystem, x: Float[Array, "k 1"]) -> Float[Array, "k rules"]:
    return fuzzy.basis(x)


def _constant(d: np.ndarray) -> np.ndarray:
    """Whether d is at each record what it was at the one before."""
    unchanged = (np.abs(np.diff(d, axis=0)) <= ROUNDING * np.maximum(np.abs(d).max(axis=0), 1.0)).all(-1)
    return np.concatenate([unchanged[:1], unchanged]) if len(unchanged) else np.ones(len(d), bool)


def _full_rank(model: Model, run: xr.Dataset) -> np.ndarray | None:
    """Whether G had as many independent columns as there are axes, where the controller believed to be."""
    try:
        gains = _gains(model, run["measured_position"].values, run["measured_velocity"].values)
    except (AttributeError, TypeError):  # of a model that asks what the actuators report
        return None
    gains = np.asarray(gains)
    if (gains == gains[0]).all():
        gains = gains[:1]
    return np.broadcast_to(np.linalg.matrix_rank(gains) == gains.shape[1], run.sizes["time"])


@kept_program
def _gains(model: Model, position, velocity):
    return jax.vmap(lambda x, v: model.dynamics.gain(model.coordinates.measurement(x, v)))(position, velocity)
