"""What a unit of co-simulation, FMI 2.0, is compiled of: the C of a system, fmi2.c, and a table of the variables."""

import hashlib
import uuid
from collections.abc import Sequence
from pathlib import Path

from undertow.core.status import Status
from undertow.outside.export.c_program import CProgram
from undertow.outside.export.model_description import ModelDescription
from undertow.outside.export.variables import Variable

_HERE = Path(__file__).parent
_ROLES = {role: f"FMU_{role.upper()}" for role in ("output", "input", "measured", "parameter", "tunable")}


def sources_of(
    program: CProgram, variables: Sequence[Variable], duration: float
) -> tuple[dict[str, str], ModelDescription]:
    """The files of the folder `sources`, and the unit."""
    system = program.system
    rows = ",\n    ".join(_row(program, variable) for variable in variables)
    integer = "int64_t" if program.kind == "double" else "int32_t"
    filled = {"NAME": system.name, "REAL": program.kind, "INTEGER": integer, "VARIABLES_ROWS": rows}
    model = (_CONTROLLER if "target" in program.fields else _VEHICLE) + _COMMON
    filled["STATUS_ROWS"] = ",\n        ".join(f'"{code.sentence}"' for code in Status)
    for word, text in filled.items():
        model = model.replace(f"@{word}@", text)
    sources = {f"{system.name}.c": program.text(), f"{system.name}.h": program.header(), "fmu_model.h": model}
    sources |= {name: (_HERE / name).read_text("utf-8") for name in ("fmi2.c", "fmi2.h")}
    digest = hashlib.sha256(repr((sorted(sources.items()), list(variables))).encode()).digest()
    guid = f"{{{uuid.UUID(bytes=digest[:16])}}}"
    identity = int.from_bytes(digest[16:24], "little")
    sources["fmu_model.h"] = model.replace("@GUID@", guid).replace("@IDENTITY@", f"{identity}ULL")
    compiled_ones = [name for name in sources if name.endswith(".c")]
    return sources, ModelDescription(system.name, guid, system.about, variables, compiled_ones, system.period, duration)


def _row(program: CProgram, variable: Variable) -> str:
    """The row of a variable in the table in C."""
    struct, member, index = variable.place
    offset = f"offsetof(fmu_model, {member if struct == 'model' else struct})"
    if struct != "model":
        offset += f" + offsetof({program.system.name}_{struct}, {member}) + {index} * sizeof(fmu_real)"
    return f'{{"{variable.name}", FMU_{variable.kind.upper()}, {_ROLES[variable.role]}, {offset}}}'


_COMMON = """
static const fmu_variable VARIABLES[] = {
    @VARIABLES_ROWS@
};
"""

_HEAD = """\
/* Variables of the unit, and what a step does. */
#include "@NAME@.h"

#define FMU_IDENTIFIER "@NAME@"
#define FMU_GUID "@GUID@"
#define FMU_IDENTITY @IDENTITY@
#define FMU_PERIOD @NAME@_PERIOD

typedef @REAL@ fmu_real;
typedef @INTEGER@ fmu_integer;
"""

_CONTROLLER = (
    _HEAD
    + """
typedef struct {
    @NAME@_state state;
    @NAME@_input input;
    @NAME@_output output;
    int scenario_reference;
} fmu_model;

static void fmu_defaults(fmu_model *model) {
    static const @NAME@_input defaults = @NAME@_DEFAULTS;
    model->input = defaults;
    model->scenario_reference = 1;
}

/* The outputs at the start: no command until the first step. */
static void fmu_initialise(fmu_model *model) { (void)model; }

/* The sentence why the step failed; NULL where it did not. */
static const char *fmu_step(fmu_model *model, int64_t steps) {
    @NAME@_input input = model->input;
    if (model->scenario_reference != 0) {
        @NAME@_target target;
        @NAME@_reference((fmu_real)steps * (fmu_real)FMU_PERIOD, &target);
        (void)memcpy(input.target_position, target.position, sizeof target.position);
        (void)memcpy(input.target_velocity, target.velocity, sizeof target.velocity);
        (void)memcpy(input.target_acceleration, target.acceleration, sizeof target.acceleration);
    }
    if (steps == 0) {
        @NAME@_start(&model->state, &input, &model->output);
    } else {
        @NAME@_step(&model->state, &input, &model->output);
    }
    for (size_t i = 0; i < sizeof model->output.command / sizeof model->output.command[0]; ++i) {
        if (!isfinite(model->output.command[i])) {
            return "The controller commanded an input that is infinite or undefined.";
        }
    }
    return NULL;
}
"""
)

_VEHICLE = (
    _HEAD
    + """
typedef struct {
    @NAME@_state state;
    @NAME@_input input;
    @NAME@_output output;
} fmu_model;

static void fmu_defaults(fmu_model *model) {
    static const @NAME@_input defaults = @NAME@_DEFAULTS;
    model->input = defaults;
}

/* The outputs at the start, which follow from the parameters. */
static void fmu_initialise(fmu_model *model) { @NAME@_start(&model->state, &model->input, &model->output); }

/* The sentence why the step failed; NULL where it did not. */
static const char *fmu_step(fmu_model *model, int64_t steps) {
    static const char *const sentences[] = {
        @STATUS_ROWS@
    };
    model->input.t = (fmu_real)steps * (fmu_real)FMU_PERIOD;
    @NAME@_step(&model->state, &model->input, &model->output);
    return (model->output.status == 0) ? NULL : sentences[model->output.status];
}
"""
)
