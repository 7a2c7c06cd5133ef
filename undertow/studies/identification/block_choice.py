"""Which blocks an experiment consists of: greedy choice, then exchanges, by the deviations that they leave."""

from collections.abc import Sequence

import numpy as np

HALF = 0.5  # of the deviation beforehand
_AIM = 0.45  # a deviation above this counts more, so that each that can be halved is
_WEIGHT = 3.0  # of that
_PASSES = 4  # of exchanges


def shares_left(information: np.ndarray, of_interest: Sequence[int]) -> np.ndarray:
    """Deviations of unknowns of interest as shares of those beforehand.

    Args:
        information: of the data alone; beforehand it is the identity.
        of_interest: numbers of the unknowns.
    """
    covariance = np.linalg.inv(information + np.eye(len(information)))
    return np.sqrt(np.diagonal(covariance)[list(of_interest)])


def loss(information: np.ndarray, of_interest: Sequence[int], can_be_halved: np.ndarray) -> float:
    """What a choice makes small: log-determinant of the covariance, and deviations that are not halved.

    Args:
        information: of the data.
        of_interest: numbers of the unknowns.
        can_be_halved: which of these can.
    """
    covariance = np.linalg.inv(information + np.eye(len(information)))
    indices = list(of_interest)
    block = covariance[np.ix_(indices, indices)]
    shares = np.sqrt(np.diagonal(block))
    missing = np.maximum(0.0, np.log(shares / _AIM))[can_be_halved].sum()
    return float(np.linalg.slogdet(block)[1] / 2 + _WEIGHT * missing)


def least_shares(information: np.ndarray, of_interest: Sequence[int], slots: int) -> np.ndarray:
    """Smallest share that a candidate in all slots, or a mixture of all candidates, leaves of each deviation.

    Args:
        information: of each candidate, (candidates, P, P).
        of_interest: numbers of the unknowns.
        slots: number of blocks of the experiment.
    """
    designs = [slots * candidate for candidate in information]
    designs.append(slots * information.mean(axis=0))
    return np.min([shares_left(design, of_interest) for design in designs], axis=0)


def greedy_choice(information: np.ndarray, of_interest: Sequence[int], slots: int) -> list[int]:
    """Numbers of the candidates, one per slot; a candidate may be taken several times.

    Args:
        information: of each candidate, (candidates, P, P).
        of_interest: numbers of the unknowns.
        slots: number of blocks.
    """
    can_be_halved = least_shares(information, of_interest, slots) < HALF
    losses = lambda base: np.array([loss(base + candidate, of_interest, can_be_halved) for candidate in information])
    chosen: list[int] = []
    total = np.zeros(information.shape[1:])
    for _ in range(slots):
        best = int(np.argmin(losses(total)))
        chosen.append(best)
        total = total + information[best]
    for _ in range(_PASSES):
        changed = False
        for slot, current in enumerate(chosen):
            others = total - information[current]
            values = losses(others)
            best = int(np.argmin(values))
            if values[best] < values[current] - 1e-9:
                chosen[slot], total, changed = best, others + information[best], True
        if not changed:
            break
    return chosen
