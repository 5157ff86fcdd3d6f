/* Random runs; runs into a fault of the model; runs from damaged states. */
#include "fmu.h"

static uint64_t after_events(Slave *s) {
    fmi2EventInfo info;
    CHECK(fmi2NewDiscreteStates(s->fmu, &info) == fmi2OK, "at a zero: %s", s->log.text);
    return read_all(s, (uint64_t)info.valuesOfContinuousStatesChanged);
}

/* A root finder stops exactly at a zero, and the state is saved before its event: the event waits. */
static void saved_at_a_zero(int state) {
    Slave *s = make_in(fmi2ModelExchange, CONTINUOUS_TIME);
    fmi2FMUstate saved = NULL;
    uint64_t events;
    double x[MOST];
    fmi2GetContinuousStates(s->fmu, x, (size_t)n_states);
    x[state] = 0.0;
    fmi2SetContinuousStates(s->fmu, x, (size_t)n_states);
    fmi2EnterEventMode(s->fmu);
    CHECK(fmi2GetFMUstate(s->fmu, &saved) == fmi2OK, "saving at a zero");
    events = after_events(s);
    CHECK(fmi2SetFMUstate(s->fmu, saved) == fmi2OK, "restoring at a zero");
    CHECK(after_events(s) == events, "state %d at zero: an event is lost with saving", state);
    fmi2FreeFMUstate(s->fmu, &saved);
    release(s);
}

enum { LENGTH = 300 };

/* Twice from the same seed, on a new instance and after a reset: the same values. */
void random_runs(uint64_t first, int count) {
    int type, k, events;
    for (k = 0; k < n_states; k++) saved_at_a_zero(k);
    for (type = fmi2ModelExchange; type <= fmi2CoSimulation; type++) {
        events = 0;
        for (k = 0; k < count; k++) {
            uint64_t seed = first + (uint64_t)k;
            Slave *s = make((fmi2Type)type);
            uint64_t once = play(s, seed, LENGTH);
            events += s->log.of[EVENTS];
            if (k % 2) fmi2Terminate(s->fmu);
            CHECK(fmi2Reset(s->fmu) == fmi2OK, "fmi2Reset");
            CHECK(play(s, seed, LENGTH) == once, "seed %d: the run after a reset differs", (int)seed);
            release(s);
        }
        printf("%s: %d events in %d runs\n", type_name((fmi2Type)type), events, count);
    }
}

/* Everything that reads must work in the error state, and everything else be refused. */
static void after_an_error(Slave *s) {
    double x[MOST], value = 0.0;
    const Variable *input = NULL;
    int k;
    for (k = 0; k < n_variables; k++)
        if (variable[k].kind == 'i') input = &variable[k];
    read_all(s, 0);
    if (s->type == fmi2ModelExchange) {
        CHECK(fmi2GetContinuousStates(s->fmu, x, (size_t)n_states) == fmi2OK, "states: %s", s->log.text);
        CHECK(fmi2GetDerivatives(s->fmu, x, (size_t)n_states) == fmi2OK, "derivatives: %s", s->log.text);
        CHECK(fmi2GetEventIndicators(s->fmu, x, (size_t)n_indicators) == fmi2OK, "indicators: %s", s->log.text);
        CHECK(fmi2SetTime(s->fmu, s->time) == fmi2Error, "fmi2SetTime after an error");
    } else {
        CHECK(fmi2DoStep(s->fmu, s->time, step_size, fmi2True) == fmi2Error, "fmi2DoStep after an error");
    }
    if (input) CHECK(fmi2SetReal(s->fmu, &input->vr, 1, &value) == fmi2Error, "fmi2SetReal after an error");
    CHECK(fmi2Terminate(s->fmu) == fmi2Error, "fmi2Terminate after an error");
}

/* One step of model exchange, event mode included; the first status that is no success. */
static fmi2Status integrate(Slave *s) {
    double x[MOST], dx[MOST], z[MOST];
    fmi2Boolean enter, terminate;
    fmi2EventInfo info;
    fmi2Status status;
    int i;
#define TRY(call) if ((status = call) > fmi2Warning) return status
    TRY(fmi2GetContinuousStates(s->fmu, x, (size_t)n_states));
    TRY(fmi2GetDerivatives(s->fmu, dx, (size_t)n_states));
    for (i = 0; i < n_states; i++) x[i] += step_size * dx[i];
    s->time += step_size;
    TRY(fmi2SetTime(s->fmu, s->time));
    TRY(fmi2SetContinuousStates(s->fmu, x, (size_t)n_states));
    TRY(fmi2GetEventIndicators(s->fmu, z, (size_t)n_indicators));
    TRY(fmi2CompletedIntegratorStep(s->fmu, fmi2True, &enter, &terminate));
    TRY(fmi2EnterEventMode(s->fmu));
    TRY(fmi2NewDiscreteStates(s->fmu, &info));
    return fmi2EnterContinuousTimeMode(s->fmu);
}

