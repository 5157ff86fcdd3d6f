/* The classical Runge-Kutta method of order 4. */
static double attempt(Instance *m, double h, double *x1) {
    const double *x = m->now.value, *k1 = slope(m);
    double *xs = m->xs, *k2 = m->k[1], *k3 = m->k[2], *k4 = m->k[3];
    double t = m->now.time;
    int i;
    for (i = 0; i < N_X; i++) xs[i] = x[i] + 0.5 * h * k1[i];
    rhs(m, t + 0.5 * h, xs, k2);
    for (i = 0; i < N_X; i++) xs[i] = x[i] + 0.5 * h * k2[i];
    rhs(m, t + 0.5 * h, xs, k3);
    for (i = 0; i < N_X; i++) xs[i] = x[i] + h * k3[i];
    rhs(m, t + h, xs, k4);
    for (i = 0; i < N_X; i++)
        x1[i] = x[i] + h / 6.0 * (k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + k4[i]);
    return 0.0;
}
