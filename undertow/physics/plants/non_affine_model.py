"""Nominal model of a vehicle whose thrust is not linear in the voltage: x_ddot = F + g(x, V) + d."""

from jaxtyping import Array, Float

from undertow.core.actuator_model import AbstractActuatorModel
from undertow.core.contracts import AbstractNonAffineDynamics, Measurement
from undertow.core.measurement import body_of
from undertow.core.numerics.linear_algebra import matvec
from undertow.core.numerics.rotations import Kinematics
from undertow.physics.plants.hybrid_model import HybridDynamics
from undertow.physics.thrusters.inflow import advance_speed, static_thrust_for, with_inflow


class NonAffineHybridDynamics(AbstractNonAffineDynamics):
    """g(x, V) = J M^-1 B T with the steady thrust T of each thruster: its curve, and the inflow of a moving vehicle.

    The thrusts for an acceleration are those of the affine model, alpha V; each is then solved for its voltage by
    itself. The lag of a thruster is not modelled.
    """

    affine: HybridDynamics
    curve: AbstractActuatorModel  # of the thrusters in steady state and water at rest; without memory
    inflow_loss: Float[Array, ""] | None  # lambda of `with_inflow`; None for none

    def drift(self, y: Measurement) -> Float[Array, "6"]:
        return self.affine.drift(y)

    def gain(self, y: Measurement) -> Float[Array, "6 N"]:
        return self.affine.gain(y)

    def invert(self, y: Measurement, acceleration: Float[Array, "6"]) -> Float[Array, " N"]:
        return self.affine.invert(y, acceleration)

    def forced(self, y: Measurement, u: Float[Array, " N"]) -> Float[Array, "6"]:
        thrust = self.curve.force((), u)
        if self.inflow_loss is not None:
            thrust = with_inflow(thrust, self.inflow_loss, self._advance(y))
        wrench = matvec(self.affine.thruster_matrix, thrust)
        return Kinematics(body_of(y).rotation).to_world(self.affine.body.accelerate(wrench))

    def solve(self, y: Measurement, acceleration: Float[Array, "6"]) -> Float[Array, " N"]:
        thrust = self.affine.thruster.voltage_gain() * self.affine.invert(y, acceleration)
        if self.inflow_loss is not None:
            thrust = static_thrust_for(thrust, self.inflow_loss, self._advance(y))
        return self.curve.command((), thrust, thrust)

    def _advance(self, y: Measurement) -> Float[Array, " N"]:
        """Speed of each propeller over ground along its thrust, m/s: a current is not known."""
        return advance_speed(self.affine.thruster_matrix, body_of(y).nu)
