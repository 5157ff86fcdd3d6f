/* Semi-implicit Euler, which `plant_step` makes: after the time it takes the step's length, and the
 * inputs at its end. */
static double attempt(Instance *m, double h, double *x1) {
    m->step[0] = m->now.time;
    m->step[1] = h;
    memcpy(m->step + 2, inputs_at(m, m->now.time + h), N_U * sizeof(double));
    evaluate_at(m, plant_step, m->step, m->now.value, x1);
    return 0.0;
}
