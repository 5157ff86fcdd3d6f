/* Finding crossings inside a step, on the solver's own solution: each probe is a shorter step from
 * the same start. A pair of crossings of one element shows by its rates at the step's ends: it
 * heads towards zero at the start and away from it at the end.
 */
#if N_Z

/* The states at h into the step, in x1, and the crossings there, in z1. */
static void probe(Instance *m, double h) {
    attempt(m, h, m->x1);
    evaluate(m, plant_crossings, m->now.time + h, m->x1, m->z1);
}

static void probe_rates(Instance *m, double h) {
    rhs(m, m->now.time + h, m->x1, m->f1);
    crossing_rates(m, m->now.time + h, m->x1, m->f1, m->zd1);
}

/* Whether element i's relation differs from the one acknowledged. */
static int is_other(const Instance *m, int i, double z) {
    return relation(m, i, z) != m->now.holds[i];
}

/* Narrow [*low, *high], with element i as acknowledged at *low and not so at *high, until it is
 * as narrow as the time's resolution (Chandrupatla's method: inverse quadratic interpolation,
 * else bisection). */
static void narrow(Instance *m, int i, double *low, double *high, double z_low, double z_high) {
    double resolution = DBL_EPSILON * fmax(fabs(m->now.time), *high);
    double a = *high, fa = z_high, b = *low, fb = z_low, c = b, fc = fb, part = 0.5;
    int b_is_low = 1, turns;
    /* a is the newest end, b the other one, c the end that a replaced. */
    for (turns = 0; turns < 200; turns++) {
        double x = a + part * (b - a), fx, xi, phi, least;
        int beyond;
        probe(m, x);
        fx = m->z1[i];
        beyond = is_other(m, i, fx);
        if (beyond == b_is_low) { /* on a's side: replaces a */
            c = a, fc = fa;
        } else {
            c = b, fc = fb;
            b = a, fb = fa;
            b_is_low = !b_is_low;
        }
        a = x, fa = fx;
        if (fabs(b - a) <= 2.0 * resolution) break;
        least = resolution / fabs(b - a);
        xi = (a - b) / (c - b);
        phi = (fa - fb) / (fc - fb);
        part = 0.5;
        if (phi * phi < xi && (1.0 - phi) * (1.0 - phi) < 1.0 - xi)
            part = fa / (fb - fa) * fc / (fb - fc) + (c - a) / (b - a) * fa / (fc - fa) * fb / (fc - fb);
        if (!(part >= least)) part = least;
        if (part > 1.0 - least) part = 1.0 - least;
    }
    *low = b_is_low ? b : a;
    *high = b_is_low ? a : b;
}

/* Look for a place in (0, h) where element i's relation is `to`, although it is not at the ends:
 * where its rate vanishes. Return the place, with the states there in x1, or 0. */
static double between(Instance *m, int i, int to, double h) {
    double low = 0.0, high = h;
    while (high - low > 1e-9 * h) {
        double x = 0.5 * (low + high);
        probe(m, x);
        if (relation(m, i, m->z1[i]) == to) return x;
        probe_rates(m, x);
        if (is_heading(i, to, m->zd1[i])) low = x;
        else high = x;
    }
    return 0.0;
}

/* Whether element i may have been at the relation `to` and come back within the step h: the
 * tangents at both ends then reach zero inside it (with a margin of two for an inflection). */
static int may_dip(const Instance *m, int i, int to, double h) {
    return is_heading(i, to, m->zd0[i]) && !is_heading(i, to, m->zd1[i]) &&
           fabs(m->z0[i]) <= 2.0 * h * fabs(m->zd0[i]) && fabs(m->z1[i]) <= 2.0 * h * fabs(m->zd1[i]);
}

/* The end of a Zeno sequence: an element crosses again before time goes on. */
static double repeats(Instance *m, int i) {
    report(m, fmi2Error, LOG_ERROR, "event '%s' fires again and again at t = %.17g: it chatters; add a "
           "mode in which it rests", event_name[i], m->now.time);
    m->now.stage = FAILED;
    return -1.0;
}

/* Cut the step of length h at the first crossing; return the length up to just before it, with
 * the states there in x1 and the elements that cross marked in `forced`. The states at h must be
 * in x1, with crossings and rates at both ends known. Where a condition only ends, to come back
 * within the step, the step is cut without an event. Return −1 after a failure. */
static double first_crossing(Instance *m, double h) {
    double low = h, high = h;
    int i, n;
    for (n = 0; n < m->n_watched && (i = m->watched[n]) < N_Z; n++) {
        int passing = m->now.passing[i], to = passing ? m->now.holds[i] : !m->now.holds[i];
        double place = high;
        if (m->guard[i] == 0.0) continue;
        if (relation(m, i, m->z1[i]) != to) {
            if (!may_dip(m, i, to, high)) continue;
            place = between(m, i, to, high);
        } else if (!is_new(m, i, m->z1[i])) {
            continue; /* it has passed, or its condition has ended: no event in this step */
        }
        if (place > 0.0 && is_new(m, i, m->z1[i])) {
            low = 0.0;
            high = place;
            narrow(m, i, &low, &high, m->z0[i], m->z1[i]);
        } else if (place > 0.0) {
            low = high = place;
        }
        probe(m, high);
        probe_rates(m, high);
    }
    if (low == h) return h;
    for (i = 0; i < N_Z; i++) {
        m->now.forced[i] = (unsigned char)is_new(m, i, m->z1[i]);
        if (m->now.forced[i] && low == 0.0 && m->now.last[i] == m->now.time) return repeats(m, i);
    }
    if (low > 0.0) probe(m, low);
    else memcpy(m->x1, m->now.value, N_X * sizeof(double));
    return low;
}

#endif
