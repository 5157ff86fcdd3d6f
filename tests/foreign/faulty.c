/* Co-simulation only: an integrator that fails in a way, and at a place, that parameters choose.
 *   x' = u,  y = x;  x starts at 1; exact for an input that is held or a straight line
 * fault: what happens; phase: in which function; after: not before this time (s). Two faults discard
 * steps, one of them those longer than `longest` (s). Fault 0 is an honest FMU.
 * No parameter is set before instantiation: a fault there is the define LIE_NONE, LIE_ABORT, ….
 * Whatever a master must not call after an error ends the process with exit code 99.
 */
#include <stdio.h>
#include <time.h>
#ifndef _WIN32
#include <signal.h>
#include <unistd.h>
#endif
#include "fmi2Functions.h"

enum { X, DER_X, U, Y, AFTER, LONGEST, FAULT, PHASE, N_REALS };
enum { N_BOOLS = 0 };
#define N_STATES 1
#define N_INDICATORS 0
#define IS_EXCHANGE 0
static const double start[] = {1.0, 0.0, 0.0, 1.0, 0.5, 0.004, 0.0, 0.0};
static const int start_boolean[] = {0};

enum {
    HONEST, FAIL, DISCARD_LONG, DISCARD_ALL, FATAL, NO_NUMBER, SEGV, ABORT, EXIT, LOOP, MANY_LOGS,
    HUGE_LOG, SLOW, PRINT, READ, WARN, LEAVE_CHILD
};
enum { STEP, GET, SETUP, ENTER, LEAVE, TERMINATE, FREE, SAVE, INSTANTIATE };

/* Functions that may fail: common.h's under another name, with one of ours around each. */
#define INNER(name) inner_##name
#undef fmi2DoStep
#undef fmi2GetReal
#undef fmi2GetInteger
#undef fmi2SetInteger
#undef fmi2SetupExperiment
#undef fmi2EnterInitializationMode
#undef fmi2ExitInitializationMode
#undef fmi2Terminate
#undef fmi2FreeInstance
#undef fmi2GetFMUstate
#undef fmi2Instantiate
#undef fmi2GetRealStatus
#define fmi2DoStep INNER(fmi2DoStep)
#define fmi2GetReal INNER(fmi2GetReal)
#define fmi2GetInteger INNER(fmi2GetInteger)
#define fmi2SetInteger INNER(fmi2SetInteger)
#define fmi2SetupExperiment INNER(fmi2SetupExperiment)
#define fmi2EnterInitializationMode INNER(fmi2EnterInitializationMode)
#define fmi2ExitInitializationMode INNER(fmi2ExitInitializationMode)
#define fmi2Terminate INNER(fmi2Terminate)
#define fmi2FreeInstance INNER(fmi2FreeInstance)
#define fmi2GetFMUstate INNER(fmi2GetFMUstate)
#define fmi2Instantiate INNER(fmi2Instantiate)
#define fmi2GetRealStatus INNER(fmi2GetRealStatus)
#include "common.h"
#undef fmi2DoStep
#undef fmi2GetReal
#undef fmi2GetInteger
#undef fmi2SetInteger
#undef fmi2SetupExperiment
#undef fmi2EnterInitializationMode
#undef fmi2ExitInitializationMode
#undef fmi2Terminate
#undef fmi2FreeInstance
#undef fmi2GetFMUstate
#undef fmi2Instantiate
#undef fmi2GetRealStatus

static void compute(Model *m) {
    m->real[DER_X] = m->real[U];
    m->real[Y] = m->real[X];
}
static void step(Model *m, double h) {
    m->real[X] += h * (m->real[U] + 0.5 * h * m->rate[U]);
}
static double partial(const Model *m, int unknown, int known) {
    (void)m;
    return (unknown == DER_X && known == U) || (unknown == Y && known == X);
}
static double slope_of(const Model *m, int output) { return output == Y ? m->real[U] : 0.0; }
static int update(Model *m) { (void)m; return 0; }
static void indicators(const Model *m, double *z) { (void)m, (void)z; }

typedef struct {
    Model model; /* first: to common.h an instance is a Model */
    const fmi2CallbackFunctions *f;
    char name[64];
    double reached; /* the last successful time */
    int refused;    /* the status after which next to nothing may be called */
    int logged;     /* much is logged once only */
} Faulty;

static void say(const Faulty *x, fmi2Status status, const char *format, const char *text) {
    x->f->logger(x->f->componentEnvironment, x->name, status, "logAll", format, text);
}

static void many_logs(Faulty *x, long count) {
    static char text[1024];
    if (x->logged++) return;
    memset(text, 'm', sizeof text - 1);
    while (count--) say(x, fmi2OK, "%s", text);
}

static void huge_log(Faulty *x, size_t size) {
    char *text = x->logged++ ? NULL : malloc(size);
    if (!text) return;
    memset(text, 'h', size - 1);
    text[size - 1] = 0;
    say(x, fmi2OK, "%s", text);
    free(text);
}

