"""The vehicle as C99: what it computes is a simulation's, by gcc and clang, and what cannot be exported is named."""

import shutil
import subprocess

import numpy as np
import pytest
from export.scenarios import HEAVY, ODIN, PENDULUM

import undertow as ut
from undertow.cli.main import run
from undertow.core.errors import BadInput
from undertow.outside.export.controller import export_controller
from undertow.outside.export.fmu import export_fmu
from undertow.outside.export.vehicle import export_vehicle
from undertow.scenario.build import build
from undertow.scenario.reading import dump

pytestmark = pytest.mark.compiler

COMPILERS = [name for name in ("gcc", "clang") if shutil.which(name)]
SANITIZED = "-O1 -fsanitize=undefined,address -fno-sanitize-recover=all"
RANDOM_CURRENT = {"kind": "gauss_markov_current", "span": 20, "step": 0.1}
WITH_BATTERY = {"vehicle": "bluerov2", "thruster": {"kind": "t200", "supply": 16}, "battery": "battery", "esc": "esc"}


def meets_its_test(scenario, folder, precision, flags=("-O2", SANITIZED)):
    """Export, compile and run the test of a vehicle, by every compiler."""
    export_vehicle(build(scenario), precision=precision).write(folder)
    for compiler in COMPILERS:
        for flag in flags:
            command = ["make", "clean", "test", f"CC={compiler}", f"CFLAGS={flag}"]
            done = subprocess.run(command, cwd=folder, capture_output=True, text=True)
            assert done.returncode == 0, done.stderr
            assert "0 of 50 steps differ" in done.stdout


def test_there_is_a_compiler():
    assert COMPILERS, "These tests need gcc or clang"


@pytest.mark.parametrize("precision", ["float64", "float32"])
def test_every_bit_is_that_of_the_batch_compiler(tmp_path, precision):
    meets_its_test(PENDULUM, tmp_path, precision)


@pytest.mark.slow
@pytest.mark.parametrize("precision", ["float64", "float32"])
@pytest.mark.parametrize(
    "scenario",
    [
        ODIN,
        HEAVY,
        HEAVY | {"disturbance": RANDOM_CURRENT},
        HEAVY | {"disturbance": ["random_suite", "parameter_error"]},
        HEAVY | {"plant": WITH_BATTERY},
    ],
    ids=["full motors", "waves", "random current", "wrong parameters", "battery"],
)
def test_vehicles_under_their_loads(tmp_path, scenario, precision):
    meets_its_test(scenario, tmp_path, precision)


DRIVER = """
#include <stdio.h>
#include "vehicle.h"

int main(void) {
    static vehicle_state state;
    vehicle_input input = vehicle_DEFAULTS;
    vehicle_output output;
    vehicle_start(&state, &input, &output);
    for (int k = 0; k < 400; ++k) {
        printf("%a\\n", output.motion_position[0]);
        input.command[0] = COMMANDS[k];
        input.t = k * vehicle_PERIOD;
        vehicle_step(&state, &input, &output);
    }
    return 0;
}
"""


def test_every_bit_is_that_of_a_simulation(tmp_path):
    """The commands of a simulated controller move the pendulum in C as they did there; its load is random."""
    record = ut.simulate_scenario(PENDULUM).dataset
    export_vehicle(build(PENDULUM)).write(tmp_path)
    commands = ", ".join(float(one).hex() for one in record["commanded_input"].values[:400, 0])
    driver = DRIVER.replace("int main", f"static const double COMMANDS[] = {{{commands}}};\n\nint main")
    (tmp_path / "driver.c").write_text(driver)
    command = [COMPILERS[0], "-std=c99", "-O2", "driver.c", "vehicle.c", "-o", "driver", "-lm"]
    subprocess.run(command, cwd=tmp_path, check=True)
    lines = subprocess.run(["./driver"], cwd=tmp_path, check=True, capture_output=True, text=True).stdout.split()
    np.testing.assert_array_equal([float.fromhex(one) for one in lines], record["position"].values[:400, 0])


