"""The parts that the pages build, with a plausible mistake in each: `undertow check` says what the page says it says."""

import pytest
from test_blocks import FILE, ROOT, blocks

from undertow.cli.main import run

pytestmark = pytest.mark.docs

# Page, its file, what is replaced by what, and the line that follows.
MISTAKES = [
    (
        "reference",
        "my_reference",
        "Target(position, velocity, acceleration)",
        "Target(position, -velocity, acceleration)",
        "Error: `at` must agree with the rate of the position at 0.37 s, but is -0.2 instead of 0.2 in entry 1 "
        "(my_reference.py, line 22)",
    ),
    (
        "navigation",
        "my_navigation",
        "velocity=velocity), after",
        "velocity=velocity)",
        "Error: `measure` must return two values, the measurement and the state after it, but returns a Measurement "
        "(my_navigation.py, line 41)",
    ),
    (
        "navigation",
        "my_navigation",
        "return truth._replace(position=position, velocity=velocity), after",
        "return position, after",
        "Error: `measure` must give a Measurement, but is an array of shape (6,) (my_navigation.py, line 41)",
    ),
    (
        "navigation",
        "my_navigation",
        "state.count + 1)",
        "(state.count + 1)[None])",
        "Error: `measure` must return the state in the form that `init` gives it, but is of shape (1,) instead of () in "
        "`count` (my_navigation.py, line 41)",
    ),
    (
        "controller",
        "my_controller",
        "(AbstractController):",
        "(__import__('equinox').Module):",
        "Error: `my_controller` returns a `SlidingMode`, which is not a part (my_controller.py, line 11). ",
    ),
    (
        "controller",
        "my_controller",
        "def advance(",
        "def step(",
        "Error: Cannot instantiate `SlidingMode`: method `advance` is not implemented (my_controller.py, line 11)",
    ),
    (
        "controller",
        "my_controller",
        'return u, {"surface": s}',
        "return u",
        "Error: `command` must return two values, the input and the signals, but returns an array of shape (8,) "
        "(my_controller.py, line 26)",
    ),
    (
        "controller",
        "my_controller",
        "self.model.dynamics.invert(y, acceleration - self.model.dynamics.drift(y))",
        "acceleration - self.model.dynamics.drift(y)",
        "Error: `command` must return an input of shape (8,), one entry per input of the plant, but returns an array of "
        "shape (6,) (my_controller.py, line 26). ",
    ),
    (
        "controller",
        "my_controller",
        "self.model.dynamics.invert(y, acceleration - self.model.dynamics.drift(y))",
        "self.model.dynamics.invert(y, acceleration) if s[0] > 0 else jnp.zeros(8)",
        "Error: Cannot run `SlidingMode.command`: Python's `if`, `while`, `and`, `or`, `not`, `min` or `max` needs the "
        "value of a traced array (my_controller.py, line 29). Use `jnp.where(condition, a, b)`, `jnp.minimum` or "
        "`jnp.maximum`",
    ),
    (
        "controller",
        "my_controller",
        "jnp.clip(s / self.layer, -1, 1)",
        "__import__('numpy').tanh(s / self.layer)",
        "Error: Cannot run `SlidingMode.command`: NumPy needs the value of a traced array (my_controller.py, line 28). "
        "Use `jax.numpy`",
    ),
    (
        "controller",
        "my_controller",
        "        return z + dt",
        "        self.integral = z + dt",
        "Error: Cannot run `SlidingMode.advance`: it assigns `self.integral`, but a part holds parameters only "
        "(my_controller.py, line 34). ",
    ),
    (
        "controller",
        "my_controller",
        "return jnp.zeros_like(y.position)",
        "return 0.0",
        "Error: `advance` must return the state in the form that `init` gives it, but is of shape (6,) instead of () "
        "(my_controller.py, line 32)",
    ),
    (
        "controller",
        "my_controller",
        "self.model.dynamics.invert(y, acceleration - self.model.dynamics.drift(y))",
        "self.model.dynamics.invert(y, self.model.dynamics.drift(y) - acceleration)",
        "Advice: `command` should bring a double integrator, x_ddot = u, back to the origin, but is unstable there: the "
        "linearised closed loop has a spectral radius of",
    ),
    (
        "thruster-class",
        "bench_thruster",
        "return jnp.interp(self.terminal(voltage), self.volts, self.newtons)",
        "return -jnp.interp(self.terminal(voltage), self.volts, self.newtons)",
        "Error: `thrust` must be positive at +12 V, but is -40 N",
    ),
    (
        "thruster-class",
        "bench_thruster",
        "self.volts, self.newtons)",
        "self.volts, self.newtons).sum()",
        "Error: `thrust` must give arrays of shape (3,), but is of shape ()",
    ),
    (
        "thruster-class",
        "bench_thruster",
        "def current(",
        "def amps(",
        "Error: Cannot instantiate `BenchThruster`: method `current` is not implemented (bench_thruster.py, line 11)",
    ),
    (
        "thruster-class",
        "bench_thruster",
        "gain=3.0",
        "gain=30.0",
        "Advice: `voltage_gain` should be about the thrust per volt: it is the gain of the model that the controller "
        "inverts, but is 30 N/V where 12 V give 40 N",
    ),
    (
        "plant",
        "my_plant",
        "Measurement(x.angle, x.rate)",
        "Measurement(x.angle, 2 * x.rate)",
        "Error: `output` must agree with the rate of its position, but is 0.4 instead of 0.2 in entry 1",
    ),
    (
        "plant",
        "my_plant",
        "(u - d.wrench)",
        "(u + d.wrench)",
        "Error: `acceleration` must fall with the wrench of the load, but is 12.5 for a unit of it on angle ",
    ),
    (
        "plant",
        "my_plant",
        "return acceleration * self.inertia()",
        "return -acceleration * self.inertia()",
        "Error: `invert` must agree with `gain`: G G# a = a, but is -12.5 instead of 12.5 in entry 1",
    ),
    (
        "plant",
        "my_plant",
        "jnp.full((1, 1), 1 / self.inertia())",
        "-jnp.full((1, 1), 1 / self.inertia())",
        "Error: `gain` must push where the plant does, but is -12.5 where x_ddot changes by 12.5 per unit",
    ),
    (
        "plant",
        "my_plant",
        "def power(self, x, u)",
        "def watts(self, x, u)",
        "Error: Cannot instantiate `Pendulum`: method `power` is not implemented (my_plant.py, line 42)",
    ),
    (
        "disturbance",
        "my_disturbance",
        "return with_water(load, pose, velocity * east, -velocity * since / self.width * east)",
        "return load._replace(wrench=velocity * jnp.ones(6))",
        "Error: `at` must agree with what was there already: add to `load.wrench`, but is 0 instead of 4 in entry 6",
    ),
    (
        "disturbance",
        "my_disturbance",
        "return with_water(load, pose, velocity * east, -velocity * since / self.width * east)",
        "return velocity * east",
        "Error: `at` must give a Load, but is an array of shape (3,)",
    ),
    (
        "disturbance",
        "my_disturbance",
        "jax.random.uniform(key)",
        "__import__('random').random()",
        "Error: `realize` must give the same realization for the same key, but is another one",
    ),
    (
        "disturbance",
        "my_disturbance",
        "return ()",
        "return (0.0, 4.0, 40.0)",
        "Error: `jumps` must be a tuple of times between 0 and the duration, but is (0.0, 4.0, 40.0) for 10 s",
    ),
    (
        "disturbance",
        "my_disturbance",
        "jnp.array([0.0, 1.0, 0.0])",
        "jnp.zeros(6)",
        "Error: Cannot run `Wash.at`: TypeError: add got incompatible shapes",
    ),
    (
        "sensor",
        "altimeter",
        "motion.position[2:]",
        "motion.position[2]",
        "Error: `reading` must give an array of one axis, but is of shape ()",
    ),
    (
        "sensor",
        "altimeter",
        "self.bottom - motion.position[2:]",
        "(motion.position[2:] - motion.position[2:]) ** 0.5",
        "Error: `reading` must have finite derivatives, which a Kalman filter needs, but is not differentiable",
    ),
    (
        "sensor",
        "altimeter",
        "self.bottom - motion.position[2:]",
        "self.bottom + 0 * motion.position[2:]",
        "Error: `reading` must depend on the motion, but is constant in entry 1: no filter can use it",
    ),
]


