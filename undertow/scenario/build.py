"""From a scenario to a closed loop ready to run."""

from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp

from undertow.core import checks, runtime
from undertow.core.errors import BadInput
from undertow.loop.closed_loop import ClosedLoop
from undertow.scenario import parts
from undertow.scenario.reading import Text, from_data
from undertow.scenario.schema import Scenario, validate

# A record takes about a kilobyte, a sampling time some microseconds.
MOST_RECORDS = 1_000_000
MOST_TICKS = 2_000_000_000


class Built(NamedTuple):
    """A scenario turned into objects."""

    closed_loop: ClosedLoop
    scenario: Scenario
    resolved: dict[str, Any]  # the scenario with every default filled in

    def advice(self) -> tuple[str, ...]:
        """What is odd about it, though it can be run."""
        window, loop = self.scenario.steady, self.scenario.loop
        late = f"the steady window starts at {window.start:g} s, the run ends at {loop.duration:g} s: no steady metrics"
        return self.closed_loop.plant.advice() + ((late,) if window.start >= loop.duration else ())


def build(source: Text | Mapping[str, Any]) -> Built:
    """Objects described by a scenario.

    Args:
        source: a scenario as read from a file, or as Python data.

    Raises:
        BadInput: anything wrong with it, with key path and place.
    """
    text = source if isinstance(source, Text) else from_data(source)
    scenario = validate(text)
    if scenario.precision == "float32":
        runtime.use_single_precision()
    resolved = scenario.model_dump(include={"description", "loop", "initial", "steady", "seed", "precision"})

    def make(key: str, given: tuple = ()) -> Any:
        description = getattr(scenario, key).model_dump()
        kind = f"{key}s"
        part, resolved[key] = _placed(text, key, lambda: parts.make(kind, description, text.folder, given))
        return part

    plant = make("plant")
    model, resolved["model"] = _placed(text, "model", lambda: parts.call(plant.model, scenario.model))
    controller = make("controller", (model,))
    loop = ClosedLoop(plant, controller, make("reference"), make("disturbance"), make("sensor"))
    _check_times(text, scenario)
    _check_fit(text, loop, scenario)
    return Built(loop, scenario, resolved)


def _placed(text: Text, key: str, make: Callable[[], Any]) -> Any:
    """Result of `make`; its complaints with the key path and place in the scenario file."""
    try:
        return make()
    except BadInput as error:
        complaint = error.at(key)
        path = tuple(part.split("[")[0] for part in complaint.name.split("."))
        raise complaint.at(where=text.where(path)) from None


def _check_times(text: Text, scenario: Scenario) -> None:
    window, loop = scenario.steady, scenario.loop
    if not window.start < window.stop:
        must, got = f"be later than steady.start ({window.start:g} s)", f"{window.stop:g} s"
        raise BadInput("steady.stop", must, got, where=text.where(("steady", "stop")))
    shortest = max(loop.record, loop.dt if loop.kind == "sampled" else 0.0)
    if loop.duration < shortest:
        must, got = f"be at least one record ({shortest:g} s)", f"{loop.duration:g} s"
        raise BadInput("loop.duration", must, got, where=text.where(("loop", "duration")))
    if loop.duration / loop.record > MOST_RECORDS:
        must = f"keep the run to {MOST_RECORDS} records: at least {loop.duration / MOST_RECORDS:g} s"
        raise BadInput("loop.record", must, f"{loop.record:g} s", where=text.where(("loop", "record")))
    if loop.kind == "sampled" and loop.duration / loop.dt > MOST_TICKS:
        must = f"keep the run to {MOST_TICKS} sampling times: at least {loop.duration / MOST_TICKS:g} s"
        raise BadInput("loop.dt", must, f"{loop.dt:g} s", where=text.where(("loop", "dt")))
    ratio = loop.record / loop.dt
    if loop.kind == "sampled" and (round(ratio) < 1 or abs(ratio - round(ratio)) > 1e-6 * ratio):
        must, got = f"be a whole number of sampling times ({loop.dt:g} s)", f"{loop.record:g} s"
        raise BadInput("loop.record", must, got, where=text.where(("loop", "record")))


def _check_fit(text: Text, loop: ClosedLoop, scenario: Scenario) -> None:
    """Whether the parts fit together: shapes only, nothing is computed."""
    axes, zero = len(loop.plant.outputs), jnp.zeros(())
    per_output = f"{axes}, one per output of the plant"
    for key in ("position", "velocity"):
        value = getattr(scenario.initial, key)
        if value is not None:
            _placed(text, f"initial.{key}", lambda value=value: checks.length("", value, axes, per_output))
            _placed(text, f"initial.{key}", lambda value=value: checks.finite("", value))
    target = _placed(text, "reference", lambda: jax.eval_shape(loop.reference.at, zero))
    if target.position.shape != (axes,):
        got = f"of shape {target.position.shape}"
        where = text.where(("reference", "position"))
        raise BadInput("reference.position", f"have {axes} entries, one per output of the plant", got, where=where)
    drawn = jax.eval_shape(loop.draw, jax.random.PRNGKey(0))
    load = _placed(text, "disturbance", lambda: jax.eval_shape(lambda d: d.load(zero), drawn))
    if any(signal.shape != (axes,) for signal in load):
        got = f"of shapes {[signal.shape for signal in load]}"
        raise BadInput("disturbance", f"have {axes} axes", got, where=text.where(("disturbance",)))

    def first_step(drawn: Any) -> Any:
        x, z = drawn.start()
        return drawn.decide(zero, x, z)

    _placed(text, "controller", lambda: jax.eval_shape(first_step, drawn))
