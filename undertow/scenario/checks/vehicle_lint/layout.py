"""Positions of the thrusters, and their joint authority."""

from collections.abc import Iterator

import numpy as np

from undertow.core.measurement import BODY_AXES
from undertow.physics.plants.reachability import open_loop_advice
from undertow.physics.vehicles.facts import FRESH_WATER, Facts
from undertow.scenario.checks.finding import Finding, advice, error
from undertow.scenario.checks.vehicle_lint.transcription import printed_matrix

_ROUNDING = 5e-3
_STEP = np.pi / 12  # rad; angles of thrusters are multiples of it
_WORST_CONDITION = 10.0
_FARTHEST, _IMPOSSIBLE = 5.0, 20.0  # thruster arm per cube root of the volume; torpedoes have 2


def unit_directions(facts: Facts) -> Iterator[Finding]:
    """Directions have length 1."""
    for j, length in enumerate(np.linalg.norm(facts.directions, axis=1)):
        if not abs(length - 1) < _ROUNDING:
            key = f"thrusters[{j}].direction"
            yield error("direction", key, "have length 1", f"{length:.4g} long", "Divide it by its length")


def degrees(facts: Facts) -> Iterator[Finding]:
    """Angles are in degrees: not all of them are those of a protractor, in radians with three digits."""
    nonzero = {key: value for key, value in facts.angles.items() if value}
    steps = {key: value / _STEP for key, value in nonzero.items() if abs(value) <= 2 * np.pi and (2 * value) % 1}
    if nonzero and len(steps) == len(nonzero) and all(abs(n - round(n)) * _STEP < _ROUNDING for n in steps.values()):
        key, value = next(iter(nonzero.items()))
        angle = f"{np.degrees(_STEP) * round(steps[key]):g}"
        remark = ", and the other angles in degrees as well" if len(nonzero) > 1 else ""
        got, hint = f"{value:g}, which is {angle} degrees in radians", f"Write {angle}{remark}"
        if any(printed_matrix(facts)):
            yield error("degrees", key, "be in degrees", f"{got}, and `thruster_matrix` contradicts it", hint)
        else:
            yield advice("degrees", key, "be in degrees", got, hint)


def arms(facts: Facts) -> Iterator[Finding]:
    """Thrusters are on the vehicle."""
    if facts.size is None:
        side = np.cbrt(facts.displaced_mass / (facts.water_density or FRESH_WATER))
        share = facts.lever / side
        got = f"{facts.lever:.4g} m from the centre of gravity, {share:.3g} times the side of a cube of the volume"
        if share > _IMPOSSIBLE:
            yield error("arm", "thrusters", "sit on the vehicle", got, "Are the positions in mm?")
        elif share > _FARTHEST:
            yield advice("arm", "thrusters", "sit nearer to the vehicle", got, "Are the positions in metres?")
        return
    for j, position in enumerate(facts.positions):
        beyond = np.abs(position - facts.r_g) / facts.size  # half of the size is the side of the hull
        axis = int(np.argmax(beyond))
        if beyond[axis] > 0.6:
            side = ("length", "width", "height")[axis]
            key = f"thrusters[{j}].position"
            at = abs(position[axis] - facts.r_g[axis])
            got = f"{at:.3g} m from the centre of gravity, of a hull with a {side} of {facts.size[axis]:.3g} m"
            level = error if beyond[axis] > 5 else advice
            yield level("arm", key, "be on the hull", got, "Is it that of another vehicle, or in another unit?")


def rank(facts: Facts) -> Iterator[Finding]:
    """Directions without thrust, and the condition of the others; moments per longest arm."""
    for sentence in open_loop_advice("the thruster matrix", facts.thruster_matrix, BODY_AXES, "thruster"):
        yield Finding("advice", "rank", "thrusters", sentence)
        return
    left_vectors, sizes, _ = np.linalg.svd(scaled(facts.thruster_matrix))
    if sizes[0] > _WORST_CONDITION * sizes[5]:
        weakest = BODY_AXES[int(np.argmax(np.abs(left_vectors[:, 5])))]
        got = f"such that the best is pushed {sizes[0] / sizes[5]:.3g} times harder than the worst, {weakest}"
        yield advice("condition", "thrusters", "push all directions alike", got)


def same_line(facts: Facts) -> Iterator[Finding]:
    """Two thrusters on one line of action act as one: often a sign has been lost."""
    columns = scaled(facts.thruster_matrix).T
    for j in range(len(columns)):
        for i in range(j):
            turned = min(np.abs(columns[j] - columns[i]).max(), np.abs(columns[j] + columns[i]).max())
            if turned < 1e-3:
                got = f"on that of `thrusters[{i}]`"
                hint = "Has a direction or position lost a sign?"
                yield advice("same_line", f"thrusters[{j}]", "have a line of action of its own", got, hint)


def mirror(facts: Facts) -> Iterator[Finding]:
    """Symmetry: where most thrusters have a mirror image, one without is suspect."""
    columns = scaled(facts.thruster_matrix).T
    images = columns * np.array([1, -1, 1, -1, 1, -1])
    distance = np.minimum(*(np.abs(images[:, None] - sign * columns).max(axis=2) for sign in (1, -1)))
    alone = np.flatnonzero(distance.min(axis=1) > 0.02)
    if 0 < len(alone) <= len(columns) // 2 and len(columns) > 2:
        further = f", like {', '.join(f'`thrusters[{j}]`' for j in alone[1:])}" if len(alone) > 1 else ""
        key, got = f"thrusters[{alone[0]}]", f"without one{further}, of {len(columns)} thrusters"
        hint = "The others have one: is a sign or a number wrong?"
        yield advice("mirror", key, "have a mirror image on the other side", got, hint)


def scaled(matrix: np.ndarray) -> np.ndarray:
    """The matrix with its moment rows divided by their largest arm, so that all entries are pure numbers."""
    longest = np.abs(matrix[3:]).max()
    return np.concatenate([matrix[:3], matrix[3:] / (longest if longest > 0 else 1.0)])


RULES = (degrees, unit_directions, arms)
OF_DIRECTIONS = (rank, same_line, mirror, printed_matrix)
