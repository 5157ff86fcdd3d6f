/* Wrong arguments: each is refused with a line that names the function and when, and changes nothing. */
#include "fmu.h"

static const Variable *first_of(const char *kinds) {
    int k;
    for (k = 0; k < n_variables; k++)
        if (strchr(kinds, variable[k].kind)) return &variable[k];
    return NULL;
}

/* What was before a call that must be refused. */
static Snapshot before;
static int lines;

static void watch(Slave *s) {
    before = snapshot(s);
    lines = s->log.lines;
}

static void check_refusal(Slave *s, const char *function, const char *arguments, fmi2Status status) {
    CHECK(status == fmi2Error, "%s(%s): status %d", function, arguments, (int)status);
    CHECK(s->log.lines == lines + 1, "%s(%s): %d lines", function, arguments, s->log.lines - lines);
    CHECK(s->log.category == ERROR, "%s(%s): %s", function, arguments, s->log.text);
    CHECK(strstr(s->log.text, function) == s->log.text, "%s(%s): %s", function, arguments, s->log.text);
    CHECK(strstr(s->log.text, "t = "), "%s(%s): no time: %s", function, arguments, s->log.text);
    CHECK(is_same(s, &before), "%s(%s) changed something", function, arguments);
    forget(&before);
}

static void check_success(Slave *s, const char *function, const char *arguments, fmi2Status status) {
    CHECK(status == fmi2OK, "%s(%s): status %d: %s", function, arguments, (int)status, s->log.text);
}

