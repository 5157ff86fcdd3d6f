/* All functions of FMI 2.0 around a model that tells in advance: N_REALS, N_BOOLS, N_STATES
 * (reals 0 … N_STATES−1; their derivatives follow), N_INDICATORS, start[], compute(), step() and
 * update(). What is wrong on purpose is marked LIE_…; without such a mark the FMU is honest.
 */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "fmi2Functions.h"

typedef struct {
    double time, next;
    double real[N_REALS], rate[N_REALS];
    int boolean[N_BOOLS + 1];
    int initializing;
} Model;

static void compute(Model *m);              /* what follows from time, states and inputs */
static void step(Model *m, double h);       /* co-simulation */
static int update(Model *m);                /* fire an event; 0 if none is due */
static void indicators(const Model *m, double *z);
static double partial(const Model *m, int unknown, int known);
static double slope_of(const Model *m, int output);

static void to_start(Model *m) {
    memset(m, 0, sizeof *m);
    memcpy(m->real, start, sizeof start);
    memcpy(m->boolean, start_boolean, sizeof start_boolean);
    m->next = HUGE_VAL;
    compute(m);
}

const char *fmi2GetTypesPlatform(void) { return fmi2TypesPlatform; }
const char *fmi2GetVersion(void) { return fmi2Version; }

fmi2Status fmi2SetDebugLogging(fmi2Component c, fmi2Boolean on, size_t n, const fmi2String names[]) {
    size_t i;
    (void)c, (void)on;
    for (i = 0; i < n; i++)
        if (strcmp(names[i], "logAll")) return fmi2Error;
    return fmi2OK;
}

fmi2Component fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String guid, fmi2String resources,
                              const fmi2CallbackFunctions *f, fmi2Boolean visible, fmi2Boolean logging) {
    Model *m;
    (void)name, (void)type, (void)resources, (void)f, (void)visible, (void)logging;
    if (strcmp(guid, GUID)) return NULL;
    m = calloc(1, sizeof *m);
    if (m) to_start(m);
    return m;
}

void fmi2FreeInstance(fmi2Component c) { free(c); }

fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean td, fmi2Real tolerance, fmi2Real start_time,
                               fmi2Boolean sd, fmi2Real stop) {
    (void)td, (void)tolerance, (void)sd, (void)stop;
    ((Model *)c)->time = start_time;
    return fmi2OK;
}

fmi2Status fmi2EnterInitializationMode(fmi2Component c) { ((Model *)c)->initializing = 1; return fmi2OK; }
fmi2Status fmi2ExitInitializationMode(fmi2Component c) {
    ((Model *)c)->initializing = 0;
    compute(c);
    return fmi2OK;
}
fmi2Status fmi2Terminate(fmi2Component c) { (void)c; return fmi2OK; }
fmi2Status fmi2Reset(fmi2Component c) {
#ifdef LIE_RESET
    double kept = ((Model *)c)->real[0];
    to_start(c);
    ((Model *)c)->real[0] = kept;
#else
    to_start(c);
#endif
    return fmi2OK;
}

/* Values */

#define ACCESS(Type, type, field, count) \
    fmi2Status fmi2Get##Type(fmi2Component c, const fmi2ValueReference r[], size_t n, type v[]) { \
        Model *m = c; \
        size_t i; \
        if (m->initializing || IS_EXCHANGE) compute(m); \
        for (i = 0; i < n; i++) { \
            if (r[i] >= count) return fmi2Error; \
            v[i] = m->field[r[i]]; \
        } \
        return fmi2OK; \
    } \
    fmi2Status fmi2Set##Type(fmi2Component c, const fmi2ValueReference r[], size_t n, const type v[]) { \
        Model *m = c; \
        size_t i; \
        for (i = 0; i < n; i++) { \
            if (r[i] >= count) return fmi2Error; \
            m->field[r[i]] = v[i]; \
        } \
        return fmi2OK; \
    }
ACCESS(Real, fmi2Real, real, N_REALS)
ACCESS(Boolean, fmi2Boolean, boolean, N_BOOLS)

