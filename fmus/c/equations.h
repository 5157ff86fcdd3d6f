/* The plant's functions, called at a time and state with the instance's other values. */

/* The inputs at a time. */
static const double *inputs_at(Instance *m, double t) {
    const double *inputs = m->now.value + FIRST_INPUT;
    int i;
    if (!m->interpolating) return inputs;
    for (i = 0; i < N_U; i++) m->u[i] = inputs[i] + m->now.rate[i] * (t - m->now.rates_from);
    return m->u;
}

#define EACH_RUN(run, runs) for (run = runs; run < runs + sizeof runs / sizeof *runs; run++)

/* `t` is the time and what else the function takes with it. */
static void evaluate_at(Instance *m, Evaluated function, const double *t, const double *x,
                        double *result) {
    function(t, x, inputs_at(m, *t), m->now.value, m->iw, m->w, result);
}

static void evaluate(Instance *m, Evaluated function, double t, const double *x, double *result) {
    evaluate_at(m, function, &t, x, result);
}

static const double no_seeds[N_VALUES] = {0};

/* The directional derivative of a function along seeds for time, states, inputs and (by value
 * reference) everything else; a null pointer stands for zeros. */
static void forward(Instance *m, Derivative function, double t, const double *x, double dt,
                    const double *dx, const double *du, const double *others, double *result) {
    function(&t, x, inputs_at(m, t), m->now.value, &dt, dx, du ? du : no_seeds,
             others ? others : no_seeds, m->iw, m->w, result);
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

static int first_not_finite(const double *value, int from, int to) {
    int i;
    for (i = from; i < to; i++)
        if (!isfinite(value[i])) return i;
    return -1;
}

/* The first value in [from, to) that is not finite; -1 if all are. A sum is finite only if its terms
 * are; if it overflows, the search finds none. */
static inline int not_finite(const double *value, int from, int to) {
    double sum = 0.0, a = 0.0, b = 0.0, c = 0.0, d = 0.0, e = 0.0, f = 0.0, g = 0.0;
    int i;
    for (i = from; i + 8 <= to; i += 8) { /* eight sums, so that none waits for another */
        sum += value[i];
        a += value[i + 1];
        b += value[i + 2];
        c += value[i + 3];
        d += value[i + 4];
        e += value[i + 5];
        f += value[i + 6];
        g += value[i + 7];
    }
    for (; i < to; i++) sum += value[i];
    return isfinite(sum + (a + b + c) + (d + e + f + g)) ? -1 : first_not_finite(value, from, to);
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
