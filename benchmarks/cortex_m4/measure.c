/* The test of an exported controller on a Cortex-M4 that QEMU emulates, with what its steps take.

   NAME is the name of the controller. QEMU runs with `-icount shift=6`: each instruction takes 64 ns of virtual time,
   which the timer of the processor counts at 25 MHz. So instructions are counted, not the cycles of a real processor. */
#include <stdint.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

#define JOINED_(a, b) a##b
#define JOINED(a, b) JOINED_(a, b)
#define CALLED(what) JOINED(NAME, what)
#include VECTORS

#define REGISTER(address) (*(volatile uint32_t *)(address))
#define TIMER_CONTROL REGISTER(0xE000E010u)
#define TIMER_RELOAD REGISTER(0xE000E014u)
#define TIMER_VALUE REGISTER(0xE000E018u)
#define COPROCESSORS REGISTER(0xE000ED88u)

#define PAINTED 65536u /* bytes of stack */
#define PAINT 0xA5A5A5A5u

extern uint32_t stack_top;
void initialise_monitor_handles(void);
int main(void);

void reset(void) {
    COPROCESSORS |= 0xFu << 20; /* floating-point unit on */
    __asm volatile("dsb\n isb");
    initialise_monitor_handles();
    const int code = main();
    (void)fflush(stdout);
    _exit(code);
}

static void stopped(void) { _exit(3); }

__attribute__((section(".vectors"), used)) static void *const VECTOR_TABLE[] = {
    &stack_top, (void *)reset, (void *)stopped, (void *)stopped, (void *)stopped, (void *)stopped, (void *)stopped};

static uint32_t counts(uint32_t from) { return (from - TIMER_VALUE) & 0xFFFFFFu; }

/* 2000 instructions. */
static uint32_t known(void) {
    const uint32_t from = TIMER_VALUE;
    __asm volatile("movw r3, #1000\n1: subs r3, r3, #1\n bne 1b" ::: "r3", "cc");
    return counts(from);
}

static CALLED(_state) state;

int main(void) {
    static uint32_t taken[STEPS];
    CALLED(_output) output;
    int different = 0;
    uint32_t most = 0, total = 0;
    TIMER_RELOAD = 0xFFFFFFu;
    TIMER_VALUE = 0;
    TIMER_CONTROL = 5;
    const uint32_t unit = known();
    uint32_t *const low = (uint32_t *)((uintptr_t)__builtin_frame_address(0) - 256u - PAINTED);
    for (uint32_t i = 0; i < PAINTED / 4; ++i) {
        low[i] = PAINT;
    }
    for (int k = 0; k < STEPS; ++k) {
        const uint32_t from = TIMER_VALUE;
        if (k == 0) {
            CALLED(_start)(&state, &INPUTS[k], &output);
        } else {
            CALLED(_step)(&state, &INPUTS[k], &output);
        }
        taken[k] = counts(from);
        different += memcmp(&output, &OUTPUTS[k], sizeof output) != 0;
    }
    uint32_t untouched = 0;
    while (untouched < PAINTED / 4 && low[untouched] == PAINT) {
        ++untouched;
    }
    for (int k = 1; k < STEPS; ++k) {
        total += taken[k];
        most = (taken[k] > most) ? taken[k] : most;
    }
    printf("{\"different\": %d, \"steps\": %d, \"counts_of_2000\": %u, \"counts_mean\": %u, \"counts_most\": %u, ", different,
           STEPS, (unsigned)unit, (unsigned)(total / (STEPS - 1)), (unsigned)most);
    printf("\"state\": %u, \"stack\": %u}\n", (unsigned)sizeof state, (unsigned)(PAINTED + 256u - 4 * untouched));
    return (different == 0) ? 0 : 1;
}