#define NONE(Type, type) \
    fmi2Status fmi2Get##Type(fmi2Component c, const fmi2ValueReference r[], size_t n, type v[]) { \
        (void)c, (void)r, (void)v; \
        return n ? fmi2Error : fmi2OK; \
    } \
    fmi2Status fmi2Set##Type(fmi2Component c, const fmi2ValueReference r[], size_t n, const type v[]) { \
        (void)c, (void)r, (void)v; \
        return n ? fmi2Error : fmi2OK; \
    }
NONE(Integer, fmi2Integer)
NONE(String, fmi2String)

/* State. LIE_STATE forgets the second state, LIE_SERIALIZED writes where it is and not what. */

fmi2Status fmi2GetFMUstate(fmi2Component c, fmi2FMUstate *s) {
#ifdef LIE_CRASH
    abort();
#endif
    if (!*s) *s = malloc(sizeof(Model));
    memcpy(*s, c, sizeof(Model));
    return fmi2OK;
}
fmi2Status fmi2SetFMUstate(fmi2Component c, fmi2FMUstate s) {
    Model *m = c;
    double kept = m->real[N_STATES - 1], rate = m->rate[N_REALS - 1];
    memcpy(m, s, sizeof *m);
    (void)kept, (void)rate;
#ifdef LIE_STATE
    m->real[N_STATES - 1] = kept;
#endif
#ifdef LIE_STATE_OF_RATES
    memset(m->rate, 0, sizeof m->rate);
#endif
    return fmi2OK;
}
fmi2Status fmi2FreeFMUstate(fmi2Component c, fmi2FMUstate *s) { (void)c; free(*s); *s = NULL; return fmi2OK; }
fmi2Status fmi2SerializedFMUstateSize(fmi2Component c, fmi2FMUstate s, size_t *n) {
    (void)c, (void)s;
    *n = sizeof(Model);
    return fmi2OK;
}
#ifdef LIE_SERIALIZED
static Model hidden[100];
static int count = 0;
#endif
fmi2Status fmi2SerializeFMUstate(fmi2Component c, fmi2FMUstate s, fmi2Byte b[], size_t n) {
    (void)c;
    if (n != sizeof(Model)) return fmi2Error;
#ifdef LIE_SERIALIZED
    memset(b, 0, n);
    memcpy(&hidden[count], s, n);
    memcpy(b, &count, sizeof count);
    count = (count + 1) % 100;
#else
    memcpy(b, s, n);
#endif
    return fmi2OK;
}
fmi2Status fmi2DeSerializeFMUstate(fmi2Component c, const fmi2Byte b[], size_t n, fmi2FMUstate *s) {
    (void)c;
    if (n != sizeof(Model)) return fmi2Error;
#ifdef LIE_CRASH_ELSEWHERE
    abort();
#endif
    if (!*s) *s = malloc(sizeof(Model));
#ifdef LIE_SERIALIZED
    memcpy(*s, &hidden[*(const int *)b], n);
#else
    memcpy(*s, b, n);
#endif
    return fmi2OK;
}

/* Derivatives */

fmi2Status fmi2GetDirectionalDerivative(fmi2Component c, const fmi2ValueReference z[], size_t nz,
                                        const fmi2ValueReference v[], size_t nv, const fmi2Real dv[],
                                        fmi2Real dz[]) {
    size_t i, j;
    for (i = 0; i < nz; i++)
        for (dz[i] = 0.0, j = 0; j < nv; j++) dz[i] += partial(c, (int)z[i], (int)v[j]) * dv[j];
    return fmi2OK;
}

fmi2Status fmi2SetRealInputDerivatives(fmi2Component c, const fmi2ValueReference r[], size_t n,
                                       const fmi2Integer order[], const fmi2Real v[]) {
    size_t i;
    for (i = 0; i < n; i++) {
        if (order[i] != 1) return fmi2Error;
        ((Model *)c)->rate[r[i]] = v[i];
    }
    return fmi2OK;
}
fmi2Status fmi2GetRealOutputDerivatives(fmi2Component c, const fmi2ValueReference r[], size_t n,
                                        const fmi2Integer order[], fmi2Real v[]) {
    size_t i;
    for (i = 0; i < n; i++) {
        if (order[i] != 1) return fmi2Error;
        v[i] = slope_of(c, (int)r[i]);
    }
    return fmi2OK;
}

