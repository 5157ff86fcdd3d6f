/* The chain of chain.py by hand, with the classical Runge-Kutta method: what export.py compares
 * the FMU's inner loop with. N, the number of vehicles, is defined before this file is included.
 * The same operations in the same order, so the results are the same bits. Two shapes, of which
 * the faster one counts: one loop that carries a coupler's force over to the next vehicle, and two
 * loops with an array of forces between them.
 */
#include <math.h>
#include <stddef.h>

typedef struct {
    double stiffness, stiffening, damping, constant, linear, quadratic, threshold, grade;
    double mass[N];
} Parameters;

static inline double coupler(const double *v, const double *x, const Parameters *p) {
    double d = x[0] - x[1];
    return p->stiffness * d * (1.0 + p->stiffening * d * d) + p->damping * (v[0] - v[1]);
}

static inline double acceleration(double pull, double v, double mass, const Parameters *p) {
    double sign = v / sqrt(v * v + p->threshold * p->threshold);
    double davis = (p->constant + p->linear * fabs(v) + p->quadratic * v * v) * sign;
    return pull / mass - 9.81 * (davis + p->grade);
}

/* The state holds all speeds, then all positions. */
static void one_loop(const double *restrict state, double traction, const Parameters *restrict p,
                     double *restrict slope) {
    const double *v = state, *x = state + N;
    double before = traction;
    int i;
    for (i = 0; i < N - 1; i++) {
        double behind = coupler(v + i, x + i, p);
        slope[i] = acceleration(before - behind, v[i], p->mass[i], p);
        slope[N + i] = v[i];
        before = behind;
    }
    slope[N - 1] = acceleration(before, v[N - 1], p->mass[N - 1], p);
    slope[2 * N - 1] = v[N - 1];
}

static void two_loops(const double *restrict state, double traction, const Parameters *restrict p,
                      double *restrict slope) {
    const double *v = state, *x = state + N;
    double force[N + 1];
    int i;
    force[0] = traction;
    for (i = 0; i < N - 1; i++) force[i + 1] = coupler(v + i, x + i, p);
    force[N] = 0.0;
    for (i = 0; i < N; i++) {
        slope[i] = acceleration(force[i] - force[i + 1], v[i], p->mass[i], p);
        slope[N + i] = v[i];
    }
}

#define RUN(name, slopes) \
    __attribute__((visibility("default"))) void name(double *restrict s, double traction, \
                                                     const Parameters *restrict p, double h, long steps) { \
        static double k1[2 * N], k2[2 * N], k3[2 * N], k4[2 * N], at[2 * N]; \
        long j; \
        int i; \
        for (j = 0; j < steps; j++) { \
            slopes(s, traction, p, k1); \
            for (i = 0; i < 2 * N; i++) at[i] = s[i] + 0.5 * h * k1[i]; \
            slopes(at, traction, p, k2); \
            for (i = 0; i < 2 * N; i++) at[i] = s[i] + 0.5 * h * k2[i]; \
            slopes(at, traction, p, k3); \
            for (i = 0; i < 2 * N; i++) at[i] = s[i] + h * k3[i]; \
            slopes(at, traction, p, k4); \
            for (i = 0; i < 2 * N; i++) s[i] += h / 6.0 * (k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + k4[i]); \
        } \
    }
RUN(run_one_loop, one_loop)
RUN(run_two_loops, two_loops)

/* The FMU stepped from C as a tool does it: one input set, one step, the outputs read. */
typedef int (*SetReal)(void *, const unsigned *, size_t, const double *);
typedef int (*DoStep)(void *, double, double, int);
typedef int (*GetReal)(void *, const unsigned *, size_t, double *);

__attribute__((visibility("default")))
int run_fmu(void *component, SetReal set, DoStep step, GetReal get, unsigned input, double value,
            const unsigned *outputs, size_t size, double *values, double h, long steps) {
    long k;
    int failed = 0;
    for (k = 0; k < steps; k++) {
        failed |= set(component, &input, 1, &value);
        failed |= step(component, (double)k * h, h, 1);
        failed |= get(component, outputs, size, values);
    }
    return failed;
}
