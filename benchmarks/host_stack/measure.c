/* The test of an exported controller on this machine, with the stack that its steps take: a thread has a painted one.

   NAME is the name of the controller. */
#include <pthread.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define JOINED_(a, b) a##b
#define JOINED(a, b) JOINED_(a, b)
#define CALLED(what) JOINED(NAME, what)
#include VECTORS

#define PAINTED (1u << 20) /* bytes of stack */
#define PAINT 0xA5

static CALLED(_state) state;
static int different;

static void *nothing(void *unused) { return unused; }

static void *steps(void *unused) {
    CALLED(_output) output;
    for (int k = 0; k < STEPS; ++k) {
        if (k == 0) {
            CALLED(_start)(&state, &INPUTS[k], &output);
        } else {
            CALLED(_step)(&state, &INPUTS[k], &output);
        }
        different += memcmp(&output, &OUTPUTS[k], sizeof output) != 0;
    }
    return unused;
}

/* Bytes of a painted stack that a thread took. */
static size_t taken_by(void *(*work)(void *)) {
    unsigned char *const low = aligned_alloc(4096, PAINTED);
    pthread_attr_t attributes;
    pthread_t thread;
    size_t untouched = 0;
    if (low == NULL) {
        exit(2);
    }
    memset(low, PAINT, PAINTED);
    if (pthread_attr_init(&attributes) != 0 || pthread_attr_setstack(&attributes, low, PAINTED) != 0 ||
        pthread_create(&thread, &attributes, work, NULL) != 0 || pthread_join(thread, NULL) != 0) {
        exit(2);
    }
    while (untouched < PAINTED && low[untouched] == PAINT) {
        ++untouched;
    }
    free(low);
    return PAINTED - untouched;
}

int main(void) {
    const size_t empty = taken_by(nothing); /* what the system needs for a thread */
    const size_t whole = taken_by(steps);
    printf("{\"different\": %d, \"steps\": %d, \"state\": %zu, \"stack\": %zu}\n", different, STEPS, sizeof state,
           whole - empty);
    return (different == 0) ? 0 : 1;
}
