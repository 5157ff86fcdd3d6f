/* Events: their conditions, and firing until no condition is newly true.
 *
 * Elements 0 … N_Z−1 are crossings (state events), N_Z … N_E−1 are times. A group is a declared
 * event: one element, or one for each element of a vector. An element fires when its condition
 * becomes true; `holds` is the condition as last acknowledged (for BOTH: the crossing's sign).
 */
#if N_E

/* So many firings of one element in so short a time (s) are chattering. */
enum { MAX_REPEATS = 1000 };
static const double chatter = 1e-6;

/* Guards and times change only at events, crossings always. */
static void conditions(Instance *m) {
    double t = m->now.time;
    int i;
    evaluate(m, plant_guards, t, m->now.value, m->guard);
    m->n_watched = 0;
    for (i = 0; i < N_E; i++)
        if (m->guard[i] != 0.0 || direction[i] == BOTH) m->watched[m->n_watched++] = i;
#if N_Z
    evaluate(m, plant_crossings, t, m->now.value, m->z0);
#endif
#if N_E > N_Z
    evaluate(m, plant_times, t, m->now.value, m->at + N_Z);
#endif
}

/* Whether the conditions are numbers; a time may lie at infinity: never. */
static int are_defined(Instance *m) {
    int i;
    for (i = 0; i < N_E; i++) {
        const char *what = isnan(m->guard[i]) ? "guard" : i < N_Z ? "crossing" : "time";
        if (!isnan(m->guard[i]) && (i < N_Z ? isfinite(m->z0[i]) : !isnan(m->at[i]))) continue;
        FAIL("the %s of event '%s' is not finite at t = %.17g", what, event_name[i], m->now.time);
    }
    return 1;
}

/* The condition of an element with crossing z, apart from its guard; for BOTH the sign. */
static int relation(const Instance *m, int i, double z) {
    if (i >= N_Z) return m->now.time >= m->at[i];
    return direction[i] == FALLING ? z < 0.0 : z > 0.0;
}

static int is_new(const Instance *m, int i, double z) {
    int now = relation(m, i, z);
    if (m->guard[i] == 0.0 || m->now.passing[i]) return 0;
    return direction[i] == BOTH ? now != m->now.holds[i] : now && !m->now.holds[i];
}

/* Whether the crossing moves towards the relation `to`, at rate zd. */
static int is_heading(int i, int to, double zd) {
    return (direction[i] == FALLING) == (to != 0) ? zd < 0.0 : zd > 0.0;
}

static void acknowledge(Instance *m, int i, double z) {
    m->now.holds[i] = relation(m, i, z) && (direction[i] == BOTH || m->guard[i] != 0.0);
}

/* Rates of the crossings at time t, states x and slope f, of groups with an element that is watched. */
static void crossing_rates(Instance *m, double t, const double *x, const double *f, double *zd) {
    const double *du = m->interpolating ? m->now.rate : NULL;
    int n, known = 0;
    for (n = 0; n < m->n_watched; n++) {
        int i = m->watched[n], g = element_group[i];
        if (i < known || i >= N_Z) continue;
        known = group_first[g] + group_size[g];
        forward(m, group_rate[g], t, x, 1.0, f, du, NULL, zd + group_first[g]);
    }
}

/* An element that fires again and again without time going on is refused. */
static int is_chattering(Instance *m, int i) {
    State *s = &m->now;
    if (!(s->time - s->window[i] <= chatter)) {
        s->window[i] = s->time;
        s->fired[i] = 0;
    }
    s->last[i] = s->time;
    return ++s->fired[i] > MAX_REPEATS;
}

/* Let the elements of group g that are marked in `newly` fire. */
static int fire(Instance *m, int g) {
    int first = group_first[g], count = group_size[g], i, j;
    evaluate(m, group_change[g], m->now.time, m->now.value, m->changed);
    for (i = first; i < first + count; i++) {
        if (!m->newly[i]) continue;
        if (is_chattering(m, i))
            FAIL("event '%s' fired %d times between t = %.17g and t = %.17g: it chatters; add a "
                 "mode in which it rests", event_name[i], MAX_REPEATS, m->now.window[i], m->now.time);
        report(m, fmi2OK, LOG_EVENTS, "event '%s' at t = %.17g", event_name[i], m->now.time);
    }
    for (j = group_changes[g]; j < group_changes[g + 1]; j++) {
        int at = change_at[j], element = change_element[j];
        double value = m->changed[j - group_changes[g]];
        if (element >= 0 && !m->newly[first + element]) continue;
        if (!isfinite(value))
            FAIL("event '%s' sets %s to a value that is not finite at t = %.17g",
                 event_name[first], variable_name[at], m->now.time);
        if (is_integer[at] && (value != floor(value) || fabs(value) > 2147483647.0))
            FAIL("event '%s' sets the mode %s to %.17g at t = %.17g, which is no integer",
                 event_name[first], variable_name[at], value, m->now.time);
        m->now.value[at] = value;
    }
    jumped(m);
    return 1;
}

