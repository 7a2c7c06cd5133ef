/* Functions of FMI 2.0 for co-simulation around a system that takes steps of one sampling time.

   fmu_model.h, which is written for each system, states its variables and what a step does. Everything that changes
   lies in one struct, so that an instance is saved, restored and reset by copying it. The file is as long as the
   interface, whose functions must all be there. */
#include <math.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "fmi2.h"

typedef enum { FMU_REAL, FMU_INTEGER, FMU_BOOLEAN } fmu_type;

typedef enum {
    FMU_OUTPUT,
    FMU_INPUT,     /* finite at every step */
    FMU_MEASURED,  /* finite at the first step; later NaN stands for what was not measured */
    FMU_PARAMETER, /* set before the first step */
    FMU_TUNABLE
} fmu_role;

typedef struct {
    const char *name;
    fmu_type type;
    fmu_role role;
    size_t place; /* of its number in fmu_model */
} fmu_variable;

#include "fmu_model.h"

#define VARIABLES_COUNT (sizeof VARIABLES / sizeof VARIABLES[0])

typedef enum { INSTANTIATED = 1, INITIALISING = 2, STEPPING = 4, TERMINATED = 8 } fmu_phase;

typedef struct {
    uint64_t identity; /* of the unit, because a state may come from elsewhere */
    uint32_t phase;
    uint32_t stale; /* whether the outputs at the start await new parameters */
    double start;   /* s */
    int64_t steps;  /* taken since the start */
    fmu_model model;
} fmu_kept;

typedef struct {
    fmu_kept kept;
    fmi2CallbackFunctions callbacks;
    char name[128];
} fmu_instance;

static void *allocate(const fmi2CallbackFunctions *callbacks, size_t size) {
    return (callbacks->allocateMemory != NULL) ? callbacks->allocateMemory(1, size) : calloc(1, size);
}

static void release(const fmi2CallbackFunctions *callbacks, void *memory) {
    (callbacks->freeMemory != NULL) ? callbacks->freeMemory(memory) : free(memory);
}

/* Logs a sentence about a call that failed. */
static fmi2Status failed(const fmi2CallbackFunctions *callbacks, const char *name, const char *format, ...) {
    char sentence[512];
    va_list values;
    va_start(values, format);
    (void)vsnprintf(sentence, sizeof sentence, format, values);
    va_end(values);
    for (char *each = sentence; *each != '\0'; ++each) {
        *each = (*each == '%') ? '/' : *each; /* To a logger the sentence is a format. */
    }
    if (callbacks->logger != NULL) {
        callbacks->logger(callbacks->componentEnvironment, name, fmi2Error, "logStatusError", sentence);
    }
    return fmi2Error;
}

#define FAILED_CALL(unit, ...) failed(&(unit)->callbacks, (unit)->name, __VA_ARGS__)

/* The instance, if it may be called in its phase; NULL otherwise. */
static fmu_instance *ready(fmi2Component component, unsigned phases, const char *function) {
    fmu_instance *unit = component;
    if (unit != NULL && (unit->kept.phase & phases) == 0) {
        (void)FAILED_CALL(unit, "%s must not be called now: see the order of calls in FMI 2.0, 4.2.4.", function);
        return NULL;
    }
    return unit;
}

static double time_of(const fmu_kept *kept) { return kept->start + (double)kept->steps * FMU_PERIOD; }

static void begin(fmu_kept *kept) {
    (void)memset(kept, 0, sizeof *kept);
    kept->identity = FMU_IDENTITY;
    kept->phase = INSTANTIATED;
    kept->stale = 1;
    fmu_defaults(&kept->model);
}

static void refresh(fmu_kept *kept) {
    if (kept->stale != 0 && kept->phase != INSTANTIATED) {
        fmu_initialise(&kept->model);
        kept->stale = 0;
    }
}

FMI2_EXPORT const char *FMI2(fmi2GetTypesPlatform)(void) { return "default"; }

FMI2_EXPORT const char *FMI2(fmi2GetVersion)(void) { return "2.0"; }