MASTER = """
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include "fmi2.h"

fmi2Component PREFIXED(fmi2Instantiate)(fmi2String, fmi2Type, fmi2String, fmi2String, const fmi2CallbackFunctions *,
                                        fmi2Boolean, fmi2Boolean);
void PREFIXED(fmi2FreeInstance)(fmi2Component);
fmi2Status PREFIXED(fmi2EnterInitializationMode)(fmi2Component);
fmi2Status PREFIXED(fmi2ExitInitializationMode)(fmi2Component);
fmi2Status PREFIXED(fmi2DoStep)(fmi2Component, fmi2Real, fmi2Real, fmi2Boolean);
fmi2Status PREFIXED(fmi2GetReal)(fmi2Component, const fmi2ValueReference[], size_t, fmi2Real[]);
fmi2Status PREFIXED(fmi2SetReal)(fmi2Component, const fmi2ValueReference[], size_t, const fmi2Real[]);
fmi2Status PREFIXED(fmi2GetFMUstate)(fmi2Component, fmi2FMUstate *);
fmi2Status PREFIXED(fmi2SetFMUstate)(fmi2Component, fmi2FMUstate);
fmi2Status PREFIXED(fmi2FreeFMUstate)(fmi2Component, fmi2FMUstate *);

static void logger(fmi2ComponentEnvironment e, fmi2String n, fmi2Status s, fmi2String c, fmi2String message, ...) {
    (void)e, (void)n, (void)s, (void)c;
    if (strchr(message, '%') != NULL) {
        abort();
    }
}

/* Random calls with random arguments: nothing but an answer may come of them. */
int main(void) {
    const fmi2CallbackFunctions callbacks = {logger, calloc, free, NULL, NULL};
    fmi2Component units[2];
    fmi2FMUstate states[2] = {NULL, NULL};
    double points[2] = {0, 0}, kept[2] = {0, 0};
    for (int i = 0; i < 2; ++i) {
        if (PREFIXED(fmi2Instantiate)("%s", fmi2CoSimulation, "%n", "", &callbacks, 0, 0) != NULL) {
            return 1;
        }
        units[i] = PREFIXED(fmi2Instantiate)("one", fmi2CoSimulation, GUID, "", &callbacks, 0, 0);
        if (units[i] == NULL || PREFIXED(fmi2EnterInitializationMode)(units[i]) != fmi2OK ||
            PREFIXED(fmi2ExitInitializationMode)(units[i]) != fmi2OK) {
            return 2;
        }
    }
    srand(1);
    int taken = 0;
    for (int k = 0; k < 20000; ++k) {
        const int i = rand() % 2;
        const fmi2ValueReference reference = (fmi2ValueReference)(rand() % 64);
        fmi2Real value = (rand() % 50 == 0) ? 0.0 / (rand() % 2) : 1e-3 * (rand() % 100);
        switch (rand() % 6) {
        case 0: (void)PREFIXED(fmi2SetReal)(units[i], &reference, 1, &value); break;
        case 1: (void)PREFIXED(fmi2GetReal)(units[i], &reference, 1, &value); break;
        case 2: kept[i] = (PREFIXED(fmi2GetFMUstate)(units[i], &states[i]) == fmi2OK) ? points[i] : kept[i]; break;
        case 3: points[i] = (PREFIXED(fmi2SetFMUstate)(units[i], states[i]) == fmi2OK) ? kept[i] : points[i]; break;
        default:
            if (PREFIXED(fmi2DoStep)(units[i], points[i], PERIOD, 0) == fmi2OK) {
                points[i] += PERIOD;
                taken += 1;
            }
        }
    }
    for (int i = 0; i < 2; ++i) {
        (void)PREFIXED(fmi2FreeFMUstate)(units[i], &states[i]);
        PREFIXED(fmi2FreeInstance)(units[i]);
    }
    printf("%d steps\\n", taken);
    return (taken > 100) ? 0 : 3;
}
"""


@pytest.fixture(scope="module")
def units(tmp_path_factory):
    """Folder of the two units of the pendulum."""
    folder = tmp_path_factory.mktemp("units")
    export_fmu(build(PENDULUM)).exported.write(folder)
    return folder


@pytest.mark.parametrize("compiler", COMPILERS)
@pytest.mark.parametrize("name", ["controller", "vehicle"])
def test_random_calls_of_an_fmu_under_sanitizers(units, tmp_path, compiler, name):
    """Two instances, compiled from the sources with a prefix, as for a program that has them inside."""
    import fmpy

    fmpy.extract(units / f"{name}.fmu", tmp_path)
    sources, guid = tmp_path / "sources", fmpy.read_model_description(tmp_path).guid
    head = f'#define PREFIXED(name) {name}_##name\n#define GUID "{guid}"\n#define PERIOD 0.001\n'
    (sources / "master.c").write_text(head + MASTER)
    warned = ["-std=c99", "-Wall", "-Wextra", "-Werror", "-pedantic", f"-DFMI2_FUNCTION_PREFIX={name}_"]
    command = [compiler, *warned, *SANITIZED.split(), "master.c", "fmi2.c", f"{name}.c", "-o", "master", "-lm"]
    done = subprocess.run(command, cwd=sources, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    done = subprocess.run(["./master"], cwd=sources, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr


SORTED = """
import jax.numpy as jnp
from undertow.physics.disturbances.loads import AbstractSmoothDisturbance


class Sorted(AbstractSmoothDisturbance):
    def at(self, realization, t, pose, load):
        return load._replace(acceleration=load.acceleration + jnp.sort(jnp.sin(t * jnp.arange(100.0)))[0])


def sorted_load():
    return Sorted()
"""


@pytest.mark.parametrize("several", [False, True])
def test_a_disturbance_that_cannot_be_exported_is_named(tmp_path, capsys, several):
    (tmp_path / "own.py").write_text(SORTED)
    own = {"kind": "./own.py:sorted_load"}
    scenario = PENDULUM | {"disturbance": [PENDULUM["disturbance"], own] if several else own}
    (tmp_path / "scenario.yaml").write_text(dump(scenario))
    for option in (["--c99", "--part=vehicle"], ["--fmu"]):
        assert run(["export", str(tmp_path / "scenario.yaml"), *option[1:], option[0], str(tmp_path / "out")]) == 2
        error = capsys.readouterr().err.strip().splitlines()[-1]
        place = "disturbance[1]" if several else "disturbance"
        assert f"`{place} (./own.py:sorted_load)` must be made of operations that the batch compiler has" in error
        assert "sorting of 100 numbers" in error
    assert not (tmp_path / "out").exists()


def test_an_adaptive_loop_has_no_steps(tmp_path):
    scenario = PENDULUM | {"loop": {"kind": "continuous", "method": "adaptive"}}
    with pytest.raises(BadInput, match="must be one of euler, rk4 for a vehicle in C, but is adaptive"):
        export_vehicle(build(scenario))


def test_the_example_has_twenty_lines():
    """It shows the whole loop, so it must stay short."""
    example = export_controller(build(PENDULUM)).files["example.c"]
    assert 15 <= len([line for line in example.splitlines() if line.strip(" {}")]) <= 20