/* After firing: what was forced just before its zero is on its way through, or was turned back. */
static void acknowledge_fired(Instance *m, int g) {
    int i, rated = 0;
    for (i = group_first[g]; i < group_first[g] + group_size[g]; i++) {
        int to, forced = m->now.forced[i];
        if (!m->newly[i]) continue;
        m->now.forced[i] = 0;
        to = direction[i] == BOTH ? !m->now.holds[i] : 1;
        acknowledge(m, i, m->z0[i]);
        if (!forced || i >= N_Z || m->guard[i] == 0.0 || relation(m, i, m->z0[i]) == to) continue;
        if (!rated) crossing_rates(m, m->now.time, m->now.value, slope(m), m->zd0);
        rated = 1;
        if (is_heading(i, to, m->zd0[i])) {
            m->now.passing[i] = 1;
            m->now.holds[i] = (unsigned char)to;
        }
    }
}

/* Take the conditions as they are now, at the crossings z0. What passes through its zero stays
 * acknowledged until it is through or has turned back. */
static void acknowledge_watched(Instance *m) {
    int n, rated = m->start_known;
    for (n = 0; n < m->n_watched; n++) {
        int i = m->watched[n];
        if (m->now.passing[i] && m->guard[i] != 0.0 && relation(m, i, m->z0[i]) != m->now.holds[i]) {
            if (!rated) crossing_rates(m, m->now.time, m->now.value, slope(m), m->zd0);
            rated = 1;
            if (is_heading(i, m->now.holds[i], m->zd0[i])) continue;
        }
        m->now.passing[i] = 0;
        acknowledge(m, i, m->z0[i]);
    }
}

/* The same for all elements: guards may have changed. */
static void acknowledge_all(Instance *m) {
    int i;
    for (i = 0; i < N_E; i++)
        if (m->guard[i] == 0.0) m->now.passing[i] = m->now.holds[i] = 0;
    acknowledge_watched(m);
}

/* Fire events, in the order of declaration, until none is new. `forced` marks those that were
 * found at a crossing. Return 0 after a failure, which is reported. */
static int settle(Instance *m, int *any) {
    int g, i;
    for (;;) {
        dependents_now(m);
        conditions(m);
        if (!are_defined(m)) return 0;
        for (g = 0; g < N_GROUPS; g++) {
            int found = 0;
            for (i = group_first[g]; i < group_first[g] + group_size[g]; i++) {
                m->newly[i] = m->now.forced[i] || is_new(m, i, m->z0[i]);
                found |= m->newly[i];
            }
            if (found) break;
        }
        if (g == N_GROUPS) break;
        memcpy(m->z1, m->z0, sizeof m->z1);
        if (!fire(m, g)) return 0;
        dependents_now(m);
        conditions(m);
        acknowledge_fired(m, g);
        /* What another event has taken the ground from is looked for again. */
        for (i = 0; i < N_Z; i++)
            if (m->guard[i] == 0.0 || m->z0[i] != m->z1[i]) m->now.forced[i] = 0;
        if (any) *any = 1;
    }
    acknowledge_all(m);
    return 1;
}

/* When the next time event is due; HUGE_VAL if none is. */
static double next_time(const Instance *m) {
    double next = HUGE_VAL;
    int n, i;
    for (n = m->n_watched; n > 0 && (i = m->watched[n - 1]) >= N_Z; n--)
        if (!m->now.holds[i] && m->at[i] > m->now.time && m->at[i] < next) next = m->at[i];
    return next;
}

static int is_time_due(const Instance *m) {
    int n, i;
    for (n = m->n_watched; n > 0 && (i = m->watched[n - 1]) >= N_Z; n--)
        if (is_new(m, i, 0.0)) return 1;
    return 0;
}

/* Before the first events: nothing has fired, and signs are what they are. */
static int begin_events(Instance *m) {
    int i;
    dependents_now(m);
    conditions(m);
    for (i = 0; i < N_E; i++) {
        m->now.passing[i] = 0;
        m->now.window[i] = m->now.last[i] = -HUGE_VAL;
        m->now.holds[i] = direction[i] == BOTH && m->z0[i] > 0.0;
    }
    return settle(m, NULL);
}

#endif
