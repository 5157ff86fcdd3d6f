/* Model Exchange: the environment integrates; events happen in event mode. */

fmi2Status fmi2EnterEventMode(fmi2Component component) {
    BEGIN_AS(fmi2ModelExchange, "fmi2EnterEventMode", EVENT | CONTINUOUS);
    m->now.stage = EVENT;
    return fmi2OK;
}

fmi2Status fmi2NewDiscreteStates(fmi2Component component, fmi2EventInfo *info) {
    BEGIN_AS(fmi2ModelExchange, "fmi2NewDiscreteStates", EVENT);
    if (!info) REFUSE("fmi2NewDiscreteStates: a null pointer was given");
    memset(info, 0, sizeof *info);
#if N_E
    {
        double *before = m->xs, next; /* no large arrays on the stack */
        int any = 0;
        memcpy(before, m->now.value, N_X * sizeof(double));
        if (!settle(m, &any)) return fmi2Error;
        info->valuesOfContinuousStatesChanged = memcmp(before, m->now.value, N_X * sizeof(double)) != 0;
        next = next_time(m);
        info->nextEventTimeDefined = next < HUGE_VAL;
        info->nextEventTime = info->nextEventTimeDefined ? next : 0.0;
    }
#endif
    return require_finite(m, STALE) ? fmi2OK : fmi2Error;
}

fmi2Status fmi2EnterContinuousTimeMode(fmi2Component component) {
    BEGIN_AS(fmi2ModelExchange, "fmi2EnterContinuousTimeMode", EVENT);
    m->now.stage = CONTINUOUS;
    return fmi2OK;
}

/* Memories advance; and an event that the environment did not see asks for event mode. */
fmi2Status fmi2CompletedIntegratorStep(fmi2Component component, fmi2Boolean no_rollback,
                                       fmi2Boolean *enter_event_mode, fmi2Boolean *terminate) {
    BEGIN_AS(fmi2ModelExchange, "fmi2CompletedIntegratorStep", CONTINUOUS);
    (void)no_rollback;
    if (!enter_event_mode || !terminate) REFUSE("fmi2CompletedIntegratorStep: a null pointer was given");
    *enter_event_mode = *terminate = fmi2False;
    dependents_now(m);
    if (!update_memories(m)) return fmi2Error;
#if N_E
    {
        int i, is_due = 0;
        conditions(m);
        if (!are_defined(m)) return fmi2Error;
        for (i = 0; i < N_E; i++) is_due |= is_new(m, i, m->z0[i]);
        if (is_due) *enter_event_mode = fmi2True;
        else acknowledge_all(m);
    }
#endif
    return fmi2OK;
}

/* An integrator may look past the stop time, so that is no error here. */
fmi2Status fmi2SetTime(fmi2Component component, fmi2Real time) {
    BEGIN_AS(fmi2ModelExchange, "fmi2SetTime", EVENT | CONTINUOUS);
    if (!isfinite(time)) REFUSE("fmi2SetTime: the time is not finite");
    m->now.time = time;
    m->now.stale |= STALE_DERIVATIVES | STALE_OUTPUTS;
    m->slope_known = m->start_known = 0;
    return fmi2OK;
}

#define WITH_STATES(function, n, array) \
    if (n != N_X) REFUSE(function ": %u states given, the FMU has %u", (unsigned)n, (unsigned)N_X); \
    if (n && !array) REFUSE(function ": a null pointer was given")

fmi2Status fmi2SetContinuousStates(fmi2Component component, const fmi2Real x[], size_t n) {
    BEGIN_AS(fmi2ModelExchange, "fmi2SetContinuousStates", CONTINUOUS);
    int bad;
    WITH_STATES("fmi2SetContinuousStates", n, x);
    if ((bad = not_finite(x, 0, N_X)) >= 0)
        REFUSE("fmi2SetContinuousStates: the value for %s is not finite", variable_name[bad]);
    memcpy(m->now.value, x, n * sizeof(double));
    m->now.stale |= STALE_DERIVATIVES | STALE_OUTPUTS;
    m->slope_known = m->start_known = 0;
    return fmi2OK;
}

fmi2Status fmi2GetContinuousStates(fmi2Component component, fmi2Real x[], size_t n) {
    BEGIN_AS(fmi2ModelExchange, "fmi2GetContinuousStates", GETTING);
    WITH_STATES("fmi2GetContinuousStates", n, x);
    memcpy(x, m->now.value, n * sizeof(double));
    return fmi2OK;
}

fmi2Status fmi2GetNominalsOfContinuousStates(fmi2Component component, fmi2Real x[], size_t n) {
    BEGIN_AS(fmi2ModelExchange, "fmi2GetNominalsOfContinuousStates", ANY & ~INITIALIZATION);
    WITH_STATES("fmi2GetNominalsOfContinuousStates", n, x);
    memcpy(x, nominal, n * sizeof(double));
    return fmi2OK;
}

fmi2Status fmi2GetDerivatives(fmi2Component component, fmi2Real dx[], size_t n) {
    BEGIN_AS(fmi2ModelExchange, "fmi2GetDerivatives", GETTING);
    int bad;
    WITH_STATES("fmi2GetDerivatives", n, dx);
    if (m->now.stage != FAILED) refresh(m, STALE_DERIVATIVES);
    memcpy(dx, m->now.value + N_X, n * sizeof(double));
    if (m->now.stage != FAILED && (bad = not_finite(m->now.value, N_X, FIRST_INPUT)) >= 0)
        REFUSE_AT("fmi2GetDerivatives: %s is not finite at t = %.17g", variable_name[bad], m->now.time);
    return fmi2OK;
}

/* A crossing is shown on the side that was acknowledged, by this much of its nominal value: so it
 * is never zero where integration begins anew, and its event is due once it is seen. */
static const double hysteresis = 1e-10;

/* Crossings whose guard does not hold stand at 1, so that they trigger nothing. */
fmi2Status fmi2GetEventIndicators(fmi2Component component, fmi2Real z[], size_t n) {
    BEGIN_AS(fmi2ModelExchange, "fmi2GetEventIndicators", GETTING);
    if (n != N_Z) REFUSE("fmi2GetEventIndicators: %u indicators given, the FMU has %u", (unsigned)n, (unsigned)N_Z);
    if (n && !z) REFUSE("fmi2GetEventIndicators: a null pointer was given");
#if N_Z
    {
        int i;
        dependents_now(m);
        conditions(m);
        for (i = 0; i < N_Z; i++) {
            int is_above = (direction[i] == FALLING) != (m->now.holds[i] != 0);
            z[i] = m->z0[i] / crossing_nominal[i] + (is_above ? hysteresis : -hysteresis);
            if (m->guard[i] == 0.0) z[i] = 1.0;
        }
        if (m->now.stage != FAILED && (i = not_finite(z, 0, N_Z)) >= 0)
            REFUSE_AT("fmi2GetEventIndicators: the crossing of event '%s' is not finite at t = %.17g",
                      event_name[i], m->now.time);
    }
#endif
    return fmi2OK;
}