/* Calls on the instance `s`. */
#define REFUSED(function, ...) \
    (watch(s), check_refusal(s, #function, #__VA_ARGS__, function(s->fmu, __VA_ARGS__)))
#define TAKEN(function, ...) check_success(s, #function, #__VA_ARGS__, function(s->fmu, __VA_ARGS__))

static fmi2ValueReference unknown_reference(void) {
    fmi2ValueReference most = 0;
    int k;
    for (k = 0; k < n_variables; k++)
        if (variable[k].vr > most) most = variable[k].vr;
    return most + 1;
}

static void getters(Slave *s) {
    const Variable *real = first_of("sdo"), *mode = first_of("m");
    fmi2ValueReference none = 0xFFFFFFFFu, next = unknown_reference(), both[2] = {real->vr, next};
    fmi2Real r[2] = {0.0, 0.0};
    fmi2Integer i[2];
    fmi2Boolean b[1];
    fmi2String t[1];
    REFUSED(fmi2GetReal, NULL, 1, r);
    REFUSED(fmi2GetReal, &real->vr, 1, NULL);
    REFUSED(fmi2GetReal, &none, 1, r);
    REFUSED(fmi2GetReal, &next, 1, r);
    REFUSED(fmi2GetReal, both, 2, r);
    REFUSED(fmi2GetInteger, NULL, 1, i);
    REFUSED(fmi2GetInteger, &none, 1, i);
    REFUSED(fmi2GetInteger, &next, 1, i);
    REFUSED(fmi2GetInteger, &real->vr, 1, i);
    if (mode) {
        REFUSED(fmi2GetInteger, &mode->vr, 1, NULL);
        REFUSED(fmi2GetReal, &mode->vr, 1, r);
    }
    REFUSED(fmi2GetBoolean, NULL, 1, b);
    REFUSED(fmi2GetBoolean, &real->vr, 1, b);
    REFUSED(fmi2GetBoolean, &none, 1, NULL);
    REFUSED(fmi2GetString, NULL, 1, t);
    REFUSED(fmi2GetString, &real->vr, 1, t);
    REFUSED(fmi2GetString, &none, 1, NULL);
    TAKEN(fmi2GetReal, NULL, 0, NULL);
    TAKEN(fmi2GetInteger, NULL, 0, NULL);
    TAKEN(fmi2GetBoolean, NULL, 0, NULL);
    TAKEN(fmi2GetString, NULL, 0, NULL);
}

/* In the state after instantiation, where most may be set. */
static void setters(Slave *s) {
    const Variable *real = first_of("iptse"), *mode = first_of("m"), *computed = first_of("d");
    fmi2ValueReference none = 0xFFFFFFFFu, next = unknown_reference(), both[2] = {real->vr, next};
    fmi2Real r[2] = {real->start, 0.0}, bad[3] = {NAN, INFINITY, -INFINITY};
    fmi2Integer i[1] = {0};
    fmi2Boolean b[1] = {0};
    fmi2String t[1] = {""};
    int k;
    REFUSED(fmi2SetReal, NULL, 1, r);
    REFUSED(fmi2SetReal, &real->vr, 1, NULL);
    REFUSED(fmi2SetReal, &none, 1, r);
    REFUSED(fmi2SetReal, &next, 1, r);
    REFUSED(fmi2SetReal, both, 2, r);
    REFUSED(fmi2SetReal, &computed->vr, 1, r);
    for (k = 0; k < 3; k++) REFUSED(fmi2SetReal, &real->vr, 1, &bad[k]);
    REFUSED(fmi2SetInteger, NULL, 1, i);
    REFUSED(fmi2SetInteger, &none, 1, i);
    REFUSED(fmi2SetInteger, &real->vr, 1, i);
    if (mode) {
        REFUSED(fmi2SetInteger, &mode->vr, 1, NULL);
        REFUSED(fmi2SetReal, &mode->vr, 1, r);
    }
    REFUSED(fmi2SetBoolean, NULL, 1, b);
    REFUSED(fmi2SetBoolean, &real->vr, 1, b);
    REFUSED(fmi2SetString, NULL, 1, t);
    REFUSED(fmi2SetString, &real->vr, 1, t);
    TAKEN(fmi2SetReal, NULL, 0, NULL);
    TAKEN(fmi2SetInteger, NULL, 0, NULL);
    TAKEN(fmi2SetBoolean, NULL, 0, NULL);
    TAKEN(fmi2SetString, NULL, 0, NULL);
}

static void setting_up(Slave *s) {
    fmi2String unknown[2] = {"logAll", "logNothing"}, missing[1] = {NULL};
    REFUSED(fmi2SetupExperiment, fmi2False, 0.0, NAN, fmi2False, 0.0);
    REFUSED(fmi2SetupExperiment, fmi2False, 0.0, INFINITY, fmi2False, 0.0);
    REFUSED(fmi2SetupExperiment, fmi2False, 0.0, 1.0, fmi2True, 0.5);
    REFUSED(fmi2SetupExperiment, fmi2False, 0.0, 0.0, fmi2True, NAN);
    REFUSED(fmi2SetupExperiment, fmi2True, 0.0, 0.0, fmi2False, 0.0);
    REFUSED(fmi2SetupExperiment, fmi2True, -1e-6, 0.0, fmi2False, 0.0);
    REFUSED(fmi2SetupExperiment, fmi2True, NAN, 0.0, fmi2False, 0.0);
    TAKEN(fmi2SetupExperiment, fmi2False, NAN, 0.0, fmi2False, NAN); /* what is not defined is not read */
    REFUSED(fmi2SetDebugLogging, fmi2True, 2, unknown);
    REFUSED(fmi2SetDebugLogging, fmi2True, 1, missing);
    REFUSED(fmi2SetDebugLogging, fmi2True, 1, NULL);
}

static void saving(Slave *s) {
    Slave *other = make_in(s->type == fmi2CoSimulation ? fmi2ModelExchange : fmi2CoSimulation, INITIALIZATION);
    fmi2FMUstate state = NULL, foreign = NULL, none = NULL;
    Snapshot own = snapshot(s);
    size_t size = own.size;
    fmi2Byte *bytes = (fmi2Byte *)calloc(size + 1, 1);
    if (!bytes) abort();
    fmi2GetFMUstate(s->fmu, &state);
    fmi2GetFMUstate(other->fmu, &foreign);
    REFUSED(fmi2GetFMUstate, NULL);
    REFUSED(fmi2SetFMUstate, NULL);
    REFUSED(fmi2SetFMUstate, foreign);
    TAKEN(fmi2FreeFMUstate, NULL);
    TAKEN(fmi2FreeFMUstate, &none);
    REFUSED(fmi2SerializedFMUstateSize, NULL, &size);
    REFUSED(fmi2SerializedFMUstateSize, state, NULL);
    REFUSED(fmi2SerializeFMUstate, NULL, bytes, size);
    REFUSED(fmi2SerializeFMUstate, state, NULL, size);
    REFUSED(fmi2SerializeFMUstate, state, bytes, 0);
    REFUSED(fmi2SerializeFMUstate, state, bytes, size - 1);
    REFUSED(fmi2SerializeFMUstate, state, bytes, size + 1);
    REFUSED(fmi2SerializeFMUstate, state, bytes, (size_t)-1);
    REFUSED(fmi2DeSerializeFMUstate, NULL, size, &none);
    REFUSED(fmi2DeSerializeFMUstate, own.bytes, size, NULL);
    REFUSED(fmi2DeSerializeFMUstate, own.bytes, 0, &none);
    REFUSED(fmi2DeSerializeFMUstate, own.bytes, size - 1, &none);
    REFUSED(fmi2DeSerializeFMUstate, bytes, size + 1, &none);
    REFUSED(fmi2DeSerializeFMUstate, bytes, size, &none); /* zeros */
    memset(bytes, 0xA5, size);
    REFUSED(fmi2DeSerializeFMUstate, bytes, size, &none);
    CHECK(!none, "a refused fmi2DeSerializeFMUstate leaves a state behind");
    TAKEN(fmi2DeSerializeFMUstate, own.bytes, size, &none);
    TAKEN(fmi2DeSerializeFMUstate, own.bytes, size, &none); /* into the same one */
    TAKEN(fmi2SetFMUstate, none);
    TAKEN(fmi2GetFMUstate, &none);
    fmi2FreeFMUstate(s->fmu, &none);
    fmi2FreeFMUstate(s->fmu, &state);
    fmi2FreeFMUstate(other->fmu, &foreign);
    free(bytes);
    forget(&own);
    release(other);
}

static void derivatives(Slave *s) {
    const Variable *state = first_of("s"), *rate = first_of("d"), *mode = first_of("m");
    fmi2ValueReference none = 0xFFFFFFFFu, next = unknown_reference();
    fmi2Real seed = 1.0, value = 0.0, bad = NAN;
    REFUSED(fmi2GetDirectionalDerivative, NULL, 1, &state->vr, 1, &seed, &value);
    REFUSED(fmi2GetDirectionalDerivative, &rate->vr, 1, NULL, 1, &seed, &value);
    REFUSED(fmi2GetDirectionalDerivative, &rate->vr, 1, &state->vr, 1, NULL, &value);
    REFUSED(fmi2GetDirectionalDerivative, &rate->vr, 1, &state->vr, 1, &seed, NULL);
    REFUSED(fmi2GetDirectionalDerivative, &none, 1, &state->vr, 1, &seed, &value);
    REFUSED(fmi2GetDirectionalDerivative, &next, 1, &state->vr, 1, &seed, &value);
    REFUSED(fmi2GetDirectionalDerivative, &rate->vr, 1, &none, 1, &seed, &value);
    REFUSED(fmi2GetDirectionalDerivative, &rate->vr, 1, &next, 1, &seed, &value);
    REFUSED(fmi2GetDirectionalDerivative, &rate->vr, 1, &rate->vr, 1, &seed, &value);
    REFUSED(fmi2GetDirectionalDerivative, &rate->vr, 1, &inner_step, 1, &seed, &value);
    REFUSED(fmi2GetDirectionalDerivative, &inner_step, 1, &state->vr, 1, &seed, &value);
    REFUSED(fmi2GetDirectionalDerivative, &rate->vr, 1, &state->vr, 1, &bad, &value);
    if (mode) {
        REFUSED(fmi2GetDirectionalDerivative, &mode->vr, 1, &state->vr, 1, &seed, &value);
        REFUSED(fmi2GetDirectionalDerivative, &rate->vr, 1, &mode->vr, 1, &seed, &value);
    }
    TAKEN(fmi2GetDirectionalDerivative, NULL, 0, NULL, 0, NULL, NULL);
    TAKEN(fmi2GetDirectionalDerivative, &rate->vr, 1, NULL, 0, NULL, &value);
    CHECK(value == 0.0, "a derivative along nothing");
}

static void input_and_output_derivatives(Slave *s) {
    const Variable *input = first_of("i"), *state = first_of("s"), *rate = first_of("d");
    fmi2ValueReference none = 0xFFFFFFFFu;
    fmi2Integer order[3] = {0, 1, 2};
    fmi2Real value = 0.0, bad = INFINITY;
    TAKEN(fmi2SetRealInputDerivatives, NULL, 0, NULL, NULL);
    REFUSED(fmi2SetRealInputDerivatives, NULL, 1, &order[1], &value);
    REFUSED(fmi2SetRealInputDerivatives, &none, 1, &order[1], &value);
    REFUSED(fmi2SetRealInputDerivatives, &state->vr, 1, &order[1], &value);
    if (input) {
        REFUSED(fmi2SetRealInputDerivatives, &input->vr, 1, NULL, &value);
        REFUSED(fmi2SetRealInputDerivatives, &input->vr, 1, &order[1], NULL);
        REFUSED(fmi2SetRealInputDerivatives, &input->vr, 1, &order[0], &value);
        REFUSED(fmi2SetRealInputDerivatives, &input->vr, 1, &order[2], &value);
        REFUSED(fmi2SetRealInputDerivatives, &input->vr, 1, &order[1], &bad);
        REFUSED(fmi2GetRealOutputDerivatives, &input->vr, 1, &order[1], &value);
    }
    if (output_derivatives) TAKEN(fmi2GetRealOutputDerivatives, NULL, 0, NULL, NULL);
    REFUSED(fmi2GetRealOutputDerivatives, NULL, 1, &order[1], &value);
    REFUSED(fmi2GetRealOutputDerivatives, &rate->vr, 1, NULL, &value);
    REFUSED(fmi2GetRealOutputDerivatives, &rate->vr, 1, &order[1], NULL);
    REFUSED(fmi2GetRealOutputDerivatives, &rate->vr, 1, &order[1], &value); /* no output */
    REFUSED(fmi2GetRealOutputDerivatives, &none, 1, &order[1], &value);
}

static void steps(Slave *s) {
    double t = s->time, h = step_size;
    REFUSED(fmi2DoStep, t + h, h, fmi2True);
    REFUSED(fmi2DoStep, t - h, h, fmi2True);
    REFUSED(fmi2DoStep, NAN, h, fmi2True);
    REFUSED(fmi2DoStep, INFINITY, h, fmi2True);
    REFUSED(fmi2DoStep, -INFINITY, h, fmi2True);
    REFUSED(fmi2DoStep, t, 0.0, fmi2True);
    REFUSED(fmi2DoStep, t, -h, fmi2True);
    REFUSED(fmi2DoStep, t, NAN, fmi2True);
    REFUSED(fmi2DoStep, t, INFINITY, fmi2True);
    REFUSED(fmi2DoStep, t, 1e-300, fmi2True);
    REFUSED(fmi2DoStep, t, 1e300, fmi2True);
    REFUSED(fmi2DoStep, t, 1e12, fmi2True);
    REFUSED(fmi2GetRealStatus, fmi2LastSuccessfulTime, NULL);
    TAKEN(fmi2DoStep, t, h, fmi2True);
}

static void past_the_stop(void) {
    Slave *s = make(fmi2CoSimulation);
    double stop = start_time + 2.0 * step_size;
    TAKEN(fmi2SetupExperiment, fmi2False, 0.0, start_time, fmi2True, stop);
    fmi2EnterInitializationMode(s->fmu);
    fmi2ExitInitializationMode(s->fmu);
    TAKEN(fmi2DoStep, start_time, step_size, fmi2True);
    REFUSED(fmi2DoStep, start_time + step_size, 1.5 * step_size, fmi2True);
    TAKEN(fmi2DoStep, start_time + step_size, step_size, fmi2True);
    REFUSED(fmi2DoStep, stop, step_size, fmi2True);
    release(s);
}

/* The arrays of model exchange, each with its length. */
#define LENGTHS(function, n) \
    do { \
        REFUSED(function, array, (size_t)(n) + 1); \
        REFUSED(function, array, (size_t)-1); \
        if (n) REFUSED(function, array, (size_t)(n) - 1); \
        if (n) REFUSED(function, NULL, (size_t)(n)); \
    } while (0)

static void continuous_time(Slave *s) {
    double array[MOST + 1] = {0.0}, bad[3] = {NAN, INFINITY, -INFINITY};
    fmi2Boolean flag;
    int k;
    LENGTHS(fmi2SetContinuousStates, n_states);
    LENGTHS(fmi2GetContinuousStates, n_states);
    LENGTHS(fmi2GetDerivatives, n_states);
    LENGTHS(fmi2GetNominalsOfContinuousStates, n_states);
    LENGTHS(fmi2GetEventIndicators, n_indicators);
    if (!n_indicators) TAKEN(fmi2GetEventIndicators, NULL, 0);
    REFUSED(fmi2CompletedIntegratorStep, fmi2True, NULL, &flag);
    REFUSED(fmi2CompletedIntegratorStep, fmi2True, &flag, NULL);
    for (k = 0; k < 3; k++) {
        REFUSED(fmi2SetTime, bad[k]);
        memset(array, 0, sizeof array);
        array[n_states - 1] = bad[k];
        REFUSED(fmi2SetContinuousStates, array, (size_t)n_states);
    }
}

static void events(Slave *s) { REFUSED(fmi2NewDiscreteStates, NULL); }

/* What cannot become an instance: no instance, and a line if there is a logger. */
static void instantiation(void) {
    Log log;
    fmi2CallbackFunctions callbacks;
    Slave *s = make(fmi2CoSimulation);
    fmi2Component made;
    int k;
    memset(&log, 0, sizeof log);
    memcpy(&callbacks, &s->callbacks, sizeof callbacks);
    callbacks.componentEnvironment = &log;
#define NO_INSTANCE(name, type, identifier, words) \
    CHECK(!fmi2Instantiate(name, type, identifier, "", &callbacks, fmi2False, fmi2False), words); \
    CHECK(log.lines && log.status == fmi2Error && strstr(log.text, words), "%s: %s", words, log.text); \
    memset(&log, 0, sizeof log)
    NO_INSTANCE(NULL, fmi2CoSimulation, guid, "the instance name is missing");
    NO_INSTANCE("", fmi2CoSimulation, guid, "the instance name is missing");
    NO_INSTANCE("slave", fmi2CoSimulation, NULL, "GUID");
    NO_INSTANCE("slave", fmi2CoSimulation, "", "GUID");
    NO_INSTANCE("slave", fmi2CoSimulation, "{12345678-9999-9999-9999-000000000000}", "GUID");
    NO_INSTANCE("slave", (fmi2Type)7, guid, "unknown FMU type 7");
    NO_INSTANCE("slave", (fmi2Type)-1, guid, "unknown FMU type -1");
    CHECK(!fmi2Instantiate("slave", fmi2CoSimulation, "", "", NULL, fmi2False, fmi2True), "no callbacks");
    for (k = 0; k < 2; k++) { /* without a logger, and without callbacks at all */
        fmi2ValueReference none = 0xFFFFFFFFu;
        fmi2Real value;
        callbacks.logger = NULL;
        made = fmi2Instantiate("slave", fmi2CoSimulation, guid, NULL, k ? NULL : &callbacks, fmi2True, fmi2True);
        if (!made) continue;
        CHECK(fmi2GetReal(made, &none, 1, &value) == fmi2Error, "without a logger");
        fmi2FreeInstance(made);
    }
    release(s);
}

typedef void (*Program)(Slave *s);

static void in_state(fmi2Type type, State state, Program program, const char *name) {
    Slave *s = make_in(type, state);
    program(s);
    check_reset(s, name);
    program = NULL;
    release(s);
}

void arguments(void) {
    int type, state;
    for (type = fmi2ModelExchange; type <= fmi2CoSimulation; type++) {
        fmi2Type as = (fmi2Type)type;
        in_state(as, INSTANTIATED, setters, "setters");
        in_state(as, INITIALIZATION, setters, "setters");
        in_state(as, INSTANTIATED, setting_up, "setting up");
        for (state = 0; state < STATES; state++) {
            if (!has_state(as, (State)state)) continue;
            in_state(as, (State)state, saving, "saving");
            if (state == INSTANTIATED) continue;
            in_state(as, (State)state, getters, "getters");
            in_state(as, (State)state, derivatives, "directional derivatives");
        }
    }
    in_state(fmi2CoSimulation, STEP_COMPLETE, input_and_output_derivatives, "derivatives");
    in_state(fmi2CoSimulation, STEP_COMPLETE, steps, "steps");
    in_state(fmi2ModelExchange, CONTINUOUS_TIME, continuous_time, "continuous time");
    in_state(fmi2ModelExchange, EVENT_MODE, events, "events");
    past_the_stop();
    instantiation();
}
