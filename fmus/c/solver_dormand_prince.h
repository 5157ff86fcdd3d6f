/* Dormand-Prince 5(4); returns the error in units of the tolerance. */
#include "error_norm.h"

enum { ERROR_ORDER = 5 };

static double attempt(Instance *m, double h, double *x1) {
    static const double a[7][6] = {
        {0},
        {1.0 / 5},
        {3.0 / 40, 9.0 / 40},
        {44.0 / 45, -56.0 / 15, 32.0 / 9},
        {19372.0 / 6561, -25360.0 / 2187, 64448.0 / 6561, -212.0 / 729},
        {9017.0 / 3168, -355.0 / 33, 46732.0 / 5247, 49.0 / 176, -5103.0 / 18656},
        {35.0 / 384, 0.0, 500.0 / 1113, 125.0 / 192, -2187.0 / 6784, 11.0 / 84},
    };
    static const double c[7] = {0.0, 1.0 / 5, 3.0 / 10, 4.0 / 5, 8.0 / 9, 1.0, 1.0};
    static const double e[7] = {71.0 / 57600, 0.0, -71.0 / 16695, 71.0 / 1920,
                                -17253.0 / 339200, 22.0 / 525, -1.0 / 40};
    const double *x = m->now.value;
    double *error = m->xs;
    int i, j, s;
    slope(m);
    for (s = 1; s < 7; s++) {
        for (i = 0; i < N_X; i++) {
            double sum = 0.0;
            for (j = 0; j < s; j++) sum += a[s][j] * m->k[j][i];
            x1[i] = x[i] + h * sum;
        }
        rhs(m, m->now.time + c[s] * h, x1, m->k[s]);
    }
    for (i = 0; i < N_X; i++) {
        double sum = 0.0;
        for (j = 0; j < 7; j++) sum += e[j] * m->k[j][i];
        error[i] = h * sum;
    }
    return error_norm(m, error, x1);
}
