/* From one communication point to the next, with all events on the way. */

/* Memories that are updated after each inner step. */
static int update_memories(Instance *m) {
#if N_UPDATES
    const Run *r;
    int bad;
    evaluate(m, plant_update, m->now.time, m->now.value, m->changed);
    bad = not_finite(m->changed, 0, N_UPDATES);
    EACH_RUN(r, updates) {
        if (bad >= r->first && bad < r->first + r->count)
            FAIL("the update of %s is not finite at t = %.17g", variable_name[r->at + bad - r->first],
                 m->now.time);
        memcpy(m->now.value + r->at, m->changed + r->first, (size_t)r->count * sizeof(double));
    }
    jumped(m);
#else
    (void)m;
#endif
    return 1;
}

#if ADAPTIVE

/* A first step from the size of the states and their slope (Hairer, Nørsett & Wanner I, II.4). */
static double first_step(Instance *m, double longest) {
    double size = error_norm(m, m->now.value, m->now.value);
    double change = error_norm(m, slope(m), m->now.value);
    double h = size > 1e-5 && change > 1e-5 ? 0.01 * size / change : 1e-6;
    return fmin(h, longest);
}

/* Make one step of the right length, at most `longest`; return it, or 0 after a failure. */
static double controlled_step(Instance *m, double longest) {
    double most = m->now.value[FIRST_SOLVER], h, error;
    if (!(m->now.next_step > 0.0)) m->now.next_step = first_step(m, fmin(longest, most));
    h = fmin(m->now.next_step, most);
    for (;;) {
        int cut = h * 1.01 >= longest; /* not a tiny step to end with */
        double taken = cut ? longest : h, next;
        error = attempt(m, taken, m->x1);
        next = taken * fmin(5.0, fmax(0.2, 0.9 * pow(error, -1.0 / ERROR_ORDER)));
        if (!(error > 1.0) && isfinite(error)) {
            m->now.next_step = fmin(most, cut && next < h ? h : next);
            return taken;
        }
        h = isfinite(error) ? next : 0.2 * taken;
        if (!(h > 16.0 * DBL_EPSILON * fmax(fabs(m->now.time), 1e-3))) {
            int bad = not_finite(m->k[0], 0, N_X);
            if (bad >= 0) FAIL("%s is not finite at t = %.17g", variable_name[N_X + bad], m->now.time);
            bad = not_finite(m->x1, 0, N_X);
            if (bad >= 0) FAIL("%s is not finite at t = %.17g", variable_name[bad], m->now.time);
            FAIL("the solver's step became too small at t = %.17g: the solution ends here, or "
                 "solver.relative_tolerance is too tight", m->now.time);
        }
    }
}

#endif

/* Step from the current time to at most `limit`, `length` away, ending at the first crossing. */
static int step_once(Instance *m, double limit, double length) {
    double taken = length;
    int bad, events = 0;
    double *x1 = m->x1;
#if N_Z
    if (!m->start_known) crossing_rates(m, m->now.time, m->now.value, slope(m), m->zd0);
    m->start_known = 1;
#endif
#if ADAPTIVE
    if ((taken = controlled_step(m, length)) == 0.0) return 0;
#else
    attempt(m, length, x1);
#endif
    if ((bad = not_finite(x1, 0, N_X)) >= 0)
        FAIL("%s is not finite at t = %.17g", variable_name[bad], m->now.time + taken);
#if N_Z
    {
        double whole = taken, to = taken == length ? limit : m->now.time + taken;
        rhs(m, to, x1, m->f1);
        evaluate(m, plant_crossings, to, x1, m->z1);
        if ((bad = not_finite(m->z1, 0, N_Z)) >= 0)
            FAIL("the crossing of event '%s' is not finite at t = %.17g", event_name[bad], to);
        crossing_rates(m, to, x1, m->f1, m->zd1);
        if ((taken = first_crossing(m, whole)) < 0.0) return 0;
        events = taken != whole;
    }
#endif
    memcpy(m->now.value, x1, N_X * sizeof(double));
    m->now.time = taken == length ? limit : m->now.time + taken;
    m->now.stale |= STALE_DERIVATIVES | STALE_OUTPUTS;
    m->slope_known = m->start_known = 0;
#if N_Z
    if (!events) { /* the step's end is the next one's start */
        memcpy(m->k[0], m->f1, N_X * sizeof(double));
        memcpy(m->z0, m->z1, N_Z * sizeof(double));
        memcpy(m->zd0, m->zd1, N_Z * sizeof(double));
        m->slope_known = m->start_known = 1;
    }
#endif
    if (!update_memories(m)) return 0;
#if N_E
    if (events || N_UPDATES || is_time_due(m)) return settle(m, NULL);
    acknowledge_watched(m);
#else
    (void)events;
#endif
    return 1;
}

/* Advance to `target`, `length` away; return 0 after a failure, which is reported. */
static int advance_to(Instance *m, double target, double length) {
    while (m->now.time < target) {
        double limit = target;
#if N_E > N_Z
        double next = next_time(m);
        if (next < target) {
            limit = next;
            length = limit - m->now.time;
        }
#endif
        if (!step_once(m, limit, length)) return 0;
        length = target - m->now.time;
    }
    return 1;
}

/* Advance by `step` from `start`, where the instance stands. */
static int advance(Instance *m, double start, double step) {
#if ADAPTIVE
    return advance_to(m, start + step, step);
#else
    double count = ceil(step / m->now.value[FIRST_SOLVER] - 1e-6); /* 0.05 / 0.002 is not 26 steps */
    double h;
    long j, n = count < 1.0 ? 1 : (long)count;
    h = step / (double)n;
    for (j = 1; j <= n; j++)
        if (!advance_to(m, j == n ? start + step : start + (double)j * h, h)) return 0;
    return 1;
#endif
}
