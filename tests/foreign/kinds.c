/* Co-simulation only: inputs of all types, which outputs follow one step later.
 *   sum' = r;  count counts up by n and flag becomes b with each step
 */
#include "fmi2Functions.h"

enum { SUM, DER_SUM, R, COUNT, N, N_REALS };
enum { B, FLAG, N_BOOLS };
#define N_STATES 1
#define N_INDICATORS 0
#define IS_EXCHANGE 0
static const double start[] = {0.0, 0.0, 0.0, 0.0, 0.0};
static const int start_boolean[] = {0, 0};

/* common.h has no integers: here they are kept as reals. */
#undef fmi2GetInteger
#undef fmi2SetInteger
#define fmi2GetInteger inner_fmi2GetInteger
#define fmi2SetInteger inner_fmi2SetInteger
#include "common.h"
#undef fmi2GetInteger
#undef fmi2SetInteger

fmi2Status fmi2GetInteger(fmi2Component c, const fmi2ValueReference r[], size_t n, fmi2Integer v[]) {
    size_t i;
    for (i = 0; i < n; i++) v[i] = (int)((Model *)c)->real[COUNT + r[i]];
    return fmi2OK;
}
fmi2Status fmi2SetInteger(fmi2Component c, const fmi2ValueReference r[], size_t n, const fmi2Integer v[]) {
    size_t i;
    for (i = 0; i < n; i++) ((Model *)c)->real[COUNT + r[i]] = v[i];
    return fmi2OK;
}

static void compute(Model *m) { m->real[DER_SUM] = m->real[R]; }
static void step(Model *m, double h) {
    m->real[SUM] += h * m->real[R];
    m->real[COUNT] += m->real[N];
    m->boolean[FLAG] = m->boolean[B];
}
static double partial(const Model *m, int unknown, int known) {
    (void)m;
    return unknown == DER_SUM && known == R;
}
static double slope_of(const Model *m, int output) { return output == SUM ? m->real[R] : 0.0; }
static int update(Model *m) { (void)m; return 0; }
static void indicators(const Model *m, double *z) { (void)m, (void)z; }
