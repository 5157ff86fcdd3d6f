/* What an instance is.
 *
 * All values lie in one array, indexed by their value reference:
 *   states | derivatives | inputs | parameters | dependent parameters | modes and memories
 *   | outputs | solver parameters
 * All that changes during a run is in struct State; saving and restoring it is a copy.
 */

enum {
    INSTANTIATED = 1,
    INITIALIZATION = 2,
    STEPPING = 4, /* co-simulation: between steps */
    EVENT = 8,    /* model exchange */
    CONTINUOUS = 16,
    TERMINATED = 32,
    FAILED = 64,
    RUNNING = STEPPING | EVENT | CONTINUOUS,
    GETTING = INITIALIZATION | RUNNING | TERMINATED | FAILED,
    SETTING = INSTANTIATED | INITIALIZATION | STEPPING | EVENT, /* in continuous time, reals only */
    ANY = INSTANTIATED | GETTING
};

enum { STALE_DEPENDENTS = 1, STALE_DERIVATIVES = 2, STALE_OUTPUTS = 4, STALE = 7 };

typedef struct {
    char guid[sizeof MODEL_GUID]; /* a state of another model is not taken */
    int type;                     /* fmi2CoSimulation or fmi2ModelExchange */
    int stage;
    int stale;       /* which computed values do not belong to the current ones yet */
    int rates_spent; /* the input derivatives were for the step that is done */
    int stop_defined;
    double stop;
    double time;
    double rates_from; /* input = value + rate · (t − rates_from) */
    double next_step;  /* what a solver with error control tries next */
    double value[N_VALUES];
    double rate[SIZE_U];
    unsigned char holds[SIZE_E];   /* the event's condition, as last acknowledged */
    unsigned char passing[SIZE_E]; /* fired just before its zero, and on the way through it */
    unsigned char forced[SIZE_E];  /* found at its zero, to fire next */
    int fired[SIZE_E];             /* how often since window, to tell chattering */
    double window[SIZE_E];
    double last[SIZE_E]; /* when it fired last */
} State;

typedef struct {
    State now;
    char *name;
    fmi2CallbackLogger logger;
    fmi2ComponentEnvironment environment;
    unsigned logged; /* categories, as bits */
    int interpolating;
    casadi_int iw[SIZE_IW];
    double w[SIZE_W];
    double u[SIZE_U]; /* inputs at the time of an evaluation, when they are interpolated */
    double step[2 + SIZE_U]; /* a step's time, its length, the inputs at its end */
    double seed[N_VALUES];
    double k[STAGES][SIZE_X]; /* slopes; the first one is kept from step to step */
    double xs[SIZE_X], x1[SIZE_X], f1[SIZE_X];
    double matrix[SIZE_MATRIX];
    int pivot[SIZE_PIVOT];
    int slope_known; /* k[0] belongs to the current time and states */
    int start_known; /* z0, zd0 too */
    double z0[SIZE_E], zd0[SIZE_E], z1[SIZE_E], zd1[SIZE_E], guard[SIZE_E], at[SIZE_E];
    unsigned char newly[SIZE_E];
    int watched[SIZE_E], n_watched; /* the elements whose guards let them fire, and those for BOTH */
    double changed[SIZE_CHANGES];
} Instance;

/* Logging: a message is complete before it reaches the logger, which may ignore arguments. */

enum { LOG_EVENTS, LOG_WARNING, LOG_DISCARD, LOG_ERROR, LOG_FATAL, LOG_ALL, CATEGORIES };
enum { EVERY_CATEGORY = (1 << CATEGORIES) - 1 };
static const char *const category_name[CATEGORIES] = {
    "logEvents", "logStatusWarning", "logStatusDiscard", "logStatusError", "logStatusFatal", "logAll",
};

static int is_logged(const Instance *m, fmi2Status status, int category) {
    if (!m->logger) return 0;
    return status >= fmi2Error || (m->logged & (1u << category));
}

static void report(Instance *m, fmi2Status status, int category, const char *format, ...) {
    char text[512];
    va_list arguments;
    if (!is_logged(m, status, category)) return;
    va_start(arguments, format);
    vsnprintf(text, sizeof text, format, arguments);
    va_end(arguments);
    m->logger(m->environment, m->name, status, category_name[category], text);
}

/* An error, with the time at which the instance stands. */
static void report_now(Instance *m, const char *format, ...) {
    char text[480];
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(text, sizeof text, format, arguments);
    va_end(arguments);
    report(m, fmi2Error, LOG_ERROR, "%s (t = %.17g)", text, m->now.time);
}

/* A refused call changes nothing; after a failure of the model only getters, reset and restoring
 * a state go on. Every line says when: REFUSE adds it, the others' words name a time. */
#define REFUSE(...) do { report_now(m, __VA_ARGS__); return fmi2Error; } while (0)
#define REFUSE_AT(...) do { report(m, fmi2Error, LOG_ERROR, __VA_ARGS__); return fmi2Error; } while (0)
#define FAIL(...) do { report(m, fmi2Error, LOG_ERROR, __VA_ARGS__); m->now.stage = FAILED; return 0; } while (0)

static const char *stage_name(int stage) {
    switch (stage) {
        case INSTANTIATED: return "after instantiation";
        case INITIALIZATION: return "in initialization mode";
        case STEPPING: return "between steps";
        case EVENT: return "in event mode";
        case CONTINUOUS: return "in continuous-time mode";
        case TERMINATED: return "after termination";
        default: return "after an error";
    }
}

#define BEGIN(function, stages) \
    Instance *m = (Instance *)component; \
    if (!m) return fmi2Error; \
    if (!(m->now.stage & (stages))) REFUSE(function " is not allowed %s", stage_name(m->now.stage))

#define BEGIN_AS(kind, function, stages) \
    Instance *m = (Instance *)component; \
    if (!m) return fmi2Error; \
    if (m->now.type != kind) REFUSE(function " is not for an instance for " #kind); \
    if (!(m->now.stage & (stages))) REFUSE(function " is not allowed %s", stage_name(m->now.stage))
