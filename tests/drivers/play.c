/* Runs with random inputs and steps, of both FMU types, as a digest of all values on the way. */
#include "fmu.h"

uint64_t random_bits(uint64_t *state) { /* xorshift64*, seeded with anything but zero */
    *state ^= *state >> 12;
    *state ^= *state << 25;
    *state ^= *state >> 27;
    return *state * 2685821657736338717u;
}

double random_between(uint64_t *state, double low, double high) {
    return low + (high - low) * (double)(random_bits(state) >> 11) / 9007199254740992.0;
}

static uint64_t mix(uint64_t digest, double value) {
    uint64_t bits;
    memcpy(&bits, &value, sizeof bits);
    return (digest ^ bits) * 1099511628211u + (digest >> 29);
}

#define EXPECT(call) \
    do { \
        fmi2Status got = call; \
        CHECK(got <= fmi2Warning, "t = %.9g: %s: status %d: %s", s->time, #call, (int)got, s->log.text); \
    } while (0)

uint64_t read_all(Slave *s, uint64_t digest) {
    int k;
    for (k = 0; k < n_variables; k++) {
        fmi2ValueReference vr = variable[k].vr;
        fmi2Real real = 0.0;
        fmi2Integer integer = 0;
        if (variable[k].is_integer) EXPECT(fmi2GetInteger(s->fmu, &vr, 1, &integer));
        else EXPECT(fmi2GetReal(s->fmu, &vr, 1, &real));
        digest = mix(digest, variable[k].is_integer ? (double)integer : real);
    }
    return digest;
}

static void set_inputs(Slave *s, uint64_t *random) {
    int k;
    for (k = 0; k < n_variables; k++) {
        const Variable *v = &variable[k];
        double low = v->minimum > -HUGE_VAL ? v->minimum : -1.0;
        double high = v->maximum < HUGE_VAL ? v->maximum : 1.0, value;
        if (v->kind != 'i') continue;
        value = random_between(random, low, high);
        EXPECT(fmi2SetReal(s->fmu, &v->vr, 1, &value));
        if (s->type == fmi2CoSimulation && random_bits(random) % 3 == 0) {
            fmi2Integer order = 1;
            fmi2Real rate = random_between(random, -1.0, 1.0);
            EXPECT(fmi2SetRealInputDerivatives(s->fmu, &v->vr, 1, &order, &rate));
        }
    }
}

static uint64_t derivatives_of_outputs(Slave *s, uint64_t digest) {
    int k;
    for (k = 0; k < n_variables && output_derivatives; k++) {
        fmi2Integer order = 1;
        fmi2Real rate = 0.0;
        if (!variable[k].is_output || variable[k].is_integer) continue;
        EXPECT(fmi2GetRealOutputDerivatives(s->fmu, &variable[k].vr, 1, &order, &rate));
        digest = mix(digest, rate);
    }
    return digest;
}

static uint64_t sensitivities(Slave *s, uint64_t digest) {
    fmi2ValueReference known[MOST], unknown[MOST];
    fmi2Real seed[MOST], value[MOST];
    size_t n_known = 0, n_unknown = 0, i;
    int k;
    for (k = 0; k < n_variables && k < MOST; k++) {
        if (strchr("sipt", variable[k].kind) && strncmp(variable[k].name, "solver.", 7)) {
            seed[n_known] = 1.0 + 0.5 * k;
            known[n_known++] = variable[k].vr;
        }
        if (strchr("dco", variable[k].kind)) unknown[n_unknown++] = variable[k].vr;
    }
    EXPECT(fmi2GetDirectionalDerivative(s->fmu, unknown, n_unknown, known, n_known, seed, value));
    for (i = 0; i < n_unknown; i++) digest = mix(digest, value[i]);
    return digest;
}

/* Save, read, go elsewhere, return and read the same; what follows must not notice either. */
static void detour(Slave *s, uint64_t *random) {
    fmi2FMUstate state = NULL;
    double time = s->time, next_event = s->next_event;
    uint64_t seen;
    EXPECT(fmi2GetFMUstate(s->fmu, &state));
    seen = read_all(s, 0);
    play_on(s, random_bits(random) | 1, 2);
    EXPECT(fmi2SetFMUstate(s->fmu, state));
    CHECK(read_all(s, 0) == seen, "t = %.9g: values differ after a return", time);
    EXPECT(fmi2SetFMUstate(s->fmu, state));
    EXPECT(fmi2FreeFMUstate(s->fmu, &state));
    s->time = time;
    s->next_event = next_event;
}

static uint64_t do_step(Slave *s, uint64_t *random, uint64_t digest) {
    double h = step_size * (random_bits(random) % 4 ? random_between(random, 0.1, 6.0) : 1.0);
    set_inputs(s, random);
    if (random_bits(random) % 4 == 0) detour(s, random); /* between setting and stepping */
    EXPECT(fmi2DoStep(s->fmu, s->time, h, fmi2True));
    s->time += h;
    return derivatives_of_outputs(s, digest);
}

static void handle_events(Slave *s, double *x) {
    fmi2EventInfo info;
    EXPECT(fmi2EnterEventMode(s->fmu));
    do EXPECT(fmi2NewDiscreteStates(s->fmu, &info));
    while (info.newDiscreteStatesNeeded);
    s->next_event = info.nextEventTimeDefined ? info.nextEventTime : HUGE_VAL;
    EXPECT(fmi2EnterContinuousTimeMode(s->fmu));
    EXPECT(fmi2GetContinuousStates(s->fmu, x, (size_t)n_states));
}

/* One step by Euler's method; events are noticed at its end, which is good enough here. */
static uint64_t integrate(Slave *s, uint64_t *random, uint64_t digest) {
    double x[MOST], dx[MOST], before[MOST], after[MOST];
    double h = step_size * random_between(random, 0.1, 3.0);
    size_t n = (size_t)n_states, n_z = (size_t)n_indicators, i;
    fmi2Boolean enter = fmi2False, terminate = fmi2False;
    int crossed = 0, is_due = s->time + h >= s->next_event;
    if (is_due && s->next_event > s->time) h = s->next_event - s->time;
    EXPECT(fmi2GetContinuousStates(s->fmu, x, n));
    EXPECT(fmi2GetEventIndicators(s->fmu, before, n_z));
    EXPECT(fmi2GetDerivatives(s->fmu, dx, n));
    for (i = 0; i < n; i++) x[i] += h * dx[i];
    s->time = is_due ? s->next_event : s->time + h;
    EXPECT(fmi2SetTime(s->fmu, s->time));
    EXPECT(fmi2SetContinuousStates(s->fmu, x, n));
    set_inputs(s, random);
    EXPECT(fmi2GetEventIndicators(s->fmu, after, n_z));
    for (i = 0; i < n_z; i++) {
        crossed |= (before[i] > 0.0) != (after[i] > 0.0);
        digest = mix(digest, after[i]);
    }
    EXPECT(fmi2CompletedIntegratorStep(s->fmu, fmi2True, &enter, &terminate));
    CHECK(!terminate, "fmi2CompletedIntegratorStep asks to terminate");
    if (enter || crossed || is_due) handle_events(s, x);
    for (i = 0; i < n; i++) digest = mix(digest, x[i]);
    return digest;
}

uint64_t play_on(Slave *s, uint64_t seed, int steps) {
    uint64_t random = seed * 0x9E3779B97F4A7C15u | 1, digest = 14695981039346656037u;
    int k;
    for (k = 0; k < steps; k++) {
        if (k % 5 == 4 && steps > 2) detour(s, &random);
        if (s->type == fmi2CoSimulation) digest = do_step(s, &random, digest);
        else digest = integrate(s, &random, digest);
        digest = read_all(s, digest);
        if (k % 3 == 0) digest = sensitivities(s, digest);
    }
    return digest;
}

void initialize(Slave *s) {
    EXPECT(fmi2SetupExperiment(s->fmu, fmi2False, 0.0, start_time, fmi2False, 0.0));
    EXPECT(fmi2EnterInitializationMode(s->fmu));
    EXPECT(fmi2ExitInitializationMode(s->fmu));
    s->time = start_time;
    if (s->type == fmi2ModelExchange) {
        double x[MOST];
        handle_events(s, x);
    }
}

uint64_t play(Slave *s, uint64_t seed, int steps) {
    initialize(s);
    return play_on(s, seed, steps);
}

uint64_t fresh_run(fmi2Type type) {
    static uint64_t known[2];
    uint64_t *digest = &known[type == fmi2CoSimulation];
    if (!*digest) {
        Slave *s = make(type);
        *digest = play(s, RUN_SEED, RUN_STEPS);
        release(s);
    }
    return *digest;
}

void check_reset(Slave *s, const char *after) {
    uint64_t digest;
    CHECK(fmi2Reset(s->fmu) == fmi2OK, "fmi2Reset after %s: %s", after, s->log.text);
    digest = play(s, RUN_SEED, RUN_STEPS);
    CHECK(digest == fresh_run(s->type), "%s: a run after %s and a reset differs from a fresh one",
          type_name(s->type), after);
}
