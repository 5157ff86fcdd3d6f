/* Directional derivatives, input derivatives and output derivatives: exact, from CasADi. */

static fmi2Status seed_known(Instance *m, const fmi2ValueReference known[], size_t n, const fmi2Real seed[]) {
    size_t i;
    memset(m->seed, 0, sizeof m->seed);
    for (i = 0; i < n; i++) {
        if (known[i] >= N_VALUES) REFUSE("fmi2GetDirectionalDerivative: unknown value reference %u", known[i]);
        if (kind[known[i]] == COMPUTED || known[i] >= FIRST_SOLVER || is_integer[known[i]])
            REFUSE("fmi2GetDirectionalDerivative: %s is no state, input, parameter or memory", variable_name[known[i]]);
        if (!isfinite(seed[i]))
            REFUSE("fmi2GetDirectionalDerivative: the seed of %s is not finite", variable_name[known[i]]);
        m->seed[known[i]] += seed[i];
    }
    return fmi2OK;
}

fmi2Status fmi2GetDirectionalDerivative(fmi2Component component, const fmi2ValueReference unknown[],
                                        size_t n_unknown, const fmi2ValueReference known[],
                                        size_t n_known, const fmi2Real seed[], fmi2Real value[]) {
    BEGIN("fmi2GetDirectionalDerivative", GETTING);
    double *s = m->seed;
    const double *x = m->now.value;
    int derivatives = 0, outputs = 0;
    size_t i;
    if ((n_known && (!known || !seed)) || (n_unknown && (!unknown || !value)))
        REFUSE("fmi2GetDirectionalDerivative: a null pointer was given");
    for (i = 0; i < n_unknown; i++) {
        fmi2ValueReference vr = unknown[i];
        if (vr >= N_VALUES) REFUSE("fmi2GetDirectionalDerivative: unknown value reference %u", vr);
        if (is_integer[vr] || (kind[vr] != COMPUTED && !is_output[vr]))
            REFUSE("fmi2GetDirectionalDerivative: %s is no derivative or output", variable_name[vr]);
        derivatives |= vr >= N_X && vr < FIRST_INPUT;
        outputs |= vr >= FIRST_OUTPUT;
    }
    if (seed_known(m, known, n_known, seed) != fmi2OK) return fmi2Error;
    dependents_now(m);
#if N_DEPENDENTS
    forward(m, fwd1_plant_dependents, m->now.time, x, 0.0, s, s + FIRST_INPUT, s, s + FIRST_DEPENDENT);
#endif
    if (derivatives) forward(m, fwd1_plant_rhs, m->now.time, x, 0.0, s, s + FIRST_INPUT, s, s + N_X);
    if (outputs) forward(m, fwd1_plant_outputs, m->now.time, x, 0.0, s, s + FIRST_INPUT, s, s + FIRST_OUTPUT);
    for (i = 0; i < n_unknown; i++) {
        value[i] = s[unknown[i]];
        if (!isfinite(value[i]) && (m->now.stage & RUNNING))
            REFUSE_AT("fmi2GetDirectionalDerivative: that of %s is not finite at t = %.17g",
                      variable_name[unknown[i]], m->now.time);
    }
    return fmi2OK;
}

/* The input moves as u + u'·(t − t_c) during the next doStep, and then rests. */
fmi2Status fmi2SetRealInputDerivatives(fmi2Component component, const fmi2ValueReference vr[],
                                       size_t n, const fmi2Integer order[], const fmi2Real value[]) {
    BEGIN_AS(fmi2CoSimulation, "fmi2SetRealInputDerivatives", INSTANTIATED | INITIALIZATION | STEPPING);
    size_t i;
    if (n && (!vr || !order || !value)) REFUSE("fmi2SetRealInputDerivatives: a null pointer was given");
    for (i = 0; i < n; i++) {
        if (vr[i] < FIRST_INPUT || vr[i] >= FIRST_PARAMETER)
            REFUSE("fmi2SetRealInputDerivatives: value reference %u is no input", vr[i]);
        if (order[i] != 1) REFUSE("fmi2SetRealInputDerivatives: order %d; only order 1 is taken", (int)order[i]);
        if (!isfinite(value[i]))
            REFUSE("fmi2SetRealInputDerivatives: the derivative of %s is not finite", variable_name[vr[i]]);
    }
    if (m->now.rates_spent) memset(m->now.rate, 0, sizeof m->now.rate);
    m->now.rates_spent = 0;
    for (i = 0; i < n; i++) m->now.rate[vr[i] - FIRST_INPUT] = value[i];
    return fmi2OK;
}

/* Output derivatives at the communication point: at the end of a step with moving inputs these
 * move still. */
fmi2Status fmi2GetRealOutputDerivatives(fmi2Component component, const fmi2ValueReference vr[],
                                        size_t n, const fmi2Integer order[], fmi2Real value[]) {
    BEGIN_AS(fmi2CoSimulation, "fmi2GetRealOutputDerivatives", STEPPING | TERMINATED | FAILED);
    double *s = m->seed;
    size_t i;
    if (N_UPDATES) REFUSE("fmi2GetRealOutputDerivatives: memories move this model's outputs at every step");
    if (n && (!vr || !order || !value)) REFUSE("fmi2GetRealOutputDerivatives: a null pointer was given");
    for (i = 0; i < n; i++) {
        if (vr[i] >= N_VALUES || !is_output[vr[i]] || is_integer[vr[i]])
            REFUSE("fmi2GetRealOutputDerivatives: value reference %u is no real output", vr[i]);
        if (order[i] != 1) REFUSE("fmi2GetRealOutputDerivatives: order %d; only order 1 is given", (int)order[i]);
    }
    if (m->now.stage != FAILED) refresh(m, STALE_DERIVATIVES);
    memset(s, 0, sizeof m->seed);
    memcpy(s, m->now.value + N_X, N_X * sizeof(double));
    forward(m, fwd1_plant_outputs, m->now.time, m->now.value, 1.0, s, m->now.rate, NULL, s + FIRST_OUTPUT);
    for (i = 0; i < n; i++) {
        value[i] = s[vr[i]];
        if (!isfinite(value[i]) && (m->now.stage & RUNNING))
            REFUSE_AT("fmi2GetRealOutputDerivatives: that of %s is not finite at t = %.17g",
                      variable_name[vr[i]], m->now.time);
    }
    return fmi2OK;
}