FMI2_EXPORT fmi2Status FMI2(fmi2SetDebugLogging)(fmi2Component c, fmi2Boolean on, size_t count,
                                                 const fmi2String categories[]) {
    (void)on, (void)count, (void)categories; /* Errors are always logged, and nothing else is. */
    return (c != NULL) ? fmi2OK : fmi2Error;
}

FMI2_EXPORT fmi2Component FMI2(fmi2Instantiate)(fmi2String name, fmi2Type type, fmi2String guid, fmi2String resources,
                                                const fmi2CallbackFunctions *callbacks, fmi2Boolean visible,
                                                fmi2Boolean logging) {
    (void)resources, (void)visible, (void)logging;
    if (callbacks == NULL) {
        return NULL;
    }
    const char *called = (name != NULL && name[0] != '\0') ? name : FMU_IDENTIFIER;
    if (type != fmi2CoSimulation) {
        (void)failed(callbacks, called, "This unit is one for co-simulation, not for model exchange.");
        return NULL;
    }
    if (guid == NULL || strcmp(guid, FMU_GUID) != 0) {
        (void)failed(callbacks, called, "The GUID is %s, but that of this unit is %s: they are of different exports.",
                     (guid != NULL) ? guid : "missing", FMU_GUID);
        return NULL;
    }
    fmu_instance *unit = allocate(callbacks, sizeof *unit);
    if (unit == NULL) {
        (void)failed(callbacks, called, "There is no memory for an instance of %u bytes.", (unsigned)sizeof *unit);
        return NULL;
    }
    begin(&unit->kept);
    unit->callbacks = *callbacks;
    (void)snprintf(unit->name, sizeof unit->name, "%s", called);
    return unit;
}

FMI2_EXPORT void FMI2(fmi2FreeInstance)(fmi2Component c) {
    fmu_instance *unit = c;
    if (unit != NULL) {
        const fmi2CallbackFunctions callbacks = unit->callbacks;
        release(&callbacks, unit);
    }
}

FMI2_EXPORT fmi2Status FMI2(fmi2SetupExperiment)(fmi2Component c, fmi2Boolean tolerance_defined, fmi2Real tolerance,
                                                 fmi2Real start, fmi2Boolean stop_defined, fmi2Real stop) {
    (void)tolerance_defined, (void)tolerance, (void)stop_defined, (void)stop;
    fmu_instance *unit = ready(c, INSTANTIATED, "fmi2SetupExperiment");
    if (unit == NULL) {
        return fmi2Error;
    }
    if (!isfinite(start)) {
        return FAILED_CALL(unit, "The start time must be finite, but is %g s.", start);
    }
    unit->kept.start = start;
    return fmi2OK;
}

FMI2_EXPORT fmi2Status FMI2(fmi2EnterInitializationMode)(fmi2Component c) {
    fmu_instance *unit = ready(c, INSTANTIATED, "fmi2EnterInitializationMode");
    if (unit == NULL) {
        return fmi2Error;
    }
    unit->kept.phase = INITIALISING;
    return fmi2OK;
}

static fmi2Real real_of(const fmu_kept *kept, const fmu_variable *one) {
    fmu_real number;
    (void)memcpy(&number, (const char *)&kept->model + one->place, sizeof number);
    return (fmi2Real)number;
}

/* The first number that must be finite and is not, among inputs, parameters and those of a role; NULL where all are. */
static const fmu_variable *not_finite(const fmu_kept *kept, fmu_role role) {
    for (size_t i = 0; i < VARIABLES_COUNT; ++i) {
        const fmu_variable *one = &VARIABLES[i];
        const int checked = one->role == FMU_INPUT || one->role == FMU_PARAMETER || one->role == role;
        if (checked && one->type == FMU_REAL && !isfinite(real_of(kept, one))) {
            return one;
        }
    }
    return NULL;
}

FMI2_EXPORT fmi2Status FMI2(fmi2ExitInitializationMode)(fmi2Component c) {
    fmu_instance *unit = ready(c, INITIALISING, "fmi2ExitInitializationMode");
    if (unit == NULL) {
        return fmi2Error;
    }
    const fmu_variable *wrong = not_finite(&unit->kept, FMU_INPUT);
    if (wrong != NULL) {
        return FAILED_CALL(unit, "%s must be finite at the start.", wrong->name);
    }
    refresh(&unit->kept);
    unit->kept.phase = STEPPING;
    return fmi2OK;
}

