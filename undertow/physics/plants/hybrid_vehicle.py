"""The vehicle with its thrusters: the paper's MIMO hybrid dynamical system, Eqs. (1)-(20)."""

from typing import Any, NamedTuple

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jax.core import Tracer
from jaxtyping import Array, Float

from undertow.core import checks
from undertow.core.actuator_model import DirectActuator
from undertow.core.arrays import as_array, library_of
from undertow.core.contracts import AbstractPlant, Effort, Load, Measurement, Model, Pose
from undertow.core.errors import BadInput
from undertow.core.kept_programs import kept_program, kept_values
from undertow.core.measurement import BODY_AXES, BODY_OUTPUTS, measurement_of_pose
from undertow.core.numerics.linear_algebra import matvec
from undertow.core.numerics.number import Number
from undertow.core.numerics.rotations import (
    Kinematics,
    quaternion_from_euler,
    quaternion_rate,
    rotation_from_quaternion,
)
from undertow.core.runtime import double_outside_runs
from undertow.core.status import Status
from undertow.physics.plants.hybrid_model import EulerCoordinates, HybridDynamics
from undertow.physics.plants.hybrid_power import HybridPower, PowerState, has_motor
from undertow.physics.plants.mechanism import given_or_zero
from undertow.physics.plants.non_affine_model import NonAffineHybridDynamics
from undertow.physics.plants.reachability import open_loop_advice
from undertow.physics.power import ESC, Battery
from undertow.physics.thrusters.inflow import advance_speed, with_inflow
from undertow.physics.thrusters.thruster import AbstractThruster
from undertow.physics.vehicles.alteration import altered
from undertow.physics.vehicles.body import Body, seen_from_water
from undertow.physics.vehicles.submersion import HullEllipsoid, hull_of
from undertow.physics.vehicles.vehicle import VehicleModel

_ENVELOPE = 1e3  # m, m/s, rad/s; far above the values of any vehicle


class VehicleState(NamedTuple):
    """State of body, thrusters and power. The attitude is a quaternion: no singularity, no trigonometry."""

    position: Float[Array, "3"]  # m, world
    attitude: Float[Array, "4"]  # unit quaternion, body -> world
    nu: Float[Array, "6"]  # m/s, rad/s, body
    thrusters: Any
    power: PowerState = PowerState()  # battery and ledger


