"""How environments show their numbers to an agent: precision, size of observations, and the reward."""

from typing import Any, NamedTuple

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from undertow.control.controllers.policy_interface import PolicyInterface
from undertow.core import checks

REWARDS = ("negative_cost", "bounded")


class AgentInterface(NamedTuple):
    """How numbers are shown.

    Attributes:
        interface: meaning of observations and actions.
        dtype: of observations and spaces.
        normalised: whether observations are within [-1, 1]: x / (1 + |x|) of errors and velocities, in m, rad and s,
            and actions as shares of their bounds.
        reward: `negative_cost`, or `bounded`: 1 / (1 + cost), within (0, 1], so that every step that is survived counts
            and large errors do not swamp small ones.
    """

    interface: PolicyInterface
    dtype: Any
    normalised: bool
    reward: str

    def spaces(self) -> tuple[Any, Any]:
        """Spaces of observations and of actions."""
        low, high = self.interface.action_bounds()
        bounds = self.interface.bounds()
        limits = np.concatenate([-bounds, low]), np.concatenate([bounds, high])
        if self.normalised:
            limits = -np.ones_like(limits[0]), np.ones_like(limits[1])
        box = lambda low, high: spaces.Box(low.astype(self.dtype), high.astype(self.dtype), dtype=self.dtype)
        return box(*limits), box(low, high)

    def observation(self, values: NDArray[Any]) -> NDArray[Any]:
        """Observations as shown, of one environment or of many."""
        if self.normalised:
            low, high = self.interface.action_bounds()
            measured, action = np.split(values, [len(self.interface.bounds())], axis=-1)
            large = self.interface.bounds() > 1.0  # an attitude is within [-1, 1] as it is
            measured = np.where(large, measured / (1 + np.abs(measured)), measured)
            values = np.concatenate([measured, action / np.maximum(-low, high)], axis=-1)
        return values.astype(self.dtype)

    def rewards(self, values: NDArray[Any]) -> NDArray[Any]:
        """Rewards as shown, from negative costs."""
        return values if self.reward == "negative_cost" else 1 / (1 - values)


def agent_interface(
    interface: PolicyInterface, dtype: Any, float32: bool, normalised: bool, reward: str
) -> AgentInterface:
    """How numbers are shown.

    Raises:
        BadInput: there is no such reward.
    """
    checks.choice("reward", reward, REWARDS)
    return AgentInterface(interface, np.dtype("float32") if float32 else dtype, normalised, reward)