FMI2_EXPORT fmi2Status FMI2(fmi2Terminate)(fmi2Component c) {
    fmu_instance *unit = ready(c, STEPPING, "fmi2Terminate");
    if (unit == NULL) {
        return fmi2Error;
    }
    unit->kept.phase = TERMINATED;
    return fmi2OK;
}

FMI2_EXPORT fmi2Status FMI2(fmi2Reset)(fmi2Component c) {
    fmu_instance *unit = c;
    if (unit == NULL) {
        return fmi2Error;
    }
    begin(&unit->kept);
    return fmi2OK;
}

/* The variable of a reference, if it has the type; NULL otherwise. */
static const fmu_variable *found(fmu_instance *unit, fmi2ValueReference reference, fmu_type type) {
    static const char *const types[] = {"Real", "Integer", "Boolean"};
    if (reference >= VARIABLES_COUNT) {
        (void)FAILED_CALL(unit, "There is no variable of value reference %u.", reference);
        return NULL;
    }
    if (VARIABLES[reference].type != type) {
        (void)FAILED_CALL(unit, "%s is no %s.", VARIABLES[reference].name, types[type]);
        return NULL;
    }
    return &VARIABLES[reference];
}

/* Where a number may be written; NULL where it may not now. */
static char *writable(fmu_instance *unit, fmi2ValueReference reference, fmu_type type) {
    const fmu_variable *one = found(unit, reference, type);
    if (one == NULL) {
        return NULL;
    }
    if (one->role == FMU_OUTPUT) {
        (void)FAILED_CALL(unit, "%s is an output and cannot be set.", one->name);
        return NULL;
    }
    if (one->role == FMU_PARAMETER && unit->kept.phase != INSTANTIATED && unit->kept.phase != INITIALISING) {
        (void)FAILED_CALL(unit, "%s is a parameter and can be set before the first step only.", one->name);
        return NULL;
    }
    unit->kept.stale = (one->role == FMU_PARAMETER) ? 1 : unit->kept.stale;
    return (char *)&unit->kept.model + one->place;
}

#define ANY_PHASE (INSTANTIATED | INITIALISING | STEPPING | TERMINATED)

FMI2_EXPORT fmi2Status FMI2(fmi2GetReal)(fmi2Component c, const fmi2ValueReference vr[], size_t count,
                                         fmi2Real value[]) {
    fmu_instance *unit = ready(c, ANY_PHASE, "fmi2GetReal");
    if (unit == NULL) {
        return fmi2Error;
    }
    refresh(&unit->kept);
    for (size_t i = 0; i < count; ++i) {
        const fmu_variable *one = found(unit, vr[i], FMU_REAL);
        if (one == NULL) {
            return fmi2Error;
        }
        value[i] = real_of(&unit->kept, one);
    }
    return fmi2OK;
}

FMI2_EXPORT fmi2Status FMI2(fmi2SetReal)(fmi2Component c, const fmi2ValueReference vr[], size_t count,
                                         const fmi2Real value[]) {
    fmu_instance *unit = ready(c, INSTANTIATED | INITIALISING | STEPPING, "fmi2SetReal");
    for (size_t i = 0; unit != NULL && i < count; ++i) {
        char *place = writable(unit, vr[i], FMU_REAL);
        if (place == NULL) {
            return fmi2Error;
        }
        const fmu_real number = (fmu_real)value[i];
        (void)memcpy(place, &number, sizeof number);
    }
    return (unit != NULL) ? fmi2OK : fmi2Error;
}

