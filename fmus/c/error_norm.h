/* The error of a step in units of its tolerance, root mean square over the states. */
static double error_norm(const Instance *m, const double *error, const double *x1) {
    const double *x = m->now.value;
    double relative = m->now.value[FIRST_SOLVER + 1], absolute = m->now.value[FIRST_SOLVER + 2];
    double sum = 0.0;
    int i;
    for (i = 0; i < N_X; i++) {
        double scale = absolute * nominal[i] + relative * fmax(fabs(x[i]), fabs(x1[i]));
        double ratio = error[i] / scale;
        sum += ratio * ratio;
    }
    return N_X ? sqrt(sum / N_X) : 0.0;
}
