"""A policy, learned or written by hand, as a controller: a function of an observation that gives an action."""

import io
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Annotated

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from undertow.control.controllers.policy_interface import Action, Observation, PolicyInterface, policy_interface_of
from undertow.core import catalogue
from undertow.core.contracts import AbstractController, Measurement, Model, Target
from undertow.core.errors import BadInput
from undertow.core.numerics.linear_algebra import matvec
from undertow.core.signals import Signal

_LARGEST = 2**26  # bytes of the arrays of a network: small files can be made that unpack to any size
_LAYER = "weight_{}", "bias_{}"


class Network(eqx.Module):
    """A multilayer perceptron with tanh between its layers."""

    weights: tuple[Float[Array, "out in"], ...]
    biases: tuple[Float[Array, " out"], ...]

    def __call__(self, values: Observation) -> Action:
        for weight, bias in zip(self.weights[:-1], self.biases[:-1], strict=True):
            values = jnp.tanh(matvec(weight, values) + bias)
        return matvec(self.weights[-1], values) + self.biases[-1]


class Function(eqx.Module):
    """A function that somebody wrote."""

    function: Callable[[Observation], Action] = eqx.field(static=True)

    def __call__(self, observation: Observation) -> Action:
        return jnp.asarray(self.function(observation), dtype=observation.dtype)


class Policy(AbstractController):
    """u = command(act(observation)); its only state is the action before."""

    model: Model
    interface: PolicyInterface
    act: Network | Function

    def init(self, y: Measurement, r: Target) -> Action:
        return self.interface.first()

    def command(self, z: Action, y: Measurement, r: Target):
        action = self._action(z, y, r)
        return self.interface.command(action), {"action": action}

    def advance(self, z: Action, y: Measurement, r: Target, u_applied, dt) -> Action:
        return self._action(z, y, r)

    def signals(self):
        dimension = "action_axis" if self.interface.kind == "wrench" else "actuator"
        unit = "[input]" if self.interface.kind == "input" else "1"
        return {"action": Signal((dimension,), unit, "action of the policy, within its bounds")}

    def _action(self, z: Action, y: Measurement, r: Target) -> Action:
        return self.interface.within_bounds(self.act(self.interface.observation(y, r, z)))


def policy(model: Model, function: Annotated[str, catalogue.FILE], action: str = "normalised", scale=None) -> Policy:
    """A policy, learned or written by hand: a function that takes an observation and gives an action.

    Observation and action are those of the environments of `undertow.outside.gymnasium`, see
    `undertow.control.controllers.policy_interface.PolicyInterface`. Actions are cut off at their bounds.

    Args:
        model: nominal model, from `plant.model()`.
        function: ./file.py:function, in terms of jax.numpy; or an .npz file of a network with tanh between its layers,
            weight_0 (of shape out, in), bias_0, weight_1, and so on.
        action: normalised (one number per actuator within [-1, 1]), input (one input per actuator in its unit), or
            wrench (six numbers within [-1, 1]).
        scale: input that a normalised action of 1 stands for, in the unit of the input; None for its limit, or the
            input for a force of 1 where there is none.

    Raises:
        BadInput: no such function or file, a network that does not fit, or an action of another length.
    """
    interface = policy_interface_of(model, action, scale)
    act = _found(function)
    zero = jnp.zeros(len(model.coordinates.angles))
    at_rest = model.coordinates.measurement(zero, zero)
    observation = interface.observation(at_rest, Target(zero, zero, zero), interface.first())
    if isinstance(act, Network) and act.weights[0].shape[1] != observation.size:
        raise BadInput(
            "function", f"take an observation of {observation.size} entries", f"a network of {act.weights[0].shape[1]}"
        )
    shape = jax.eval_shape(act, observation).shape
    if shape != (interface.actions,):
        raise BadInput("function", f"give an action of shape ({interface.actions},)", f"one of shape {shape}")
    return Policy(model, interface, act)


def _found(name: str) -> Network | Function:
    if Path(name).suffix == ".npz":
        return _network(Path(name))
    if not catalogue.is_user_code(name):
        raise BadInput("function", "be ./file.py:function, or an .npz file of a network", name)
    return Function(catalogue.find("controllers", name, what="function"))


def _network(path: Path) -> Network:
    """The network of a file.

    Raises:
        BadInput: it cannot be read, or its layers do not fit.
    """
    try:
        buffer = io.BytesIO(path.read_bytes())
        with zipfile.ZipFile(buffer) as file:
            size = sum(entry.file_size for entry in file.infolist())
        if size > _LARGEST:
            raise ValueError(f"its arrays have {size} bytes, more than the {_LARGEST} that are read")
        buffer.seek(0)
        with np.load(buffer, allow_pickle=False) as file:
            arrays = {name: file[name] for name in file.files}
    except Exception as error:  # whatever the readers of zip files and of arrays raise
        raise BadInput("function", "be an .npz file of numbers", f"{path.name}: {error}") from None
    count = len(arrays) // 2
    names = [name.format(number) for number in range(count) for name in _LAYER]
    if not arrays or sorted(arrays) != sorted(names):
        raise BadInput("function", "hold weight_0, bias_0, weight_1, ...", ", ".join(sorted(arrays)) or "empty")
    if any(array.dtype.kind not in "fiu" or not np.isfinite(array).all() for array in arrays.values()):
        raise BadInput("function", "hold finite numbers", f"of {path.name}")
    weights, biases = ([arrays[name.format(number)] for number in range(count)] for name in _LAYER)
    inputs = weights[0].shape[-1] if weights[0].ndim else 0
    for number, (weight, bias) in enumerate(zip(weights, biases, strict=True)):
        if weight.ndim != 2 or bias.shape != weight.shape[:1] or weight.shape[1] != inputs or not weight.size:
            shapes = f"of shapes {weight.shape} and {bias.shape} in layer {number}, after {inputs} numbers"
            raise BadInput("function", "hold weights of shape (out, in) and biases of shape (out,) that fit", shapes)
        inputs = weight.shape[0]
    as_arrays = lambda arrays: tuple(jnp.asarray(array, dtype=float) for array in arrays)
    return Network(as_arrays(weights), as_arrays(biases))
