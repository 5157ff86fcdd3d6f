/* Co-simulation only: two lags in a row.
 *   a' = (u − a) / tau,  b' = (a − b) / tau;  flow = (a − b) / tau
 * One Heun step for each communication step, so its results depend on that step.
 */
enum { A, B, DER_A, DER_B, U, TAU, FLOW, N_REALS };
enum { N_BOOLS = 0 };
#define N_STATES 2
#define N_INDICATORS 0
#define IS_EXCHANGE 0
static const double start[] = {0.0, 0.5, 0.0, 0.0, 1.0, 2.0, 0.0};
static const int start_boolean[] = {0};
#include "common.h"

#ifdef LIE_SHARED
static double shared;
#endif

static void compute(Model *m) {
    double *r = m->real;
    r[DER_A] = (r[U] - r[A]) / r[TAU];
    r[DER_B] = (r[A] - r[B]) / r[TAU];
    r[FLOW] = r[DER_B];
#ifdef LIE_DEPENDENCY
    r[FLOW] += 0.1 * r[U];
#endif
}
static void step(Model *m, double h) {
    double *r = m->real, a = r[A], b = r[B], u = r[U], da, db;
#ifdef LIE_STEP
    h = 0.1;
#endif
    compute(m);
    da = r[DER_A], db = r[DER_B];
    r[A] = a + h * da, r[B] = b + h * db;
#ifndef LIE_INTERPOLATION
    r[U] = u + h * m->rate[U];
#endif
    compute(m);
    r[A] = a + 0.5 * h * (da + r[DER_A]), r[B] = b + 0.5 * h * (db + r[DER_B]);
#ifdef LIE_SHARED
    r[A] += 1e-3 * shared;
    shared = r[B];
#endif
}
static double partial(const Model *m, int unknown, int known) {
    double tau = m->real[TAU];
#ifdef LIE_DERIVATIVE
    if (unknown == FLOW && known == B) return 1.0 / tau;
#endif
    if (unknown != FLOW) return unknown == known;
    switch (known) {
        case A: return 1.0 / tau;
        case B: return -1.0 / tau;
        case TAU: return -(m->real[A] - m->real[B]) / (tau * tau);
        default: return 0.0;
    }
}
static double slope_of(const Model *m, int output) {
    const double *r = m->real;
#ifdef LIE_SLOPE
    return 0.0;
#endif
    if (output == B) return (r[A] - r[B]) / r[TAU];
    return ((r[U] - r[A]) - (r[A] - r[B])) / (r[TAU] * r[TAU]);
}
static int update(Model *m) { (void)m; return 0; }
static void indicators(const Model *m, double *z) { (void)m, (void)z; }
