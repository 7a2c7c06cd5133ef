"""States of a linear system that matter to it: without those that only observe, attitudes as three angles."""

import itertools
import re
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
import scipy.linalg
from numpy.typing import NDArray

from undertow.core.numerics.rotations import euler_from_rotation, quaternion_from_euler, rotation_from_quaternion

_QUATERNION = re.compile(r"(?P<prefix>.*)attitude_1")
_ANGLES = ("roll", "pitch", "yaw")
_NUMBER = re.compile(r"_\d+$")

# Of the largest entry of a row: less is left over by rounding.
_ROUNDING = 1e-9


class StateSpaceMatrices(NamedTuple):
    """Matrices of a linear system, and the names of its states."""

    a: NDArray
    b: NDArray
    c: NDArray
    names: list[str]

    def in_coordinates(self, forth: NDArray, back: NDArray, names: list[str]) -> "StateSpaceMatrices":
        """The system in states forth @ x, where back @ forth @ x is x, or differs from it in nothing that is seen."""
        return StateSpaceMatrices(forth @ self.a @ back, forth @ self.b, self.c @ back, names)


def seen(system: StateSpaceMatrices) -> StateSpaceMatrices:
    """The system without what no output follows from.

    These are states (counters, ledgers), and combinations of states with the same name, such as those differences of
    weights of a law that do not act; what remains of such a group is numbered anew.
    """
    system = _acting(system)
    stems = [_NUMBER.sub("", name) for name in system.names]
    bases = [
        _seen_of_group(system, np.array([stem_of_state == stem for stem_of_state in stems]))
        for stem in dict.fromkeys(stems)
    ]
    basis = np.hstack(bases)
    names = []
    for stem, group in zip(dict.fromkeys(stems), bases, strict=True):
        names_of_group = [name for name, stem_of_name in zip(system.names, stems, strict=True) if stem_of_name == stem]
        names += names_of_group[: group.shape[1]]
    return system.in_coordinates(basis.T, basis, names)


def with_angles(system: StateSpaceMatrices, values: NDArray) -> StateSpaceMatrices:
    """The system with angles in place of unit quaternions, which are four states `attitude_1`, ... after any prefix.

    Args:
        system: in a state with quaternions.
        values: of its states, about which it is linear.
    """
    forth, back, names = [], [], []
    columns = np.eye(len(system.names))
    indices = iter(range(len(system.names)))
    for index in indices:
        match = _QUATERNION.fullmatch(system.names[index])
        if match is None:
            forth.append(columns[[index]])
            back.append(columns[:, [index]])
            names.append(system.names[index])
            continue
        quaternion = slice(index, index + 4)
        next(itertools.islice(indices, 2, 3))
        to_angles, to_quaternion = map(np.asarray, _slopes(jnp.asarray(values[quaternion])))
        forth.append(to_angles @ columns[quaternion])
        back.append(columns[:, quaternion] @ to_quaternion)
        names += [f"{match['prefix']}{angle}" for angle in _ANGLES]
    return system.in_coordinates(np.vstack(forth), np.hstack(back), names)


@jax.jit
def _slopes(quaternion):
    """Slopes of Euler angles by the quaternion, and of the quaternion by the angles."""
    angles_of = lambda q: euler_from_rotation(rotation_from_quaternion(q))
    angles = angles_of(quaternion)
    sign = jnp.sign(quaternion_from_euler(angles) @ quaternion)  # each attitude has two quaternions
    return jax.jacfwd(angles_of)(quaternion), sign * jax.jacfwd(quaternion_from_euler)(angles)


def _acting(system: StateSpaceMatrices) -> StateSpaceMatrices:
    """The system in the states from which an output follows, directly or through other states."""
    acts = (system.c != 0).any(axis=0)
    while True:
        further = acts | (system.a[acts] != 0).any(axis=0)
        if (further == acts).all():
            break
        acts = further
    names = [name for name, stays in zip(system.names, acts, strict=True) if stays]
    return StateSpaceMatrices(system.a[np.ix_(acts, acts)], system.b[acts], system.c[:, acts], names)


def _seen_of_group(system: StateSpaceMatrices, group: NDArray) -> NDArray:
    """Orthonormal columns, of all states, that span what is seen of a group of states; the states where all is."""
    columns = np.eye(len(system.names))[:, group]
    rows = np.vstack([system.c, system.a[~group]])
    rows = rows / np.maximum(np.abs(rows).max(axis=1, keepdims=True), np.finfo(float).tiny)
    unseen = _null_space(rows[:, group])
    a_group = system.a[np.ix_(group, group)]
    # What nothing reads directly may be read later: directions that A turns into others are dropped, until A maps the
    # rest into itself. That is the unobservable subspace of the group.
    while unseen.shape[1]:
        leaving = a_group @ unseen - unseen @ (unseen.T @ a_group @ unseen)
        stays = _null_space(leaving / max(np.abs(a_group).max(), np.finfo(float).tiny))
        if stays.shape[1] == unseen.shape[1]:
            return columns @ scipy.linalg.null_space(unseen.T)
        unseen = unseen @ stays
    return columns


def _null_space(matrix: NDArray) -> NDArray:
    """Orthonormal columns that a matrix takes to zero, but for rounding."""
    _, sizes, rows = np.linalg.svd(matrix)
    rank = int((sizes > _ROUNDING).sum())
    return rows[rank:].T
