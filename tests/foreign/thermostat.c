/* Model exchange only: a room that a heater keeps between 18 and 22 degC.
 *   T' = (outside − T) / tau + heat · on;   on switches where T leaves the band
 */
enum { T, DER_T, OUTSIDE, TAU, HEAT, FLOW, N_REALS };
enum { ON, N_BOOLS };
#define N_STATES 1
#define N_INDICATORS 1
#define IS_EXCHANGE 1
static const double start[] = {20.0, 0.0, 5.0, 100.0, 0.3, 0.0};
static const int start_boolean[] = {1};
#include "common.h"

static void compute(Model *m) {
    double *r = m->real;
    r[FLOW] = (r[OUTSIDE] - r[T]) / r[TAU];
    r[DER_T] = r[FLOW] + (m->boolean[ON] ? r[HEAT] : 0.0);
}
static void indicators(const Model *m, double *z) {
    z[0] = m->boolean[ON] ? 22.0 - m->real[T] : m->real[T] - 18.0;
}
static int update(Model *m) {
    double z;
    indicators(m, &z);
    if (z > 1e-9) return 0;
    m->boolean[ON] = !m->boolean[ON];
    return 1;
}
static double partial(const Model *m, int unknown, int known) {
    const double *r = m->real;
    double factor = 1.0;
#ifdef LIE_DERIVATIVE
    factor = 1.001;
#endif
    if (unknown != DER_T && unknown != FLOW) return unknown == known;
    switch (known) {
        case T: return -factor / r[TAU];
        case OUTSIDE: return 1.0 / r[TAU];
        case TAU: return -(r[OUTSIDE] - r[T]) / (r[TAU] * r[TAU]);
        case HEAT: return unknown == DER_T && m->boolean[ON];
        default: return 0.0;
    }
}
static void step(Model *m, double h) { (void)m, (void)h; }
static double slope_of(const Model *m, int output) { (void)m, (void)output; return 0.0; }
