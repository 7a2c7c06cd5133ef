"""The parts that the pages build, with a plausible mistake in each: `undertow check` says what the page says it says."""

import pytest
from test_blocks import FILE, ROOT, blocks

from undertow.cli.main import run

# Page, its file, what is replaced by what, and the line that follows.
MISTAKES = [
    (
        "thruster",
        "bench_thruster",
        "return jnp.interp(self.terminal(voltage), self.volts, self.newtons)",
        "return -jnp.interp(self.terminal(voltage), self.volts, self.newtons)",
        "Error: `thrust` must be positive at +12 V, but is -40 N",
    ),
    (
        "thruster",
        "bench_thruster",
        "self.volts, self.newtons)",
        "self.volts, self.newtons).sum()",
        "Error: `thrust` must give arrays of shape (3,), but is of shape ()",
    ),
    (
        "thruster",
        "bench_thruster",
        "def current(",
        "def amps(",
        "Error: `THING` must be something that can be made, but is not: BenchThruster without current",
    ),
    (
        "thruster",
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
        "Error: `acceleration` must fall with the wrench of the load, but is 12.5 for a unit of it on angle. ",
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
        "Error: `THING` must be something that can be made, but is not: Pendulum without power",
    ),
    (
        "disturbance",
        "my_disturbance",
        "return with_water(calm, place, velocity * east, -velocity * since / self.width * east)",
        "return calm._replace(wrench=velocity * jnp.ones(6))",
        "Error: `at` must agree with what was there already: add to `calm.wrench`, but is 0 instead of 4 in entry 6",
    ),
    (
        "disturbance",
        "my_disturbance",
        "return with_water(calm, place, velocity * east, -velocity * since / self.width * east)",
        "return velocity * east",
        "Error: `at` must give a Load, but is an array of shape (3,)",
    ),
    (
        "disturbance",
        "my_disturbance",
        "jax.random.uniform(key)",
        "__import__('random').random()",
        "Error: `draw` must give the same path for the same key, but is another one",
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
        "Error: `Wash` must be usable as its contract says, but is not: TypeError: add got incompatible shapes",
    ),
    (
        "navigation",
        "altimeter",
        "motion.position[2:]",
        "motion.position[2]",
        "Error: `reading` must give an array of one axis, but is of shape ()",
    ),
    (
        "navigation",
        "altimeter",
        "set(self.bottom - reading[0] - then)",
        "set(reading[0] - then)",
        "Error: `correct` must agree with the position, where the reading tells nothing new, but is 2.208 instead of "
        "0.26 in entry 3",
    ),
    (
        "navigation",
        "altimeter",
        "set(self.bottom - reading[0] - then)",
        "set(then + reading[0] - self.bottom)",
        "Error: `correct` must move the position towards the reading, but is from 0.374 to 0.399 off",
    ),
]


@pytest.mark.parametrize(("page", "file", "right", "wrong", "said"), MISTAKES)
def test_mistake(page, file, right, wrong, said, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    path = ROOT / "docs" / f"your-own-{page}.md"
    (code,) = [block.code for block in blocks(path) if (at := FILE.match(block.code)) and at["name"] == f"{file}.py"]
    assert right in code
    (tmp_path / f"{file}.py").write_text(code.replace(right, wrong))
    assert run(["check", f"{file}.py:{file}"]) == (2 if said.startswith("Error") else 0)
    out, err = capsys.readouterr()
    assert any(line.startswith(said) for line in (out + err).splitlines()), out + err
    assert f"    {said}" in path.read_text()


def test_line_of_ones_own_file_is_named(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "mine.py").write_text("def mine():\n    power = 1\n    return power / 0\n")
    assert run(["check", "mine.py:mine"]) == 2
    said = "Error: `THING` must be something that can be made, but is not: ZeroDivisionError: division by zero, mine.py"
    assert capsys.readouterr().err.startswith(f"{said} line 3")


@pytest.mark.parametrize("part", ["thrusters", "sensors", "navigation"])
def test_the_catalogue_keeps_its_own_contracts(part, capsys):
    from undertow.core import catalogue

    for name in catalogue.names(part):
        assert run(["check", f"{part}/{name}"]) == 0, capsys.readouterr().out
