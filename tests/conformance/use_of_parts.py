"""What each kind of part is for, as one pure function of the part and a vector of 64 numbers in (-1, 1)."""

import equinox as eqx
import jax
import jax.numpy as jnp
from textbook import rotation_from_euler

from undertow.core.contracts import Load, Pose, Target
from undertow.core.measurement import measurement_of_outputs
from undertow.physics.faults.mode import (
    AbstractComputationFault,
    AbstractPlantFault,
    AbstractThrustMode,
    Instant,
    Moment,
    Presence,
)
from undertow.physics.power import ESC
from undertow.physics.sensors.motion import motion_of
from undertow.physics.thrusters.thruster import PropellerReport

NUMBERS = 64


def vehicles(vehicle, v):
    body = vehicle.body()
    own = body.free_acceleration(v[:6], v[6:9] / jnp.linalg.norm(v[6:9]))
    return own, vehicle.thruster_matrix() @ v[: vehicle.thrusters]


def thrusters(thruster, v):
    volts = 10 * v[:3]
    state = _filled(thruster.initial_state(3), v[3:])
    return (
        thruster.dynamics(state, volts),
        thruster.thrust(state, volts),
        thruster.current(state, volts),
        thruster.report(state),
        thruster.voltage_gain(),
    )


def plants(plant, v):
    n, m, t = len(plant.outputs), plant.inputs(), jnp.abs(v[0])
    x = _filled(plant.initial_state(v[1 : 1 + n], v[7 : 7 + n]), v[13:], only_zeros=True)
    load = Load(v[30 : 30 + n], v[36 : 36 + n])
    u = plant.admissible(x, 10 * v[42 : 42 + m])
    return (
        plant.dynamics(t, x, u, load),
        plant.output(t, x),
        plant.acceleration(t, x, u, load),
        plant.effort(x, u),
        plant.no_load(),
    )


def controllers(controller, v):
    n = len(controller.model.coordinates.angles)
    rest = controller.model.coordinates.measurement(v[:n], v[6 : 6 + n])
    wanted = Target(v[12 : 12 + n], v[18 : 18 + n], v[24 : 24 + n])
    z = _filled(controller.init(rest, wanted), v)
    u, signals = controller.command(z, rest, wanted)
    return u, signals, controller.advance(z, rest, wanted, u, jnp.asarray(1e-3))


def disturbances(disturbance, v):
    calm = Load(v[:6], v[6:12])
    angles = jnp.stack([v[13], v[14], 3 * v[15]])
    place = Pose(jnp.stack([v[16], v[17], 3 + v[18]]), rotation_from_euler(angles), v[19:22])
    return disturbance.at(disturbance.realize(jax.random.PRNGKey(1)), 1.0 + v[12], place, calm)


def power(part, v):
    drawn, watts, bus = 1e4 * (1 + v[0]), 500 * v[1], 14.0 + v[2]
    if isinstance(part, ESC):
        pulse = part.pulse(10 * v[3:6], bus)
        return pulse, part.voltage(pulse, bus)
    limit = part.limit(drawn, lambda volts: 20 * volts**2, 20 * jnp.abs(v[3]))
    told = part.bus_voltage, part.current, part.loss
    return limit, part.energy(drawn), *[tell(drawn, watts) for tell in told]


def sensors(sensor, v):
    truth = measurement_of_outputs(v[:6], v[6:12], PropellerReport(100 * v[25:33], 10 * v[33:41]))
    motion = motion_of(truth, v[41:44], 0.01)
    reading = sensor.reading(motion)
    state = sensor.sampling.init(reading, v[: reading.size])
    heard = sensor.sampling.deliver(state, 1 + jnp.abs(v[12]), reading, v[: reading.size + 1])
    return heard, jax.jacfwd(sensor.reading)(motion)


def references(reference, v):
    return reference.at(5.0 + v[0])


def navigation(filter_, v):
    truth = measurement_of_outputs(v[:6], v[6:12])
    realization = filter_.realize(jax.random.PRNGKey(2))
    return filter_.measure(
        realization, filter_.init(realization, measurement_of_outputs(v[13:19], v[19:25])), jnp.abs(v[12]), truth
    )


class Restarted:
    """What faults of the computation need of a law: a state with which it begins."""

    def init(self, y, r):
        return {"integral": y, "filter": 2 * y}


def faults(fault, v):
    severity, value = 1.5 + v[0], v[1:5]
    if isinstance(fault, AbstractThrustMode):
        return fault.factor(severity)
    if isinstance(fault, AbstractPlantFault):
        place = Pose(jnp.stack([v[16], v[17], 3 + v[18]]), rotation_from_euler(v[13:16]), v[19:22])
        return fault.load(Presence(jnp.asarray(True), 1 + v[5], severity - 3), place, Load(v[6:12], v[22:28]))
    if isinstance(fault, AbstractComputationFault):
        now = Instant(jnp.asarray(True), jnp.asarray(0), severity)
        state = {"integral": v[6:10], "filter": v[10:14]}
        state = fault.state(now, Restarted(), state, v[14:18], v[18:22])
        return fault.execution(now, 0.01 + 0.001 * v[5]), jax.tree.map(jnp.nan_to_num, state)
    # A few control steps that are far apart: with one of them a period may change nothing.
    size = 0.05 * severity if fault.delays else severity / 3
    memory, found = fault.init(v[6:10]), []
    for k in range(8):
        since, step = 5.3 + 37.3 * k + v[5], jnp.asarray(k)
        moment = Moment(jnp.asarray(True), since, 0.01, size, jax.random.PRNGKey(3), step, jnp.zeros(4), holds=False)
        altered, memory = fault.apply(memory, moment, value + k)
        found.append((jnp.nan_to_num(altered.value), altered.present))
    return found, memory


KINDS = (vehicles, thrusters, power, plants, controllers, disturbances, references, sensors, navigation, faults)
USES = {use.__name__: use for use in KINDS} | {"supervision": controllers}  # a supervisor is a controller around one


def numbers(kind, part, v):
    """Everything that a part computes, flattened into floats."""
    leaves = jax.tree.leaves(USES[kind](part, v))
    return jnp.concatenate([jnp.ravel(leaf).astype(float) for leaf in leaves if eqx.is_array(leaf)] or [jnp.zeros(0)])


def _filled(state, v, only_zeros=False):
    """The same state with other numbers in it, so that nothing hides at rest."""
    leaves, tree = jax.tree.flatten(state)
    counts = lambda leaf: not jnp.issubdtype(leaf.dtype, jnp.floating)
    moved = [leaf if counts(leaf) else leaf + 0.5 * jnp.resize(v, leaf.shape) for leaf in leaves]
    if only_zeros:
        moved = [jnp.where(leaf == 0, new, leaf) for leaf, new in zip(leaves, moved, strict=True)]
    return jax.tree.unflatten(tree, moved)
