/* Enquiry, creation, destruction, initialization, termination, reset. */

static void to_start(Instance *m, int type) {
    memset(&m->now, 0, sizeof m->now);
    memcpy(m->now.guid, MODEL_GUID, sizeof m->now.guid);
    memcpy(m->now.value, start_value, sizeof m->now.value);
    m->now.type = type;
    m->now.stage = INSTANTIATED;
    m->now.rates_spent = 1;
    m->interpolating = 0;
    jumped(m);
}

const char *fmi2GetTypesPlatform(void) { return fmi2TypesPlatform; }
const char *fmi2GetVersion(void) { return fmi2Version; }

fmi2Status fmi2SetDebugLogging(fmi2Component component, fmi2Boolean on, size_t n,
                               const fmi2String categories[]) {
    BEGIN("fmi2SetDebugLogging", ANY);
    unsigned chosen = 0;
    size_t i;
    int c;
    for (i = 0; i < n; i++) {
        const char *name = categories ? categories[i] : NULL;
        for (c = 0; c < CATEGORIES && !(name && !strcmp(name, category_name[c])); c++) {}
        if (c == CATEGORIES) REFUSE("fmi2SetDebugLogging: unknown log category"); /* not echoed: loggers may format */
        chosen |= c == LOG_ALL ? EVERY_CATEGORY : 1u << c;
    }
    if (!n) chosen = EVERY_CATEGORY;
    m->logged = on ? chosen : m->logged & ~chosen; /* on: only the given categories */
    return fmi2OK;
}

fmi2Component fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String guid, fmi2String resources,
                              const fmi2CallbackFunctions *functions, fmi2Boolean visible,
                              fmi2Boolean logging) {
    Instance *m = (Instance *)calloc(1, sizeof(Instance));
    size_t length = name ? strlen(name) : 0;
    (void)resources;
    (void)visible;
    if (!m) return NULL;
    m->name = (char *)calloc(length + 1, 1);
    if (m->name && length) memcpy(m->name, name, length);
    if (functions) {
        m->logger = functions->logger;
        m->environment = functions->componentEnvironment;
    }
    m->logged = logging ? EVERY_CATEGORY : 0;
    if (!m->name || !length) {
        report(m, fmi2Error, LOG_ERROR, "fmi2Instantiate: the instance name is missing");
    } else if (!guid || strcmp(guid, MODEL_GUID)) {
        report(m, fmi2Error, LOG_ERROR,
               "fmi2Instantiate: the GUID is not this binary's, which is " MODEL_GUID);
    } else if (type != fmi2CoSimulation && type != fmi2ModelExchange) {
        report(m, fmi2Error, LOG_ERROR, "fmi2Instantiate: unknown FMU type %d", (int)type);
    } else if (type == fmi2ModelExchange && !HAS_MODEL_EXCHANGE) {
        report(m, fmi2Error, LOG_ERROR,
               "fmi2Instantiate: this model has dry friction, which only its own solver takes: "
               "instantiate it for Co-Simulation");
    } else {
        to_start(m, type);
        return m;
    }
    free(m->name);
    free(m);
    return NULL;
}

void fmi2FreeInstance(fmi2Component component) {
    Instance *m = (Instance *)component;
    if (!m) return;
    free(m->name);
    free(m);
}

fmi2Status fmi2SetupExperiment(fmi2Component component, fmi2Boolean tolerance_defined,
                               fmi2Real tolerance, fmi2Real start, fmi2Boolean stop_defined,
                               fmi2Real stop) {
    BEGIN("fmi2SetupExperiment", INSTANTIATED);
    if (!isfinite(start)) REFUSE("fmi2SetupExperiment: the start time is not finite");
    if (stop_defined && !(stop >= start))
        REFUSE("fmi2SetupExperiment: stop time %.17g lies before start time %.17g", stop, start);
    if (tolerance_defined && !(tolerance > 0.0 && isfinite(tolerance)))
        REFUSE("fmi2SetupExperiment: the tolerance %.17g is not positive", tolerance);
#if ADAPTIVE
    if (tolerance_defined) m->now.value[FIRST_SOLVER + 1] = tolerance;
#endif
    m->now.time = start;
    m->now.stop_defined = stop_defined;
    m->now.stop = stop;
    jumped(m);
    return fmi2OK;
}

fmi2Status fmi2EnterInitializationMode(fmi2Component component) {
    BEGIN("fmi2EnterInitializationMode", INSTANTIATED);
    m->now.stage = INITIALIZATION;
    jumped(m);
    return fmi2OK;
}

/* Bring computed values up to date; the first that is not finite is an error (then 0). */
static int require_finite(Instance *m, int what) {
    int bad;
    refresh(m, what);
    if ((what & STALE_DERIVATIVES && (bad = not_finite(m->now.value, N_X, FIRST_INPUT)) >= 0) ||
        (bad = not_finite(m->now.value, FIRST_DEPENDENT, FIRST_DISCRETE)) >= 0 ||
        (bad = not_finite(m->now.value, FIRST_OUTPUT, FIRST_SOLVER)) >= 0)
        FAIL("%s is not finite at t = %.17g", variable_name[bad], m->now.time);
    return 1;
}

static int parameters_fit(Instance *m) {
    int i;
    for (i = FIRST_PARAMETER; i < N_VALUES; i++) {
        double value = m->now.value[i];
        if (i >= FIRST_DEPENDENT && i < FIRST_SOLVER) continue;
        if (!(value >= minimum[i] && value <= maximum[i]))
            FAIL("parameter %s = %.17g lies outside [%.17g, %.17g] at t = %.17g", variable_name[i],
                 value, minimum[i], maximum[i], m->now.time);
    }
    return 1;
}

fmi2Status fmi2ExitInitializationMode(fmi2Component component) {
    BEGIN("fmi2ExitInitializationMode", INITIALIZATION);
    if (!parameters_fit(m)) return fmi2Error;
    m->now.stage = m->now.type == fmi2CoSimulation ? STEPPING : EVENT;
#if N_E
    if (!begin_events(m)) return fmi2Error;
#endif
    return require_finite(m, STALE) ? fmi2OK : fmi2Error;
}

fmi2Status fmi2Terminate(fmi2Component component) {
    BEGIN("fmi2Terminate", RUNNING);
    m->now.stage = TERMINATED;
    return fmi2OK;
}

fmi2Status fmi2Reset(fmi2Component component) {
    BEGIN("fmi2Reset", ANY);
    to_start(m, m->now.type);
    return fmi2OK;
}
