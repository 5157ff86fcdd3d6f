/* The plant's functions, called at a time and state with the instance's other values. */

typedef int (*Generated)(const double **arg, double **res, casadi_int *iw, double *w, int mem);

/* Where each argument of a generated function lies. */
static void arguments_at(Instance *m, const double *t, const double *x, const double **arg) {
    const double *inputs = m->now.value + FIRST_INPUT;
    int i;
    if (m->interpolating) {
        for (i = 0; i < N_U; i++) m->u[i] = inputs[i] + m->now.rate[i] * (*t - m->now.rates_from);
        inputs = m->u;
    }
    for (i = 0; i < N_ARGUMENTS; i++) {
        int at = argument_at[i];
        arg[i] = at < 0 ? t
               : at < N_X ? x + at
               : at >= FIRST_INPUT && at < FIRST_PARAMETER ? inputs + (at - FIRST_INPUT)
               : m->now.value + at;
    }
}

static void evaluate(Instance *m, Generated function, double t, const double *x, double *result) {
    const double *arg[SIZE_ARG];
    double *res[SIZE_RES];
    arguments_at(m, &t, x, arg);
    res[0] = result;
    function(arg, res, m->iw, m->w, 0);
}

/* The directional derivative of a function along seeds for time, states and (by value reference)
 * everything else; a null pointer stands for zeros. */
static void forward(Instance *m, Generated function, double t, const double *x, double dt,
                    const double *dx, const double *du, const double *others, double *result) {
    const double *arg[SIZE_ARG];
    double *res[SIZE_RES];
    int i;
    arguments_at(m, &t, x, arg);
    arg[N_ARGUMENTS] = NULL; /* the function's own result, which no derivative needs */
    for (i = 0; i < N_ARGUMENTS; i++) {
        int at = argument_at[i];
        arg[N_ARGUMENTS + 1 + i] = at < 0 ? &dt
            : at < N_X ? dx + at
            : at >= FIRST_INPUT && at < FIRST_PARAMETER ? (du ? du + (at - FIRST_INPUT) : NULL)
            : others ? others + at : NULL;
    }
    res[0] = result;
    function(arg, res, m->iw, m->w, 0);
}

static void dependents_now(Instance *m) {
#if N_DEPENDENTS
    if (m->now.stale & STALE_DEPENDENTS)
        evaluate(m, plant_dependents, m->now.time, m->now.value, m->now.value + FIRST_DEPENDENT);
#endif
    m->now.stale &= ~STALE_DEPENDENTS;
}

static void rhs(Instance *m, double t, const double *x, double *dx) {
    evaluate(m, plant_rhs, t, x, dx);
}

/* Everything that is computed and read through the interface. */
static void refresh(Instance *m, int what) {
    dependents_now(m);
    if (m->now.stale & what & STALE_DERIVATIVES)
        rhs(m, m->now.time, m->now.value, m->now.value + N_X);
    if (m->now.stale & what & STALE_OUTPUTS)
        evaluate(m, plant_outputs, m->now.time, m->now.value, m->now.value + FIRST_OUTPUT);
    m->now.stale &= ~what;
}

/* The first value in [from, to) that is not finite; -1 if all are. */
static int not_finite(const double *value, int from, int to) {
    double sum = 0.0;
    int i;
    for (i = from; i < to; i++) sum += value[i] * 0.0;
    if (sum == 0.0) return -1;
    for (i = from; i < to; i++)
        if (!isfinite(value[i])) return i;
    return -1;
}

/* The slope at the current time and states, computed once for all attempts of a step. */
static const double *slope(Instance *m) {
    if (!m->slope_known) rhs(m, m->now.time, m->now.value, m->k[0]);
    m->slope_known = 1;
    return m->k[0];
}

/* Something jumped: nothing that was computed still holds. */
static void jumped(Instance *m) {
    m->now.stale = STALE;
    m->slope_known = m->start_known = 0;
}