class HybridVehicle(AbstractPlant):
    """x = (north, east, down, roll, pitch, yaw) driven by thruster voltages.

    At the fidelities `ideal` and `static` a prescribed acceleration load is all of d, J_dot nu included (Remark 2); at
    the others J_dot nu is part of the dynamics, and the load is added to x_ddot.

    Arguments are those of `hybrid_vehicle`, which can leave thrusters out.
    """

    vehicle: VehicleModel
    thruster: AbstractThruster
    power: HybridPower
    body: Body
    hull: HullEllipsoid
    thruster_matrix: Float[Array, "6 N"]
    inflow_loss: Float[Array, ""] | None  # lambda of `with_inflow`, N^(1/2) s/m; None for none
    outputs: tuple[str, ...] = eqx.field(static=True)
    output_units: tuple[str, ...] = eqx.field(static=True)
    input_unit: str = eqx.field(static=True)

    @double_outside_runs
    def __init__(
        self,
        vehicle: VehicleModel,
        thruster: AbstractThruster,
        battery: Battery | None = None,
        esc: ESC | None = None,
        ledger: bool | None = None,
        inflow_loss: Number | None = None,
    ):
        for name, part, contract, example in (
            ("vehicle", vehicle, VehicleModel, "ut.vehicles.bluerov2_heavy()"),
            ("thruster", thruster, AbstractThruster, "ut.thrusters.t200()"),
        ):
            if not isinstance(part, contract):
                raise BadInput(name, f"be a part, such as `{example}`", f"a {type(part).__name__}")
        _check_count(thruster, vehicle.thrusters)
        kept = has_motor(thruster) if ledger is None else ledger
        self.vehicle, self.thruster, self.power = vehicle, thruster, HybridPower(battery, esc, kept)
        self.power.check(thruster)
        if inflow_loss is not None:
            checks.positive("inflow_loss", inflow_loss, "N^(1/2) s/m")
        self.inflow_loss = None if inflow_loss is None else as_array(inflow_loss)
        self.body, self.thruster_matrix = vehicle.body(), vehicle.thruster_matrix()
        self.hull = hull_of(vehicle)
        self.outputs = BODY_OUTPUTS
        self.output_units = ("m", "m", "m", "rad", "rad", "rad")
        self.input_unit = thruster.input_unit

    def _repr_html_(self) -> str:
        """What a notebook shows: the vehicle."""
        return self.vehicle._repr_html_()

    def initial_state(self, position=None, velocity=None) -> VehicleState:
        outputs = given_or_zero(position, 6)
        attitude = quaternion_from_euler(outputs[3:])
        nu = Kinematics(rotation_from_quaternion(attitude)).to_body(given_or_zero(velocity, 6))
        thrusters, power = self.thruster.initial_state(self.inputs()), self.power.initial_state(self.inputs())
        return VehicleState(outputs[:3], attitude, nu, thrusters, power)

    def dynamics(self, t, x: VehicleState, u, d: Load) -> VehicleState:
        kinematics = Kinematics(rotation_from_quaternion(x.attitude))
        thruster_rates = self.thruster.dynamics(x.thrusters, u)
        return VehicleState(
            position=matvec(kinematics.rotation, x.nu[:3]),
            attitude=quaternion_rate(x.attitude, x.nu[3:]),
            nu=self._body_acceleration(kinematics, x, u, d),
            thrusters=thruster_rates,
            power=self.power.dynamics(self.thruster, x.thrusters, thruster_rates, x.power, u),
        )

    def output(self, t, x: VehicleState) -> Measurement:
        return measurement_of_pose(x.position, x.attitude, x.nu, self.thruster.report(x.thrusters))

    def acceleration(self, t, x: VehicleState, u, d: Load) -> Float[Array, "6"]:
        kinematics = Kinematics(rotation_from_quaternion(x.attitude))
        nu_rate = self._body_acceleration(kinematics, x, u, d)
        return kinematics.to_world(nu_rate) + kinematics.rate_term(x.nu)

    def _body_acceleration(self, kinematics: Kinematics, x: VehicleState, u, d: Load) -> Float[Array, "6"]:
        """nu_dot of Eq. (2): thrust of Eq. (6), dynamics of the body, and the loads."""
        body = altered(self.body, d.scaling, d.payloads)
        seen = seen_from_water(d.water, kinematics.rotation, x.nu, body.gravity)
        thrust = self.thruster.thrust(x.thrusters, u)
        if self.inflow_loss is not None:
            thrust = with_inflow(thrust, self.inflow_loss, advance_speed(self.thruster_matrix, seen.nu))
        if d.scaling is not None:
            if d.scaling.thrust.shape not in ((), thrust.shape):
                raise BadInput("thrusters", f"be {thrust.size}, as the vehicle has", d.scaling.thrust.size)
            thrust = d.scaling.thrust * thrust
        wrench = matvec(self.thruster_matrix, thrust) - d.wrench
        if d.surface is not None:
            cut = self.hull.cut(d.surface, x.position, kinematics.rotation[2], body, d.scaling)
            wrench = wrench + matvec(self.thruster_matrix, cut.lost_thrust(thrust)) + cut.wrench(seen)
            body = cut.body()
        prescribed = d.acceleration
        if self.thruster.has_prescribed_acceleration:
            prescribed = prescribed - kinematics.rate_term(x.nu)
        own = body.free_acceleration(seen.nu, seen.down) + seen.rate
        return own + body.accelerate(wrench) + kinematics.to_body(prescribed)

    def pose(self, x: VehicleState) -> Pose:
        rotation = rotation_from_quaternion(x.attitude)
        return Pose(x.position, rotation, matvec(rotation, x.nu[:3]))

    def admissible(self, x: VehicleState, u):
        return self.power.admissible(self.thruster, x.thrusters, x.power, u)

    def effort(self, x: VehicleState, u) -> Effort:
        limited = self.power.saturated(self.thruster, x.thrusters, x.power, u)
        return Effort(self.thruster.electrical_power(x.thrusters, u), limited.astype(u.dtype))

    def diagnostics(self, x: VehicleState, u):
        return self.power.diagnostics(self.thruster, x.thrusters, x.power, u)

    def signals(self):
        return self.power.signals()

    def inputs(self) -> int:
        return self.vehicle.thrusters

    def status(self, x: VehicleState) -> Array:
        """OK if Euler angles are defined and all values are within the plausible range."""
        third_row = rotation_from_quaternion(x.attitude)[2]
        near_vertical = third_row[1] ** 2 + third_row[2] ** 2 < 1e-6
        far = (jnp.abs(x.position) > _ENVELOPE).any() | (jnp.abs(x.nu) > _ENVELOPE).any()
        code = jnp.where(near_vertical, int(Status.PITCH_SINGULAR), int(Status.OK))
        return jnp.where(far, int(Status.DIVERGED), code)

    def advice(self) -> tuple[str, ...]:
        return self.thruster.advice() + open_loop_advice(
            "the thruster matrix", self.thruster_matrix, BODY_AXES, "thruster"
        )

    def rank(self) -> int:
        """Rank of the thruster matrix, which is that of G where J is regular."""
        if isinstance(self.thruster_matrix, Tracer):
            return min(6, self.inputs())
        return int(np.linalg.matrix_rank(np.asarray(self.thruster_matrix), tol=1e-9))

    def model(
        self,
        *,
        speed_sensor: bool = False,
        rate_term: bool = False,
        regularisation: float | None = None,
        affine: bool = True,
        vehicle: VehicleModel | None = None,
        thruster: AbstractThruster | None = None,
    ) -> Model:
        """Nominal model of this plant for the controller.

        Args:
            speed_sensor: whether phi of Eq. (15) is known from propeller-speed sensors (Example 1) or left in d.
            rate_term: whether J_dot nu is in F; the paper leaves it in d (Remark 2).
            regularisation: delta of Definition 2; None for the exact inverse.
            affine: whether thrust is taken as alpha V, as in the paper; false: preset `paper` solves the steady thrust
                curve and the inflow for the voltage. Other laws have the curve in their model of the actuators.
            vehicle: nominal vehicle of the controller, such as another published parameter set; None for the true one.
            thruster: nominal thruster of the controller, such as one with another lag; None for the true one.

        Raises:
            BadInput: speed_sensor for thrusters that have no measurable speed, regularisation not positive, or a
                vehicle with another number of thrusters.
        """
        nominal = self.thruster if thruster is None else thruster
        _check_count(nominal, self.inputs())
        known = self if vehicle is None else HybridVehicle(vehicle, nominal)
        if speed_sensor and not affine:
            hint = "Leave one of them out"
            raise BadInput("speed_sensor", "be false where `affine` is false: phi is in the curve", "true", hint=hint)
        if known.inputs() != self.inputs():
            raise BadInput("vehicle", f"have {self.inputs()} thrusters, as the true one has", f"{known.inputs()}")
        if regularisation is not None:
            checks.positive("regularisation", regularisation)
        if speed_sensor:
            still = nominal.report(nominal.initial_state(self.inputs()))
            if still is None:  # thrusters without a speed to measure complain here, not in the loop
                nominal.speed_term(still)
        gain, allocation = _static(known.body.inverse_mass_matrix, known.thruster_matrix, nominal.voltage_gain())
        dynamics = HybridDynamics(
            body=known.body,
            thruster=nominal,
            thruster_matrix=known.thruster_matrix,
            body_gain=gain,
            allocation=allocation,
            wrenches=_possible_wrenches(known.thruster_matrix, known.rank()),
            rank=known.rank(),
            regularisation=regularisation,
            speed_sensor=speed_sensor,
            rate_term=rate_term,
        )
        if not affine:
            curve = nominal.actuator_model(self.inputs(), False).quasi_static()
            dynamics = NonAffineHybridDynamics(dynamics, curve, self.inflow_loss)
        return Model(dynamics, EulerCoordinates(), DirectActuator())


