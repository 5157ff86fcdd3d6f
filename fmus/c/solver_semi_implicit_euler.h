/* Semi-implicit Euler: the other states first, then the positions with the others' new values.
 * x1 may be the states themselves. */
static double attempt(Instance *m, double h, double *x1) {
    const double *x = m->now.value;
    double *dx = m->xs;
    int i;
    evaluate(m, plant_others, m->now.time, x, dx);
    if (x1 != x) memcpy(x1, x, N_X * sizeof(double));
    for (i = 0; i < N_OTHERS; i++) x1[others_at[i]] += h * dx[i];
    evaluate(m, plant_positions, m->now.time + h, x1, dx);
    for (i = 0; i < N_X - N_OTHERS; i++) x1[positions_at[i]] += h * dx[i];
    return 0.0;
}