FMI2_EXPORT fmi2Status FMI2(fmi2GetInteger)(fmi2Component c, const fmi2ValueReference vr[], size_t count,
                                            fmi2Integer value[]) {
    fmu_instance *unit = ready(c, ANY_PHASE, "fmi2GetInteger");
    if (unit == NULL) {
        return fmi2Error;
    }
    refresh(&unit->kept);
    for (size_t i = 0; i < count; ++i) {
        const fmu_variable *one = found(unit, vr[i], FMU_INTEGER);
        if (one == NULL) {
            return fmi2Error;
        }
        fmu_integer number;
        (void)memcpy(&number, (const char *)&unit->kept.model + one->place, sizeof number);
        value[i] = (fmi2Integer)number;
    }
    return fmi2OK;
}

FMI2_EXPORT fmi2Status FMI2(fmi2SetInteger)(fmi2Component c, const fmi2ValueReference vr[], size_t count,
                                            const fmi2Integer value[]) {
    (void)value;
    fmu_instance *unit = ready(c, ANY_PHASE, "fmi2SetInteger");
    if (unit != NULL && count > 0) { /* Integers are outputs. */
        (void)writable(unit, vr[0], FMU_INTEGER);
        return fmi2Error;
    }
    return (unit != NULL) ? fmi2OK : fmi2Error;
}

FMI2_EXPORT fmi2Status FMI2(fmi2GetBoolean)(fmi2Component c, const fmi2ValueReference vr[], size_t count,
                                            fmi2Boolean value[]) {
    fmu_instance *unit = ready(c, ANY_PHASE, "fmi2GetBoolean");
    for (size_t i = 0; unit != NULL && i < count; ++i) {
        const fmu_variable *one = found(unit, vr[i], FMU_BOOLEAN);
        if (one == NULL) {
            return fmi2Error;
        }
        (void)memcpy(&value[i], (const char *)&unit->kept.model + one->place, sizeof value[i]);
    }
    return (unit != NULL) ? fmi2OK : fmi2Error;
}

FMI2_EXPORT fmi2Status FMI2(fmi2SetBoolean)(fmi2Component c, const fmi2ValueReference vr[], size_t count,
                                            const fmi2Boolean value[]) {
    fmu_instance *unit = ready(c, INSTANTIATED | INITIALISING | STEPPING, "fmi2SetBoolean");
    for (size_t i = 0; unit != NULL && i < count; ++i) {
        char *place = writable(unit, vr[i], FMU_BOOLEAN);
        if (place == NULL) {
            return fmi2Error;
        }
        (void)memcpy(place, &value[i], sizeof value[i]);
    }
    return (unit != NULL) ? fmi2OK : fmi2Error;
}

static fmi2Status no_strings(fmi2Component c, size_t count) {
    fmu_instance *unit = c;
    if (unit == NULL) {
        return fmi2Error;
    }
    return (count == 0) ? fmi2OK : FAILED_CALL(unit, "No variable of this unit is a String.");
}

FMI2_EXPORT fmi2Status FMI2(fmi2GetString)(fmi2Component c, const fmi2ValueReference vr[], size_t count,
                                           fmi2String value[]) {
    (void)vr, (void)value;
    return no_strings(c, count);
}

FMI2_EXPORT fmi2Status FMI2(fmi2SetString)(fmi2Component c, const fmi2ValueReference vr[], size_t count,
                                           const fmi2String value[]) {
    (void)vr, (void)value;
    return no_strings(c, count);
}

FMI2_EXPORT fmi2Status FMI2(fmi2DoStep)(fmi2Component c, fmi2Real point, fmi2Real size, fmi2Boolean no_return) {
    (void)no_return;
    fmu_instance *unit = ready(c, STEPPING, "fmi2DoStep");
    if (unit == NULL) {
        return fmi2Error;
    }
    fmu_kept *kept = &unit->kept;
    const double ratio = size / FMU_PERIOD, whole = floor(ratio + 0.5), now = time_of(kept);
    if (!(whole >= 1 && whole < 1e9 && fabs(ratio - whole) <= 1e-6 * whole)) {
        return FAILED_CALL(unit, "The step size must be a multiple of the sampling time, %g s, but is %g s.", FMU_PERIOD,
                           size);
    }
    if (!(fabs(point - now) <= 1e-3 * FMU_PERIOD)) {
        return FAILED_CALL(unit, "The step must begin at %.9g s, where the last one ended, but begins at %.9g s.", now,
                           point);
    }
    const fmu_variable *wrong = not_finite(kept, (kept->steps == 0) ? FMU_MEASURED : FMU_INPUT);
    if (wrong != NULL) {
        return FAILED_CALL(unit, "%s must be finite, but is not, at %.9g s: no step was taken.", wrong->name, now);
    }
    const fmu_kept before = *kept;
    for (int64_t k = 0; k < (int64_t)whole; ++k) {
        const char *sentence = fmu_step(&kept->model, kept->steps);
        if (sentence != NULL) {
            const double then = time_of(kept);
            *kept = before;
            return FAILED_CALL(unit, "The step from %.9g s failed, and the state is that before the call: %s", then,
                               sentence);
        }
        kept->steps += 1;
    }
    return fmi2OK;
}