/* Co-simulation */

fmi2Status fmi2DoStep(fmi2Component c, fmi2Real time, fmi2Real h, fmi2Boolean forget) {
    Model *m = c;
    (void)forget;
    if (fabs(time - m->time) > 1e-9 * (1.0 + fabs(time)) || !(h > 0.0)) return fmi2Error;
    step(m, h);
    memset(m->rate, 0, sizeof m->rate);
    m->time = time + h;
    compute(m);
    return fmi2OK;
}
fmi2Status fmi2CancelStep(fmi2Component c) { (void)c; return fmi2Error; }
fmi2Status fmi2GetStatus(fmi2Component c, const fmi2StatusKind k, fmi2Status *v) { (void)c, (void)k, (void)v; return fmi2Discard; }
fmi2Status fmi2GetRealStatus(fmi2Component c, const fmi2StatusKind k, fmi2Real *v) { (void)c, (void)k, (void)v; return fmi2Discard; }
fmi2Status fmi2GetIntegerStatus(fmi2Component c, const fmi2StatusKind k, fmi2Integer *v) { (void)c, (void)k, (void)v; return fmi2Discard; }
fmi2Status fmi2GetBooleanStatus(fmi2Component c, const fmi2StatusKind k, fmi2Boolean *v) { (void)c, (void)k, (void)v; return fmi2Discard; }
fmi2Status fmi2GetStringStatus(fmi2Component c, const fmi2StatusKind k, fmi2String *v) { (void)c, (void)k, (void)v; return fmi2Discard; }

/* Model exchange */

fmi2Status fmi2EnterEventMode(fmi2Component c) { (void)c; return fmi2OK; }
fmi2Status fmi2NewDiscreteStates(fmi2Component c, fmi2EventInfo *info) {
    memset(info, 0, sizeof *info);
    info->newDiscreteStatesNeeded = update(c);
    return fmi2OK;
}
fmi2Status fmi2EnterContinuousTimeMode(fmi2Component c) { (void)c; return fmi2OK; }
fmi2Status fmi2CompletedIntegratorStep(fmi2Component c, fmi2Boolean forget, fmi2Boolean *event, fmi2Boolean *end) {
    (void)c, (void)forget;
    *event = *end = fmi2False;
    return fmi2OK;
}
fmi2Status fmi2SetTime(fmi2Component c, fmi2Real time) { ((Model *)c)->time = time; return fmi2OK; }
fmi2Status fmi2SetContinuousStates(fmi2Component c, const fmi2Real x[], size_t n) {
    if (n != N_STATES) return fmi2Error;
    memcpy(((Model *)c)->real, x, n * sizeof *x);
    return fmi2OK;
}
fmi2Status fmi2GetContinuousStates(fmi2Component c, fmi2Real x[], size_t n) {
    if (n != N_STATES) return fmi2Error;
    memcpy(x, ((Model *)c)->real, n * sizeof *x);
    return fmi2OK;
}
fmi2Status fmi2GetDerivatives(fmi2Component c, fmi2Real dx[], size_t n) {
    if (n != N_STATES) return fmi2Error;
    compute(c);
    memcpy(dx, ((Model *)c)->real + N_STATES, n * sizeof *dx);
#ifdef LIE_VECTOR
    dx[0] *= 1.5;
#endif
    return fmi2OK;
}
fmi2Status fmi2GetEventIndicators(fmi2Component c, fmi2Real z[], size_t n) {
    if (n != N_INDICATORS) return fmi2Error;
    indicators(c, z);
    return fmi2OK;
}
fmi2Status fmi2GetNominalsOfContinuousStates(fmi2Component c, fmi2Real x[], size_t n) {
    size_t i;
    (void)c;
    for (i = 0; i < n; i++) x[i] = 1.0;
    return fmi2OK;
}