@pytest.mark.parametrize(("page", "file", "right", "wrong", "said"), MISTAKES)
def test_mistake(page, file, right, wrong, said, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    path = ROOT / "docs" / "how-to" / f"your-own-{page}.md"
    (code,) = [block.code for block in blocks(path) if (at := FILE.match(block.code)) and at["name"] == f"{file}.py"]
    assert right in code
    (tmp_path / f"{file}.py").write_text(code.replace(right, wrong))
    assert run(["check", f"{file}.py:{file}"]) == (2 if said.startswith("Error") else 0)
    out, err = capsys.readouterr()
    assert any(line.startswith(said) for line in (out + err).splitlines()), out + err
    assert f"    {said.rstrip()}" in path.read_text()


def test_line_of_ones_own_file_is_named(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "mine.py").write_text("def mine():\n    power = 1\n    return power / 0\n")
    assert run(["check", "mine.py:mine"]) == 2
    assert (
        capsys.readouterr().err == "Error: Cannot run `mine`: ZeroDivisionError: division by zero (mine.py, line 3)\n"
    )


@pytest.mark.parametrize("part", ["thrusters", "sensors", "navigation"])
def test_the_catalogue_keeps_its_own_contracts(part, capsys):
    from undertow.core import catalogue

    for name in catalogue.names(part):
        assert run(["check", f"{part}/{name}"]) == 0, capsys.readouterr().out