def _check_count(thruster: AbstractThruster, thrusters: int) -> None:
    """Check that parameters with one entry per thruster have as many entries as there are thrusters."""
    if thruster.count() not in (None, thrusters):
        raise BadInput("thruster", f"have parameters for {thrusters} thrusters", f"for {thruster.count()}")


def _possible_wrenches(thruster_matrix, rank: int):
    """Orthonormal basis of the wrenches that thrusters can give; None where they can give any."""
    if rank == len(BODY_AXES):
        return None
    directions, *_ = library_of(thruster_matrix).linalg.svd(thruster_matrix)
    return as_array(directions[:, :rank])


@kept_values
@kept_program
def _static(inverse_mass, thruster_matrix, voltage_gain):
    """Acceleration per volt at rest, and minimum-norm voltages per wrench; one voltage gain for all or one each."""
    per_volt = thruster_matrix * (voltage_gain[None, :] if voltage_gain.ndim else voltage_gain)
    return inverse_mass @ per_volt, jnp.linalg.pinv(per_volt)


def hybrid_vehicle(
    vehicle: VehicleModel,
    thruster: AbstractThruster,
    thrusters=None,
    battery: Battery | None = None,
    esc: ESC | None = None,
    ledger: bool | None = None,
    inflow_loss: float | None = None,
) -> HybridVehicle:
    """A vehicle with its thrusters, voltages in, pose out: the paper's hybrid system.

    Args:
        vehicle: hull and thruster layout.
        thruster: what turns volts into thrust.
        thrusters: numbers, from 1, of the thrusters that are fitted; None for all.
        battery: what feeds them; its state is the charge drawn, its voltage limits the command. None for the
            thruster's supply at any current.
        esc: speed controllers, which round the command to pulses; None for none.
        ledger: whether to keep account of the thrusters' energy along the run, for 3 to 10 % of its time; None
            wherever there is a motor.
        inflow_loss: thrust lost per root of the static thrust and speed of the propeller through the water,
            N^(1/2) s/m: K_1 D (rho / K_0)^(1/2), where K_T = K_0 - K_1 J; None where it is neglected.

    Raises:
        BadInput: a number that is not one of the vehicle's thrusters, or power parts that do not fit the thruster.
    """
    if thrusters is not None:
        vehicle = vehicle.with_thrusters(thrusters)
    return HybridVehicle(vehicle, thruster, battery, esc, ledger, inflow_loss)
