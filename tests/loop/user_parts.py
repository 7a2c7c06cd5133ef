"""Parts for the inverted pendulum as users would write them, nothing in mind but JAX."""

from collections.abc import Callable

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from undertow.core.contracts import AbstractController, AbstractDisturbance, AbstractNavigation, Measurement
from undertow.core.signals import Signal


class KalmanFilter(AbstractNavigation):
    """Position and velocity of a double integrator, observed with an error; the gain is solved for at every step."""

    smooth: bool = False

    def realize(self, key):
        return ()

    def init(self, path, truth):
        return jnp.stack([truth.position[0], truth.velocity[0]]), 0.1 * jnp.eye(2)

    def measure(self, path, state, t, truth):
        estimate, covariance = state
        step = jnp.array([[1.0, 1e-3], [0.0, 1.0]])
        estimate, covariance = step @ estimate, step @ covariance @ step.T + jnp.diag(jnp.array([1e-8, 1e-4]))
        seen = jnp.stack([truth.position[0] + 1e-4 * jnp.sin(900 * t), truth.velocity[0]])
        gain = jnp.linalg.solve(covariance + 1e-4 * jnp.eye(2), covariance).T
        estimate = estimate + gain @ (seen - estimate)
        covariance = (jnp.eye(2) - gain) @ covariance
        return Measurement(estimate[:1], estimate[1:]), (estimate, covariance)


class Learned(AbstractNavigation):
    """An error that a network makes of what it sees: 3 inputs, two layers of 64, one output."""

    smooth: bool = True

    def realize(self, key):
        return ()

    def init(self, path, truth):
        return ()

    def measure(self, path, state, t, truth):
        x = jnp.stack([jnp.sin(30 * t), *truth.position, *truth.velocity])
        for layer in LAYERS:
            x = jnp.tanh(layer @ x)
        return Measurement(truth.position + 1e-3 * x, truth.velocity), state


class PredictiveControl(AbstractController):
    """A box-constrained quadratic program over ten steps, by forty projected gradients."""

    model: object

    def init(self, y, r):
        return jnp.zeros(())

    def command(self, z, y, r):
        dt, size = 0.02, 10
        k = jnp.arange(size)
        reach = jnp.tril(jnp.ones((size, size))) * dt * dt * (k[:, None] - k[None, :] + 0.5)
        free = y.position[0] - r.position[0] + dt * jnp.arange(1, size + 1) * (y.velocity[0] - r.velocity[0])
        hessian, linear = reach.T @ reach + 1e-7 * jnp.eye(size), reach.T @ free
        pace = 1.0 / jnp.trace(hessian)
        step = lambda i, u: jnp.clip(u - pace * (hessian @ u + linear), -30.0, 30.0)
        wanted = jax.lax.fori_loop(0, 40, step, jnp.zeros(size))[:1] - 4.0 * (y.velocity - r.velocity)
        return self.model.dynamics.invert(y, wanted - self.model.dynamics.drift(y)), {"wanted": wanted}

    def signals(self):
        return {"wanted": Signal(("axis",), "[axis]/s^2", "acceleration that the program asks for")}

    def advance(self, z, y, r, u_applied, dt):
        return z


class Push(AbstractDisturbance):
    """A function of time as a disturbance."""

    function: Callable = eqx.field(static=True)

    def realize(self, key):
        return ()

    def at(self, path, t, place, calm):
        return calm._replace(acceleration=calm.acceleration + self.function(t))

    def jumps(self, duration):
        return ()


class Realization(AbstractDisturbance):
    """Something random that needs eigenvalues, and has a part of no entries."""

    def realize(self, key):
        matrix = jax.random.normal(key, (4, 4))
        return jnp.linalg.eigvalsh(matrix + matrix.T), jnp.zeros((0, 3))

    def at(self, path, t, place, calm):
        return calm._replace(acceleration=calm.acceleration + 0.1 * path[0][:1] + path[1].sum())

    def jumps(self, duration):
        return ()


TIMES = np.linspace(0.0, 5.0, 500)
RNG = np.random.default_rng(8)
LAYERS = [RNG.normal(size=shape) / np.sqrt(shape[1]) for shape in ((64, 3), (64, 64), (1, 64))]


def _table(t):
    return jnp.interp(t, TIMES, np.sin(7 * TIMES) + np.cos(31 * TIMES))[None]


def _ordered(t):
    waves = jnp.sin(t * jnp.arange(1.0, 8.0))
    return waves[jnp.argsort(waves)][2:3] * jnp.argsort(waves)[0]


def _spectrum(t):
    return jnp.abs(jnp.fft.rfft(jnp.sin(t + 0.3 * jnp.arange(16.0))))[1:2] / 8


def _chosen(t):
    key = jax.random.fold_in(jax.random.PRNGKey(3), (1000 * t).astype(int))
    return jax.random.choice(key, jnp.array([-0.5, 0.0, 0.5]))[None] + 0.01 * jax.random.randint(key, (1,), 0, 10)


def _of_bytes(t):
    return (jnp.round(3 * jnp.sin(t)).astype(jnp.int8) / jnp.int8(4)).astype(t.dtype)[None]


def _field(t):
    """A field of 1000 harmonics."""
    return jnp.sin(jnp.arange(1.0, 1001.0) * t).sum()[None] / 100


def _by_python(t):
    return jax.pure_callback(lambda t: np.sin(np.asarray(t))[None], jax.ShapeDtypeStruct((1,), t.dtype), t)


def kalman():
    """A Kalman filter."""
    return KalmanFilter()


def network():
    """A network."""
    return Learned()


def predictive(model):
    """Model predictive control."""
    return PredictiveControl(model)


def pushed(by: str):
    """A disturbance by the name of its function."""
    return Realization() if by == "drawn" else Push(globals()[f"_{by}"])
