/* What the drivers know of the FMU that they are linked with, and what they share.
 *
 * All of it comes from the FMU's modelDescription.xml (description.c is written from it by the
 * tests), nothing from the wrapper's own tables.
 */
#ifndef DRIVERS_FMU_H
#define DRIVERS_FMU_H

#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "fmi2Functions.h"

enum { MOST = 128 }; /* values in one call */

typedef struct {
    const char *name;
    fmi2ValueReference vr;
    char kind; /* of KINDS below */
    int is_integer, is_output;
    double start, minimum, maximum;
} Variable;

/* input, fixed and tunable parameter, calculated parameter, state, derivative, memory, mode, output */
#define KINDS "iptcsdemo"

extern const char *const guid;
extern const Variable variable[];
extern const int n_variables, n_states, n_indicators, output_derivatives; /* their order */
extern const double start_time, step_size;
extern const fmi2ValueReference inner_step; /* a parameter with a minimum, in every FMU of ours */

/* Checking: a failed check is printed, and makes the exit code 1. */

extern long checks, failures;
void check(int holds, const char *file, int line, const char *format, ...);
#define CHECK(condition, ...) check((condition) != 0, __FILE__, __LINE__, __VA_ARGS__)

/* Log lines, kept by instance. */

enum { EVENTS, WARNING, DISCARD, ERROR, FATAL, ALL, CATEGORIES };
extern const char *const category_name[CATEGORIES];

typedef struct {
    int lines, of[CATEGORIES];
    fmi2Status status; /* the rest is the last line's */
    int category;
    char text[600];
} Log;

/* An instance, and where it stands. */

typedef struct {
    fmi2Component fmu;
    fmi2Type type;
    double time, next_event;
    Log log;
    fmi2CallbackFunctions callbacks;
} Slave;

Slave *make(fmi2Type type);
void release(Slave *s);
const char *type_name(fmi2Type type);

/* States of FMI 2.0's state tables that an FMU without asynchronous or discarded steps can be in.
 * STEP_COMPLETE is co-simulation's, EVENT_MODE and CONTINUOUS_TIME are model exchange's. */
typedef enum {
    INSTANTIATED, INITIALIZATION, STEP_COMPLETE, EVENT_MODE, CONTINUOUS_TIME, TERMINATED, IN_ERROR, STATES
} State;
extern const char *const state_name[STATES];
int has_state(fmi2Type type, State state);
Slave *make_in(fmi2Type type, State state);

/* The FMU state as bytes, to see whether something changed. */

typedef struct {
    fmi2Byte *bytes;
    size_t size;
} Snapshot;

Snapshot snapshot(Slave *s);
int is_same(Slave *s, const Snapshot *before);
void forget(Snapshot *snapshot);

/* Runs with random inputs and steps: the same seed gives the same run. */

uint64_t random_bits(uint64_t *state);
double random_between(uint64_t *state, double low, double high);
void initialize(Slave *s);
uint64_t play(Slave *s, uint64_t seed, int steps); /* from INSTANTIATED; a digest of all values */
uint64_t play_on(Slave *s, uint64_t seed, int steps); /* from STEP_COMPLETE or CONTINUOUS_TIME */
uint64_t read_all(Slave *s, uint64_t digest);
uint64_t fresh_run(fmi2Type type); /* the digest of RUN_SEED's run on a new instance */
void check_reset(Slave *s, const char *after);
enum { RUN_SEED = 7, RUN_STEPS = 12 };

/* The programs; each returns when it is done, with its checks counted. */

void states(void);
void arguments(void);
void logs(void);
void random_runs(uint64_t first, int count);
void fault(fmi2Type type, double value);
void corrupted(uint64_t seed, int count);
void memory(int rounds, int instances);
void threads(int count);

#endif
