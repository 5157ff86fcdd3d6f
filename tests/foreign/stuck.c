/* Co-simulation and model exchange, honest unless the environment asks for more:
 *   x' = u − x,  y = x;  x starts at 1; steps are exact for inputs that are held
 * STUCK_IN is the function in which it happens, STUCK_HOW what: "loop" does not return, "abort" does
 * that; "slow" takes 0.2 s in each of the first ten calls, "logs" logs 2^20 messages of 1 KB in the
 * first, both only where the file STUCK_ONCE is not there yet. Three names are no functions: "load",
 * "unload" and "exit", when the process ends.
 */
#ifndef _WIN32
#define _GNU_SOURCE
#include <dlfcn.h>
#include <unistd.h>
#else
#include <windows.h>
#endif
#include <stdio.h>
#include "fmi2Functions.h"

enum { X, DER_X, U, Y, N_REALS };
enum { N_BOOLS = 0 };
#define N_STATES 1
#define N_INDICATORS 1
#define IS_EXCHANGE exchange
static int exchange; /* the kind instantiated last: all of a process go the same way */
static const double start[] = {1.0, 0.0, 0.0, 1.0};
static const int start_boolean[] = {0};

/* Functions that may be stuck: common.h's under another name, with one of ours around each. */
#define INNER(name) inner_##name
#undef fmi2Instantiate
#undef fmi2FreeInstance
#undef fmi2Terminate
#undef fmi2GetReal
#undef fmi2SetReal
#undef fmi2GetFMUstate
#undef fmi2DeSerializeFMUstate
#undef fmi2DoStep
#undef fmi2SetTime
#undef fmi2GetDerivatives
#define fmi2Instantiate INNER(fmi2Instantiate)
#define fmi2FreeInstance INNER(fmi2FreeInstance)
#define fmi2Terminate INNER(fmi2Terminate)
#define fmi2GetReal INNER(fmi2GetReal)
#define fmi2SetReal INNER(fmi2SetReal)
#define fmi2GetFMUstate INNER(fmi2GetFMUstate)
#define fmi2DeSerializeFMUstate INNER(fmi2DeSerializeFMUstate)
#define fmi2DoStep INNER(fmi2DoStep)
#define fmi2SetTime INNER(fmi2SetTime)
#define fmi2GetDerivatives INNER(fmi2GetDerivatives)
#include "common.h"
#undef fmi2Instantiate
#undef fmi2FreeInstance
#undef fmi2Terminate
#undef fmi2GetReal
#undef fmi2SetReal
#undef fmi2GetFMUstate
#undef fmi2DeSerializeFMUstate
#undef fmi2DoStep
#undef fmi2SetTime
#undef fmi2GetDerivatives

static const fmi2CallbackFunctions *callbacks;

static void rest(int milliseconds) {
#ifdef _WIN32
    Sleep(milliseconds);
#else
    usleep(1000 * milliseconds);
#endif
}

static void log_much(void) {
    static char text[1024];
    long left = 1L << 18;
    memset(text, 'm', sizeof text - 1);
    while (left--) callbacks->logger(callbacks->componentEnvironment, "stuck", fmi2OK, "logAll", "%s", text);
}

static int is_first(void) {
    FILE *file = fopen(getenv("STUCK_ONCE"), "wx");
    if (file) fclose(file);
    return file != NULL;
}

static int is_here(const char *where) {
    const char *in = getenv("STUCK_IN");
    return in && !strcmp(in, where);
}

/* Do what the environment asks for in this function. */
static void stuck(const char *where) {
    static int calls, is_busy; /* since the library was loaded */
    const char *how = getenv("STUCK_HOW");
    if (!is_here(where) || !how) return;
    if (!strcmp(how, "abort")) abort();
    if (!strcmp(how, "loop")) {
        const fmi2CallbackFunctions *f = callbacks;
        if (f) f->logger(f->componentEnvironment, "stuck", fmi2OK, "logAll", "%s is stuck", where);
        for (;;) rest(100);
    }
    if (++calls == 1) is_busy = is_first();
    if (is_busy && !strcmp(how, "slow") && calls <= 10) rest(200);
    if (is_busy && !strcmp(how, "logs") && calls == 1) log_much();
}

#ifndef _WIN32
__attribute__((constructor)) static void load(void) { stuck("load"); }
__attribute__((destructor)) static void unload(void) {
    callbacks = NULL;
    stuck("unload");
    stuck("exit");
}
static void stay(void) {
    Dl_info info;
    if (is_here("exit") && dladdr((void *)stay, &info)) dlopen(info.dli_fname, RTLD_NOW);
}
#else
static void stay(void) {}
#endif

static void compute(Model *m) {
    m->real[DER_X] = m->real[U] - m->real[X];
    m->real[Y] = m->real[X];
}
static void step(Model *m, double h) {
    m->real[X] = m->real[U] + (m->real[X] - m->real[U]) * exp(-h);
}
static double partial(const Model *m, int unknown, int known) {
    (void)m;
    if (unknown == DER_X) return known == U ? 1.0 : known == X ? -1.0 : 0.0;
    return unknown == Y && known == X;
}
static double slope_of(const Model *m, int output) { return output == Y ? m->real[DER_X] : 0.0; }
static int update(Model *m) { (void)m; stuck("fmi2NewDiscreteStates"); return 0; }
static void indicators(const Model *m, double *z) { (void)m; stuck("fmi2GetEventIndicators"); z[0] = 1.0; }

fmi2Component fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String guid, fmi2String resources,
                              const fmi2CallbackFunctions *f, fmi2Boolean visible, fmi2Boolean logging) {
    stay();
    callbacks = f;
    exchange = type == fmi2ModelExchange;
    stuck("fmi2Instantiate");
    return inner_fmi2Instantiate(name, type, guid, resources, f, visible, logging);
}
void fmi2FreeInstance(fmi2Component c) { stuck("fmi2FreeInstance"); inner_fmi2FreeInstance(c); }
fmi2Status fmi2Terminate(fmi2Component c) { stuck("fmi2Terminate"); return inner_fmi2Terminate(c); }
fmi2Status fmi2GetReal(fmi2Component c, const fmi2ValueReference r[], size_t n, fmi2Real v[]) {
    stuck("fmi2GetReal");
    return inner_fmi2GetReal(c, r, n, v);
}
fmi2Status fmi2SetReal(fmi2Component c, const fmi2ValueReference r[], size_t n, const fmi2Real v[]) {
    stuck("fmi2SetReal");
    return inner_fmi2SetReal(c, r, n, v);
}
fmi2Status fmi2GetFMUstate(fmi2Component c, fmi2FMUstate *s) {
    stuck("fmi2GetFMUstate");
    return inner_fmi2GetFMUstate(c, s);
}
fmi2Status fmi2DeSerializeFMUstate(fmi2Component c, const fmi2Byte b[], size_t n, fmi2FMUstate *s) {
    stuck("fmi2DeSerializeFMUstate");
    return inner_fmi2DeSerializeFMUstate(c, b, n, s);
}
fmi2Status fmi2DoStep(fmi2Component c, fmi2Real t, fmi2Real h, fmi2Boolean forget) {
    stuck("fmi2DoStep");
    return inner_fmi2DoStep(c, t, h, forget);
}
fmi2Status fmi2SetTime(fmi2Component c, fmi2Real t) { stuck("fmi2SetTime"); return inner_fmi2SetTime(c, t); }
fmi2Status fmi2GetDerivatives(fmi2Component c, fmi2Real dx[], size_t n) {
    stuck("fmi2GetDerivatives");
    return inner_fmi2GetDerivatives(c, dx, n);
}
