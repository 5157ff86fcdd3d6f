/* RODAS 4(3), a stiffly accurate Rosenbrock method (Hairer & Wanner II, IV.7), in the form that
 * needs no product with the Jacobian: (1/(hγ) − J) u = f + (1/h) Σ c u + h d ∂f/∂t.
 * Returns the error in units of the tolerance. */
#include "error_norm.h"

enum { ERROR_ORDER = 4 };

/* LU factors of the column-major matrix with partial pivoting; 0 if it is singular. */
static int factorise(Instance *m) {
    double *a = m->matrix;
    int i, j, k;
    for (k = 0; k < N_X; k++) {
        double *column = a + (size_t)k * N_X;
        int p = k;
        for (i = k + 1; i < N_X; i++)
            if (fabs(column[i]) > fabs(column[p])) p = i;
        m->pivot[k] = p;
        if (!(fabs(column[p]) > 0.0)) return 0;
        if (p != k)
            for (j = 0; j < N_X; j++) {
                double *other = a + (size_t)j * N_X, swap = other[k];
                other[k] = other[p];
                other[p] = swap;
            }
        for (i = k + 1; i < N_X; i++) column[i] /= column[k];
        for (j = k + 1; j < N_X; j++) {
            double *other = a + (size_t)j * N_X, factor = other[k];
            if (factor != 0.0)
                for (i = k + 1; i < N_X; i++) other[i] -= column[i] * factor;
        }
    }
    return 1;
}

static void solve(const Instance *m, double *b) {
    const double *a = m->matrix;
    int i, k;
    for (k = 0; k < N_X; k++) {
        double swap = b[k];
        b[k] = b[m->pivot[k]];
        b[m->pivot[k]] = swap;
    }
    for (k = 0; k < N_X; k++)
        for (i = k + 1; i < N_X; i++) b[i] -= a[(size_t)k * N_X + i] * b[k];
    for (k = N_X - 1; k >= 0; k--) {
        b[k] /= a[(size_t)k * N_X + k];
        for (i = 0; i < k; i++) b[i] -= a[(size_t)k * N_X + i] * b[k];
    }
}

static double attempt(Instance *m, double h, double *x1) {
    static const double gamma = 0.25;
    static const double a[6][5] = {
        {0},
        {1.544},
        {0.9466785280815826, 0.2557011698983284},
        {3.314825187068521, 2.896124015972201, 0.9986419139977817},
        {1.221224509226641, 6.019134481288629, 12.53708332932087, -0.6878860361058950},
        {1.221224509226641, 6.019134481288629, 12.53708332932087, -0.6878860361058950, 1.0},
    };
    static const double c[6][5] = {
        {0},
        {-5.6688},
        {-2.430093356833875, -0.2063599157091915},
        {-0.1073529058151375, -9.594562251023355, -20.47028614809616},
        {7.496443313967647, -10.24680431464352, -33.99990352819905, 11.70890893206160},
        {8.083246795921522, -7.981132988064893, -31.52159432874371, 16.31930543123136,
         -6.058818238834054},
    };
    static const double alpha[6] = {0.0, 0.386, 0.21, 0.63, 1.0, 1.0};
    static const double d[6] = {0.25, -0.1043, 0.1035, -0.0362, 0.0, 0.0};
    const double *x = m->now.value, *f = slope(m);
    double *ft = m->seed, t = m->now.time; /* seed is free here */
    int i, j, s;
    evaluate(m, plant_jacobian, t, x, m->matrix);
    for (i = 0; i < N_X * N_X; i++) m->matrix[i] = -m->matrix[i];
    for (i = 0; i < N_X; i++) m->matrix[(size_t)i * N_X + i] += 1.0 / (h * gamma);
    if (!factorise(m)) {
        for (i = 0; i < N_X; i++) x1[i] = NAN;
        return HUGE_VAL;
    }
    memset(m->xs, 0, sizeof m->xs);
    forward(m, fwd1_plant_rhs, t, x, 1.0, m->xs, m->interpolating ? m->now.rate : NULL, NULL, ft);
    for (s = 0; s < 6; s++) {
        double *u = m->k[s + 1];
        if (s == 0) {
            memcpy(u, f, N_X * sizeof(double));
        } else {
            for (i = 0; i < N_X; i++) {
                double sum = x[i];
                for (j = 0; j < s; j++) sum += a[s][j] * m->k[j + 1][i];
                x1[i] = sum;
            }
            rhs(m, t + alpha[s] * h, x1, u);
        }
        for (i = 0; i < N_X; i++) {
            double sum = 0.0;
            for (j = 0; j < s; j++) sum += c[s][j] * m->k[j + 1][i];
            u[i] += sum / h + h * d[s] * ft[i];
        }
        solve(m, u);
    }
    for (i = 0; i < N_X; i++) x1[i] += m->k[6][i];
    return error_norm(m, m->k[6], x1);
}
