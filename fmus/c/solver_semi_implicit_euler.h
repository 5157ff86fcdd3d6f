/* Semi-implicit Euler: the other states first, then the positions with the others' new values.
 * Dry friction is taken implicitly (Moreau's time-stepping scheme): it takes from a state's new
 * value what it can bear in the step, and no more than brings it to exactly zero.
 * x1 may be the states themselves. */
static double attempt(Instance *m, double h, double *x1) {
    const double *x = m->now.value;
    double *dx = m->xs;
    const Run *r;
    int i;
    evaluate(m, plant_others, m->now.time, x, dx);
    if (x1 != x) memcpy(x1, x, N_X * sizeof(double));
    EACH_RUN(r, others) {
        for (i = 0; i < r->count; i++) x1[r->at + i] += h * dx[r->first + i];
    }
    EACH_RUN(r, frictions) {
        const double *bears = dx + N_OTHERS + r->first;
        for (i = 0; i < r->count; i++) {
            double moving = x1[r->at + i], most = h * bears[i];
            double taken = moving < -most ? -most : moving;
            x1[r->at + i] = moving - (taken <= most ? taken : most); /* no number: nor is this */
        }
    }
    evaluate(m, plant_positions, m->now.time + h, x1, dx);
    EACH_RUN(r, positions) {
        for (i = 0; i < r->count; i++) x1[r->at + i] += h * dx[r->first + i];
    }
    return 0.0;
}