/* Do what was chosen, if it is to be done here; return the status. */
static fmi2Status act(Faulty *x, int fault, const char *where) {
    volatile int *volatile nowhere = NULL;
    volatile int turns = 0;
    clock_t began = clock();
    char line[100];
    switch (fault) {
        case FAIL: say(x, fmi2Error, "%s fails on purpose", where); return x->refused = fmi2Error;
        case FATAL: say(x, fmi2Fatal, "%s is lost on purpose", where); return x->refused = fmi2Fatal;
        case WARN: say(x, fmi2Warning, "%s warns on purpose", where); return fmi2Warning;
        case SEGV: say(x, fmi2OK, "%s writes nowhere", where); *nowhere = 1; break;
        case ABORT: say(x, fmi2OK, "%s aborts", where); abort();
        case EXIT: say(x, fmi2OK, "%s exits", where); exit(3);
        case LOOP: say(x, fmi2OK, "%s does not return", where); for (;;) turns = !turns;
        case MANY_LOGS: many_logs(x, 1L << 18); say(x, fmi2OK, "%s logged much", where); break;
        case HUGE_LOG: huge_log(x, (size_t)1 << 28); break;
        case SLOW: while (clock() - began < CLOCKS_PER_SEC / 10) turns = !turns; break;
        case PRINT: printf("%s prints\n", where); fflush(stdout); break;
        case READ: if (fgets(line, sizeof line, stdin)) return fmi2Error; break;
#ifndef _WIN32
        case LEAVE_CHILD: if (!fork()) for (;;) pause(); else abort();
#endif
    }
    return fmi2OK;
}

static fmi2Status fault(fmi2Component c, int phase, const char *where) {
    Faulty *x = c;
    const double *r = x->model.real;
    if (x->refused && !(phase == FREE && x->refused != fmi2Fatal)) exit(99);
    if ((int)r[PHASE] != phase) return fmi2OK;
    if (phase <= GET && x->model.time < r[AFTER] - 1e-9) return fmi2OK;
    return act(x, (int)r[FAULT], where);
}

#define OR_RETURN(call) do { fmi2Status status = call; if (status > fmi2Warning) return status; } while (0)

fmi2Component fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String guid, fmi2String resources,
                              const fmi2CallbackFunctions *f, fmi2Boolean visible, fmi2Boolean logging) {
    Faulty *x;
    int failing = HONEST;
    (void)type, (void)resources, (void)visible, (void)logging;
    if (strcmp(guid, GUID)) return NULL;
    x = calloc(1, sizeof *x);
    if (!x) return NULL;
    x->f = f;
    strncpy(x->name, name, sizeof x->name - 1);
    to_start(&x->model);
#ifdef LIE_NONE
    failing = FAIL;
#elif defined LIE_ABORT
    failing = ABORT;
#elif defined LIE_LOOP
    failing = LOOP;
#endif
    if (act(x, failing, "fmi2Instantiate") <= fmi2Warning) return x;
    free(x);
    return NULL;
}
void fmi2FreeInstance(fmi2Component c) {
    fault(c, FREE, "fmi2FreeInstance");
    free(c);
}
fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean td, fmi2Real tolerance, fmi2Real t,
                               fmi2Boolean sd, fmi2Real stop) {
    OR_RETURN(fault(c, SETUP, "fmi2SetupExperiment"));
    return inner_fmi2SetupExperiment(c, td, tolerance, t, sd, stop);
}
fmi2Status fmi2EnterInitializationMode(fmi2Component c) {
    OR_RETURN(fault(c, ENTER, "fmi2EnterInitializationMode"));
    return inner_fmi2EnterInitializationMode(c);
}
fmi2Status fmi2ExitInitializationMode(fmi2Component c) {
    OR_RETURN(fault(c, LEAVE, "fmi2ExitInitializationMode"));
    return inner_fmi2ExitInitializationMode(c);
}
fmi2Status fmi2Terminate(fmi2Component c) { return fault(c, TERMINATE, "fmi2Terminate"); }
fmi2Status fmi2GetFMUstate(fmi2Component c, fmi2FMUstate *s) {
    OR_RETURN(fault(c, SAVE, "fmi2GetFMUstate"));
    return inner_fmi2GetFMUstate(c, s);
}
fmi2Status fmi2GetReal(fmi2Component c, const fmi2ValueReference r[], size_t n, fmi2Real v[]) {
    OR_RETURN(fault(c, GET, "fmi2GetReal"));
    return inner_fmi2GetReal(c, r, n, v);
}
fmi2Status fmi2GetInteger(fmi2Component c, const fmi2ValueReference r[], size_t n, fmi2Integer v[]) {
    size_t i;
    for (i = 0; i < n; i++) v[i] = (int)((Model *)c)->real[FAULT + r[i]];
    return fmi2OK;
}
fmi2Status fmi2SetInteger(fmi2Component c, const fmi2ValueReference r[], size_t n, const fmi2Integer v[]) {
    size_t i;
    for (i = 0; i < n; i++) ((Model *)c)->real[FAULT + r[i]] = v[i];
    return fmi2OK;
}

static double discarded(const Faulty *x, double t, double h) {
    const double *r = x->model.real;
    if ((int)r[PHASE] != STEP || t < r[AFTER] - 1e-9) return 0.0;
    if ((int)r[FAULT] == DISCARD_ALL) return h;
    return (int)r[FAULT] == DISCARD_LONG && h > r[LONGEST] * (1.0 + 1e-9) ? h - r[LONGEST] : 0.0;
}
fmi2Status fmi2DoStep(fmi2Component c, fmi2Real t, fmi2Real h, fmi2Boolean forget) {
    Faulty *x = c;
    double left = discarded(x, t, h);
    OR_RETURN(fault(c, STEP, "fmi2DoStep"));
    if (left < h) OR_RETURN(inner_fmi2DoStep(c, t, h - left, forget));
    x->reached = t + (h - left);
    if (left > 0.0) {
        say(x, fmi2Discard, "%s discards the step on purpose", "fmi2DoStep");
        return fmi2Discard;
    }
    if ((int)x->model.real[FAULT] == NO_NUMBER && t + h >= x->model.real[AFTER] - 1e-9)
        x->model.real[Y] = NAN;
    return fmi2OK;
}
fmi2Status fmi2GetRealStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Real *value) {
    const Faulty *x = c;
    if (kind != fmi2LastSuccessfulTime || (int)x->model.real[FAULT] == DISCARD_ALL) return fmi2Discard;
    *value = x->reached;
    return fmi2OK;
}