FMI2_EXPORT fmi2Status FMI2(fmi2CancelStep)(fmi2Component c) {
    fmu_instance *unit = c;
    return (unit != NULL) ? FAILED_CALL(unit, "A step is never pending.") : fmi2Error;
}

FMI2_EXPORT fmi2Status FMI2(fmi2GetStatus)(fmi2Component c, const fmi2StatusKind kind, fmi2Status *value) {
    (void)kind, (void)value;
    return (c != NULL) ? fmi2Discard : fmi2Error; /* No step is ever pending. */
}

FMI2_EXPORT fmi2Status FMI2(fmi2GetRealStatus)(fmi2Component c, const fmi2StatusKind kind, fmi2Real *value) {
    fmu_instance *unit = c;
    if (unit == NULL) {
        return fmi2Error;
    }
    if (kind != fmi2LastSuccessfulTime) {
        return fmi2Discard;
    }
    *value = time_of(&unit->kept);
    return fmi2OK;
}

FMI2_EXPORT fmi2Status FMI2(fmi2GetIntegerStatus)(fmi2Component c, const fmi2StatusKind kind, fmi2Integer *value) {
    (void)kind, (void)value;
    return (c != NULL) ? fmi2Discard : fmi2Error;
}

FMI2_EXPORT fmi2Status FMI2(fmi2GetBooleanStatus)(fmi2Component c, const fmi2StatusKind kind, fmi2Boolean *value) {
    if (c == NULL) {
        return fmi2Error;
    }
    if (kind != fmi2Terminated) {
        return fmi2Discard;
    }
    *value = 0;
    return fmi2OK;
}

FMI2_EXPORT fmi2Status FMI2(fmi2GetStringStatus)(fmi2Component c, const fmi2StatusKind kind, fmi2String *value) {
    (void)kind, (void)value;
    return (c != NULL) ? fmi2Discard : fmi2Error;
}

FMI2_EXPORT fmi2Status FMI2(fmi2GetFMUstate)(fmi2Component c, fmi2FMUstate *state) {
    fmu_instance *unit = c;
    if (unit == NULL || state == NULL) {
        return fmi2Error;
    }
    if (*state == NULL) {
        *state = allocate(&unit->callbacks, sizeof unit->kept);
    }
    if (*state == NULL) {
        return FAILED_CALL(unit, "There is no memory for a state of %u bytes.", (unsigned)sizeof unit->kept);
    }
    (void)memcpy(*state, &unit->kept, sizeof unit->kept);
    return fmi2OK;
}

FMI2_EXPORT fmi2Status FMI2(fmi2SetFMUstate)(fmi2Component c, fmi2FMUstate state) {
    fmu_instance *unit = c;
    if (unit == NULL || state == NULL) {
        return fmi2Error;
    }
    (void)memcpy(&unit->kept, state, sizeof unit->kept);
    return fmi2OK;
}

FMI2_EXPORT fmi2Status FMI2(fmi2FreeFMUstate)(fmi2Component c, fmi2FMUstate *state) {
    fmu_instance *unit = c;
    if (unit == NULL || state == NULL) {
        return fmi2Error;
    }
    if (*state != NULL) {
        release(&unit->callbacks, *state);
        *state = NULL;
    }
    return fmi2OK;
}

