/* Reading and writing values. */

/* What must be up to date for a value to be. */
static int stale_for(fmi2ValueReference vr) {
    if (kind[vr] != COMPUTED) return 0;
    return vr < FIRST_INPUT ? STALE_DERIVATIVES : vr < FIRST_DISCRETE ? STALE_DEPENDENTS : STALE_OUTPUTS;
}

/* Computed values are brought up to date first; after an error they are read as they are. */

#define GET(Type, type, integers) \
    fmi2Status Type(fmi2Component component, const fmi2ValueReference vr[], size_t n, type value[]) { \
        BEGIN(#Type, GETTING); \
        double sum = 0.0; \
        int what = 0; \
        size_t i; \
        if (n && (!vr || !value)) REFUSE(#Type ": a null pointer was given"); \
        for (i = 0; i < n; i++) { \
            if (vr[i] >= N_VALUES) REFUSE(#Type ": unknown value reference %u", vr[i]); \
            if (is_integer[vr[i]] != integers) REFUSE(#Type ": %s is %s", variable_name[vr[i]], integers ? "a Real" : "an Integer"); \
            what |= stale_for(vr[i]); \
        } \
        if (what & m->now.stale && m->now.stage != FAILED) refresh(m, what); \
        for (i = 0; i < n; i++) { \
            value[i] = (type)m->now.value[vr[i]]; \
            sum += m->now.value[vr[i]] * 0.0; \
        } \
        for (i = 0; sum != 0.0 && i < n; i++) { /* one is not finite */ \
            if (kind[vr[i]] == COMPUTED && !isfinite(m->now.value[vr[i]]) && (m->now.stage & RUNNING)) \
                REFUSE_AT(#Type ": %s is not finite at t = %.17g", variable_name[vr[i]], m->now.time); \
        } \
        return fmi2OK; \
    }
GET(fmi2GetReal, fmi2Real, 0)
GET(fmi2GetInteger, fmi2Integer, 1)

/* Whether the variable may be set now; if not, why. */
static const char *why_not(const Instance *m, fmi2ValueReference vr) {
    int stage = m->now.stage;
    if (kind[vr] == COMPUTED) return "is computed";
    if (kind[vr] == SET_BEFORE_RUN && (stage & RUNNING)) return "can only be set before the run";
    if (kind[vr] == SET_AT_EVENTS && stage == CONTINUOUS) return "can only be set in event mode";
    return NULL;
}

static fmi2Status set_one(Instance *m, fmi2ValueReference vr, double value) {
    int is_parameter = vr >= FIRST_PARAMETER && vr < FIRST_DEPENDENT;
    if (memcmp(&m->now.value[vr], &value, sizeof value)) { /* ±0 differ */
        m->now.stale |= is_parameter ? STALE : STALE & ~STALE_DEPENDENTS;
        m->slope_known = m->start_known = 0;
        m->now.value[vr] = value;
    }
    if (value >= minimum[vr] && value <= maximum[vr]) return fmi2OK;
    report(m, fmi2Warning, LOG_WARNING, "%s = %.17g lies outside [%.17g, %.17g]", variable_name[vr],
           value, minimum[vr], maximum[vr]);
    return fmi2Warning;
}

#define SET(Type, type, integers, stages) \
    fmi2Status Type(fmi2Component component, const fmi2ValueReference vr[], size_t n, const type value[]) { \
        BEGIN(#Type, stages); \
        fmi2Status status = fmi2OK; \
        size_t i; \
        if (n && (!vr || !value)) REFUSE(#Type ": a null pointer was given"); \
        for (i = 0; i < n; i++) { \
            if (vr[i] >= N_VALUES) REFUSE(#Type ": unknown value reference %u", vr[i]); \
            if (is_integer[vr[i]] != integers) REFUSE(#Type ": %s is %s", variable_name[vr[i]], integers ? "a Real" : "an Integer"); \
            if (why_not(m, vr[i])) REFUSE(#Type ": %s %s", variable_name[vr[i]], why_not(m, vr[i])); \
            if (!isfinite((double)value[i])) REFUSE(#Type ": the value for %s is not finite", variable_name[vr[i]]); \
        } \
        for (i = 0; i < n; i++) \
            if (set_one(m, vr[i], (double)value[i]) != fmi2OK) status = fmi2Warning; \
        return status; \
    }
SET(fmi2SetReal, fmi2Real, 0, SETTING | CONTINUOUS)
SET(fmi2SetInteger, fmi2Integer, 1, SETTING)

/* No variable is a boolean or a string. */
#define NO_VARIABLES(Type, type, stages, pointer) \
    fmi2Status Type(fmi2Component component, const fmi2ValueReference vr[], size_t n, \
                    pointer type value[]) { \
        BEGIN(#Type, stages); \
        (void)value; \
        if (n) REFUSE(#Type ": unknown value reference %u", vr ? vr[0] : 0); \
        return fmi2OK; \
    }
NO_VARIABLES(fmi2GetBoolean, fmi2Boolean, GETTING, )
NO_VARIABLES(fmi2GetString, fmi2String, GETTING, )
NO_VARIABLES(fmi2SetBoolean, fmi2Boolean, SETTING, const)
NO_VARIABLES(fmi2SetString, fmi2String, SETTING, const)