static fmi2Status step(Slave *s) {
    fmi2Status status;
    if (s->type == fmi2ModelExchange) return integrate(s);
    status = fmi2DoStep(s->fmu, s->time, step_size, fmi2True);
    s->time += step_size;
    return status;
}

/* Set inputs and tunable parameters to `value` and step into the fault; print the line that tells of it. */
void fault(fmi2Type type, double value) {
    Slave *s = make(type);
    fmi2FMUstate good = NULL;
    double begun;
    int k;
    fmi2Status status;
    initialize(s);
    play_on(s, 5, 3);
    CHECK(fmi2GetFMUstate(s->fmu, &good) == fmi2OK, "saving");
    begun = s->time;
    if (type == fmi2ModelExchange) fmi2EnterEventMode(s->fmu);
    for (k = 0; k < n_variables; k++)
        if (strchr("it", variable[k].kind))
            fmi2SetReal(s->fmu, &variable[k].vr, 1, &value);
    if (type == fmi2ModelExchange) fmi2EnterContinuousTimeMode(s->fmu);
    status = step(s);
    CHECK(status == fmi2Error, "fault %g: status %d", value, (int)status);
    CHECK(s->log.category == ERROR && strstr(s->log.text, "t = "), "fault %g: %s", value, s->log.text);
    printf("%s\n", s->log.text);
    if (fmi2GetReal(s->fmu, NULL, 0, NULL) == fmi2OK && fmi2Terminate(s->fmu) == fmi2Error) after_an_error(s);
    CHECK(fmi2SetFMUstate(s->fmu, good) == fmi2OK, "restoring: %s", s->log.text);
    s->time = begun;
    play_on(s, 5, 3);
    fmi2FreeFMUstate(s->fmu, &good);
    check_reset(s, "a fault");
    release(s);
}

/* A step that ends soon whatever is damaged; 0 for none. With error control a stiff plant, which a
 * damaged parameter can make, takes as many inner steps as the clock can tell apart. */
static double quick_step(Slave *s) {
    double value = 0.0, step = step_size;
    int k;
    for (k = 0; k < n_variables; k++) {
        if (!strcmp(variable[k].name, "solver.relative_tolerance")) step = 1e-5 * step_size;
        if (variable[k].vr != inner_step) continue;
        fmi2GetReal(s->fmu, &inner_step, 1, &value);
        if (!(value >= 0.01 * variable[k].start)) return 0.0;
    }
    return step;
}

/* Use an instance in whatever state it is, without a look at what comes back. */
static void use(Slave *s) {
    fmi2EventInfo info;
    fmi2Boolean enter, terminate;
    double x[MOST], time = 0.0;
    int k;
    for (k = 0; k < n_variables; k++) {
        fmi2Integer integer;
        fmi2GetReal(s->fmu, &variable[k].vr, 1, x);
        fmi2GetInteger(s->fmu, &variable[k].vr, 1, &integer);
        fmi2SetReal(s->fmu, &variable[k].vr, 1, x);
    }
    fmi2GetRealStatus(s->fmu, fmi2LastSuccessfulTime, &time);
    if (quick_step(s) > 0.0) fmi2DoStep(s->fmu, time, quick_step(s), fmi2True);
    fmi2EnterEventMode(s->fmu);
    fmi2NewDiscreteStates(s->fmu, &info);
    fmi2EnterContinuousTimeMode(s->fmu);
    fmi2GetDerivatives(s->fmu, x, (size_t)n_states);
    fmi2GetEventIndicators(s->fmu, x, (size_t)n_indicators);
    fmi2CompletedIntegratorStep(s->fmu, fmi2True, &enter, &terminate);
    fmi2ExitInitializationMode(s->fmu);
    fmi2EnterInitializationMode(s->fmu);
    fmi2Terminate(s->fmu);
}

/* Serialized states with flipped bytes: refused or not, nothing crashes and a reset helps. */
void corrupted(uint64_t seed, int count) {
    uint64_t random = seed | 1;
    int taken = 0, k, j;
    for (k = 0; k < count; k++) {
        fmi2Type type = k % 2 ? fmi2CoSimulation : fmi2ModelExchange;
        Slave *s = make_in(type, type == fmi2CoSimulation ? STEP_COMPLETE : CONTINUOUS_TIME);
        Snapshot saved = snapshot(s);
        fmi2FMUstate state = NULL;
        int flips = 1 + (int)(random_bits(&random) % 8);
        for (j = 0; j < flips; j++)
            saved.bytes[random_bits(&random) % saved.size] = (fmi2Byte)random_bits(&random);
        if (fmi2DeSerializeFMUstate(s->fmu, saved.bytes, saved.size, &state) == fmi2OK)
            taken += fmi2SetFMUstate(s->fmu, state) == fmi2OK;
        use(s);
        fmi2FreeFMUstate(s->fmu, &state);
        check_reset(s, "a damaged state");
        forget(&saved);
        release(s);
    }
    printf("%d of %d damaged states taken\n", taken, count);
}