/* Ends a serialised state, because files may be damaged: Fowler, Noll and Vo, variant 1a. */
static uint64_t checksum(const char *bytes) {
    uint64_t sum = 14695981039346656037ULL;
    for (size_t i = 0; i < sizeof(fmu_kept); ++i) {
        sum = (sum ^ (unsigned char)bytes[i]) * 1099511628211ULL;
    }
    return sum;
}

#define SERIALISED (sizeof(fmu_kept) + sizeof(uint64_t))

FMI2_EXPORT fmi2Status FMI2(fmi2SerializedFMUstateSize)(fmi2Component c, fmi2FMUstate state, size_t *size) {
    if (c == NULL || state == NULL || size == NULL) {
        return fmi2Error;
    }
    *size = SERIALISED;
    return fmi2OK;
}

FMI2_EXPORT fmi2Status FMI2(fmi2SerializeFMUstate)(fmi2Component c, fmi2FMUstate state, fmi2Byte bytes[], size_t size) {
    fmu_instance *unit = c;
    if (unit == NULL || state == NULL || bytes == NULL) {
        return fmi2Error;
    }
    if (size < SERIALISED) {
        return FAILED_CALL(unit, "A state takes %u bytes, not %u.", (unsigned)SERIALISED, (unsigned)size);
    }
    const uint64_t sum = checksum(state);
    (void)memcpy(bytes, state, sizeof(fmu_kept));
    (void)memcpy(bytes + sizeof(fmu_kept), &sum, sizeof sum);
    return fmi2OK;
}

FMI2_EXPORT fmi2Status FMI2(fmi2DeSerializeFMUstate)(fmi2Component c, const fmi2Byte bytes[], size_t size,
                                                     fmi2FMUstate *state) {
    fmu_instance *unit = c;
    if (unit == NULL || bytes == NULL || state == NULL) {
        return fmi2Error;
    }
    uint64_t identity = 0, sum = 0;
    if (size == SERIALISED) {
        (void)memcpy(&identity, bytes, sizeof identity);
        (void)memcpy(&sum, bytes + sizeof(fmu_kept), sizeof sum);
    }
    if (identity != FMU_IDENTITY || sum != checksum(bytes)) {
        return FAILED_CALL(unit, "These %u bytes are not a state of this unit, or they are damaged.", (unsigned)size);
    }
    if (*state == NULL) {
        *state = allocate(&unit->callbacks, sizeof(fmu_kept));
    }
    if (*state == NULL) {
        return FAILED_CALL(unit, "There is no memory for a state of %u bytes.", (unsigned)sizeof(fmu_kept));
    }
    (void)memcpy(*state, bytes, sizeof(fmu_kept));
    return fmi2OK;
}

FMI2_EXPORT fmi2Status FMI2(fmi2GetDirectionalDerivative)(fmi2Component c, const fmi2ValueReference unknown[],
                                                          size_t unknowns, const fmi2ValueReference known[],
                                                          size_t knowns, const fmi2Real in[], fmi2Real out[]) {
    (void)unknown, (void)unknowns, (void)known, (void)knowns, (void)in, (void)out;
    fmu_instance *unit = c;
    return (unit != NULL) ? FAILED_CALL(unit, "This unit gives no directional derivatives.") : fmi2Error;
}

FMI2_EXPORT fmi2Status FMI2(fmi2SetRealInputDerivatives)(fmi2Component c, const fmi2ValueReference vr[], size_t count,
                                                         const fmi2Integer order[], const fmi2Real value[]) {
    (void)vr, (void)count, (void)order, (void)value;
    fmu_instance *unit = c;
    return (unit != NULL) ? FAILED_CALL(unit, "Inputs are held over a step: they have no derivatives.") : fmi2Error;
}

FMI2_EXPORT fmi2Status FMI2(fmi2GetRealOutputDerivatives)(fmi2Component c, const fmi2ValueReference vr[], size_t count,
                                                          const fmi2Integer order[], fmi2Real value[]) {
    (void)vr, (void)count, (void)order, (void)value;
    fmu_instance *unit = c;
    return (unit != NULL) ? FAILED_CALL(unit, "This unit gives no derivatives of its outputs.") : fmi2Error;
}
