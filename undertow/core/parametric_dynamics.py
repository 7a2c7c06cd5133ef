"""Dynamics whose unknown parameters enter linearly, as adaptive laws with a regressor use them."""

import abc
from typing import NamedTuple

from jaxtyping import Array, Float

from undertow.core.contracts import AbstractDynamics, Measurement, Outputs

Parameters = Float[Array, " k"]


class Parametrization(NamedTuple):
    """Parameters of nominal dynamics, each in a unit of its own, and the scales of gains and rates.

    Attributes:
        nominal: values of the model.
        most: largest deviation that is plausible.
        rates: rates of adaptation relative to each other, such that a constant load is learnt equally fast in all axes.
        inertia: of each axis: the gain of an axis per rate of decay.
    """

    nominal: Parameters
    most: Parameters
    rates: Parameters
    inertia: Outputs


class AbstractParametricDynamics(AbstractDynamics):
    """Dynamics M(y) v_dot + C(y) v + ... = force with v the velocity, affine in parameters theta.

    C is chosen so that M_dot - 2 C is skew-symmetric for every theta: a law that is passive needs it.
    """

    @abc.abstractmethod
    def parametrization(self) -> Parametrization:
        """Nominal parameters and scales."""

    @abc.abstractmethod
    def generalized_force(
        self, y: Measurement, parameters: Parameters, velocity: Outputs, acceleration: Outputs
    ) -> Outputs:
        """M(y) acceleration + C(y) velocity + ...: the force of an axis, N and N m, with the measured velocity in C.

        At nominal parameters and the measured velocity it gives `acceleration`: `accelerated_by` is then
        `acceleration` less `drift`.
        """

    @abc.abstractmethod
    def accelerated_by(self, y: Measurement, force: Outputs) -> Outputs:
        """M(y)^-1 force with the nominal M, m/s^2 and rad/s^2."""
