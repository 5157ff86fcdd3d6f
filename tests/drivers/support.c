/* Instances with their log lines, and ways into each state. */
#include <stdarg.h>

#include "fmu.h"

long checks, failures;

const char *const category_name[CATEGORIES] = {
    "logEvents", "logStatusWarning", "logStatusDiscard", "logStatusError", "logStatusFatal", "logAll",
};
const char *const state_name[STATES] = {
    "instantiated", "initialization mode", "step complete", "event mode", "continuous-time mode",
    "terminated", "error",
};

void check(int holds, const char *file, int line, const char *format, ...) {
    va_list arguments;
    __atomic_add_fetch(&checks, 1, __ATOMIC_RELAXED);
    if (holds) return;
    if (__atomic_add_fetch(&failures, 1, __ATOMIC_RELAXED) > 30) return; /* it is the first that help */
    fprintf(stderr, "%s:%d: ", file, line);
    va_start(arguments, format);
    vfprintf(stderr, format, arguments);
    va_end(arguments);
    fputc('\n', stderr);
}

/* A logger that ignores the further arguments: a message must be complete without them, and
 * nothing in it may look like a conversion to those loggers that format. */
static void logger(fmi2ComponentEnvironment environment, fmi2String name, fmi2Status status,
                   fmi2String category, fmi2String message, ...) {
    Log *log = (Log *)environment;
    int c = 0;
    while (c < CATEGORIES && strcmp(category, category_name[c])) c++;
    CHECK(!strcmp(name, "slave") || !*name, "a log line of '%s'", name);
    CHECK(c < CATEGORIES, "the log category '%s' is not declared", category);
    CHECK(!strchr(message, '%'), "a conversion in the message: %s", message);
    CHECK(strlen(message) < sizeof log->text, "a message of %u bytes", (unsigned)strlen(message));
    log->lines++;
    if (c < CATEGORIES) log->of[c]++;
    log->category = c;
    log->status = status;
    snprintf(log->text, sizeof log->text, "%s", message);
}

Slave *make(fmi2Type type) {
    Slave *s = (Slave *)calloc(1, sizeof(Slave));
    fmi2CallbackFunctions callbacks = {logger, calloc, free, NULL, NULL};
    if (!s) abort();
    memcpy(&s->callbacks, &callbacks, sizeof callbacks); /* its members are constant */
    s->callbacks.componentEnvironment = &s->log;
    s->type = type;
    s->fmu = fmi2Instantiate("slave", type, guid, "", &s->callbacks, fmi2False, fmi2True);
    if (!s->fmu) {
        fprintf(stderr, "fmi2Instantiate: %s\n", s->log.text);
        exit(2);
    }
    return s;
}

void release(Slave *s) {
    if (s->fmu) fmi2FreeInstance(s->fmu);
    free(s);
}

const char *type_name(fmi2Type type) {
    return type == fmi2CoSimulation ? "co-simulation" : "model exchange";
}

int has_state(fmi2Type type, State state) {
    if (state == STEP_COMPLETE) return type == fmi2CoSimulation;
    if (state == EVENT_MODE || state == CONTINUOUS_TIME) return type == fmi2ModelExchange;
    return 1;
}

/* An error by a parameter below its minimum, which is refused when initialization ends. */
static void fail(Slave *s) {
    double none = 0.0;
    fmi2SetReal(s->fmu, &inner_step, 1, &none);
    fmi2SetupExperiment(s->fmu, fmi2False, 0.0, start_time, fmi2False, 0.0);
    fmi2EnterInitializationMode(s->fmu);
    CHECK(fmi2ExitInitializationMode(s->fmu) == fmi2Error, "inner_step = 0 is taken");
}

Slave *make_in(fmi2Type type, State state) {
    Slave *s = make(type);
    if (state == INSTANTIATED) return s;
    if (state == IN_ERROR) {
        fail(s);
        return s;
    }
    fmi2SetupExperiment(s->fmu, fmi2False, 0.0, start_time, fmi2False, 0.0);
    fmi2EnterInitializationMode(s->fmu);
    if (state == INITIALIZATION) return s;
    fmi2ExitInitializationMode(s->fmu);
    s->time = start_time;
    if (state == EVENT_MODE) return s;
    if (type == fmi2ModelExchange) {
        fmi2EventInfo info;
        fmi2NewDiscreteStates(s->fmu, &info);
        s->next_event = info.nextEventTimeDefined ? info.nextEventTime : HUGE_VAL;
        fmi2EnterContinuousTimeMode(s->fmu);
    }
    play_on(s, 1, 3);
    if (state == TERMINATED) fmi2Terminate(s->fmu);
    return s;
}

Snapshot snapshot(Slave *s) {
    Snapshot taken = {NULL, 0};
    fmi2FMUstate state = NULL;
    CHECK(fmi2GetFMUstate(s->fmu, &state) == fmi2OK, "fmi2GetFMUstate");
    fmi2SerializedFMUstateSize(s->fmu, state, &taken.size);
    taken.bytes = (fmi2Byte *)malloc(taken.size);
    if (!taken.bytes) abort();
    CHECK(fmi2SerializeFMUstate(s->fmu, state, taken.bytes, taken.size) == fmi2OK, "serialize");
    fmi2FreeFMUstate(s->fmu, &state);
    CHECK(!state, "fmi2FreeFMUstate leaves a pointer behind");
    return taken;
}

int is_same(Slave *s, const Snapshot *before) {
    Snapshot now = snapshot(s);
    int same = now.size == before->size && !memcmp(now.bytes, before->bytes, now.size);
    forget(&now);
    return same;
}

void forget(Snapshot *snapshot) {
    free(snapshot->bytes);
    snapshot->bytes = NULL;
}
