/* Stepping with the solver inside. */

static int is_past_stop(const Instance *m, double time) {
    return m->now.stop_defined && time > m->now.stop + 1e-9 * (1.0 + fabs(m->now.stop));
}

/* Inputs that moved stay where they are at the step's end. */
static void rest_inputs(Instance *m, double step) {
    int i;
    if (!m->interpolating) return;
    for (i = 0; i < N_U; i++) m->now.value[FIRST_INPUT + i] += m->now.rate[i] * step;
    m->interpolating = 0;
    m->now.rates_spent = 1;
    m->slope_known = m->start_known = 0;
}

static int do_step(Instance *m, double current, double step) {
    m->interpolating = !m->now.rates_spent;
    /* What was found out at the last step's end holds still if nothing has changed since. */
    if (current != m->now.time || m->interpolating) m->slope_known = m->start_known = 0;
    m->now.time = current;
    m->now.rates_from = current;
    if (!m->interpolating) memset(m->now.rate, 0, sizeof m->now.rate);
    dependents_now(m);
#if N_E
    if (!m->start_known && !settle(m, NULL)) return 0; /* known: settled then */
#endif
    if (!advance(m, current, step)) return 0;
    rest_inputs(m, step);
    return require_finite(m, STALE_OUTPUTS);
}

fmi2Status fmi2DoStep(fmi2Component component, fmi2Real current, fmi2Real step,
                      fmi2Boolean no_rollback) {
    BEGIN_AS(fmi2CoSimulation, "fmi2DoStep", STEPPING);
    (void)no_rollback;
    if (!(fabs(current - m->now.time) <= 1e-9 * (1.0 + fabs(m->now.time))))
        REFUSE_AT("fmi2DoStep: called at t = %.17g, but the FMU stands at t = %.17g", current, m->now.time);
    if (!(step > 0.0) || !isfinite(step)) REFUSE("fmi2DoStep: the step size %.17g is not positive", step);
    if (!(current + step > current)) REFUSE_AT("fmi2DoStep: the step size %.17g is lost at t = %.17g", step, current);
    if (!(step / m->now.value[FIRST_SOLVER] <= 1e9))
        REFUSE("fmi2DoStep: %.3g inner steps in one step; enlarge solver.inner_step",
               step / m->now.value[FIRST_SOLVER]);
    if (is_past_stop(m, current + step))
        REFUSE("fmi2DoStep: t = %.17g lies past the stop time %.17g", current + step, m->now.stop);
    return do_step(m, current, step) ? fmi2OK : fmi2Error;
}

fmi2Status fmi2CancelStep(fmi2Component component) {
    BEGIN_AS(fmi2CoSimulation, "fmi2CancelStep", ANY);
    REFUSE("fmi2CancelStep: steps are not asynchronous");
}

#define NO_STATUS(Type, type) \
    fmi2Status Type(fmi2Component component, const fmi2StatusKind which, type *value) { \
        BEGIN_AS(fmi2CoSimulation, #Type, STEPPING | TERMINATED); \
        (void)which; \
        (void)value; \
        report(m, fmi2Discard, LOG_DISCARD, #Type ": no step was discarded"); \
        return fmi2Discard; \
    }
NO_STATUS(fmi2GetStatus, fmi2Status)
NO_STATUS(fmi2GetIntegerStatus, fmi2Integer)
NO_STATUS(fmi2GetBooleanStatus, fmi2Boolean)
NO_STATUS(fmi2GetStringStatus, fmi2String)

fmi2Status fmi2GetRealStatus(fmi2Component component, const fmi2StatusKind which, fmi2Real *value) {
    BEGIN_AS(fmi2CoSimulation, "fmi2GetRealStatus", STEPPING | TERMINATED);
    if (!value) REFUSE("fmi2GetRealStatus: a null pointer was given");
    if (which == fmi2LastSuccessfulTime) {
        *value = m->now.time;
        return fmi2OK;
    }
    report(m, fmi2Discard, LOG_DISCARD, "fmi2GetRealStatus: no step was discarded");
    return fmi2Discard;
}
