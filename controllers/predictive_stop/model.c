/* Plans and estimates with the braking model of motion.h. No memory is kept from call to call. */

#include "motion.h"

#if defined(_WIN32)
#define EXPORT __declspec(dllexport)
#else
#define EXPORT __attribute__((visibility("default")))
#endif

typedef struct {
    double aim, damping, low, high; /* m, m per m/s2, and m/s2 of the command */
    double ending, slow, fast;      /* share of the level up to `slow`, all from `fast`, m/s */
} Plan;

static double share_of_level(const Plan *plan, double v, double *slope) {
    double ramp = (v - plan->slow) / (plan->fast - plan->slow);
    *slope = ramp > 0.0 && ramp < 1.0 ? (1.0 - plan->ending) / (plan->fast - plan->slow) : 0.0;
    ramp = ramp < 0.0 ? 0.0 : ramp > 1.0 ? 1.0 : ramp;
    return plan->ending + (1.0 - plan->ending) * ramp;
}

/* Run from the present to the stop under the plan's commands; keep them in the model. */
static void follow(Model *m, State *x, const Plan *plan, int first, double last, double level) {
    const double period = m->setting->period;
    const int most = first + (int)(m->setting->horizon / period);
    double u = last, du = 0.0;
    for (int i = first; i < most && i < MOST_TICKS && x->phase != STANDING; i++) {
        double steep, part = share_of_level(plan, x->v.v, &steep);
        double rate = 0.5 * (1.0 + part) * m->setting->rate, target = level * part, change;
        if (target < plan->low) target = plan->low;
        else if (target > plan->high) target = plan->high;
        change = target - u;
        if (change > rate) u += rate;
        else if (change < -rate) u -= rate;
        else {
            u = target;
            du = target == level * part ? part + level * steep * x->v.d[LEVEL] : 0.0;
        }
        m->u[i] = u;
        m->du[i] = du;
        run_level(m, x, (i + 1) * period);
    }
}

/* Move a level so that the train comes to stand at the aim, and predict the stop with it.
 *
 * From `last` on the commands to come go to the level, or to its share at low speeds, by at most
 * the rate a period; with the share the rate falls half as much. `iterations` times the level
 * moves by -(S - aim) S'/(S'^2 + damping^2). `found` takes level, stop S (m), its derivative S',
 * the stopping time (s), the speed (m/s) at the present, which is the time of the first command to
 * be planned, and that command. */
EXPORT void stop_plan(const Setting *setting, const double *theta, double probed, int ticks,
                      const double *commands, double last, double level, const Plan *plan,
                      int iterations, double *found) {
    Model m;
    State present;
    double none;
    begin(&m, &present, setting, theta, probed, ticks, commands);
    for (int k = 1; k <= ticks; k++) run_level(&m, &present, k * setting->period);
    const double part = share_of_level(plan, present.v.v, &none);
    for (int pass = 0; pass <= iterations; pass++) {
        if (pass) {
            double slope = found[2];
            double stiff = slope * slope + plan->damping * plan->damping;
            level -= (found[1] - plan->aim) * slope / stiff;
            if (level * part < plan->low) level = plan->low / part;
            if (level * part > plan->high) level = plan->high / part;
        }
        State x = present;
        m.u[ticks] = last;
        follow(&m, &x, plan, ticks, last, level);
        found[0] = level;
        found[1] = x.s.v;
        found[2] = x.s.d[LEVEL];
        found[3] = x.t.v;
    }
    found[4] = present.v.v;
    found[5] = m.u[ticks];
}

/* Take motion and sensitivities at the samples: (s, v), and (s, v) by the parameters. */
EXPORT void stop_motion(const Setting *setting, const double *theta, double probed, int samples,
                        const double *commands, double *motion, double *slopes) {
    Model m;
    State x;
    begin(&m, &x, setting, theta, probed, samples - 1, commands);
    for (int k = 0; k < samples; k++) {
        if (k) run_full(&m, &x, k * setting->period);
        motion[2 * k] = x.s.v;
        motion[2 * k + 1] = x.v.v;
        memcpy(slopes + 2 * k * SCALE, x.s.d + 1, SCALE * sizeof(double));
        memcpy(slopes + (2 * k + 1) * SCALE, x.v.d + 1, SCALE * sizeof(double));
    }
}

/* One measurement: its row of the Jacobian and what is missing, into the normal equations. */
static double measured(const double *row, double miss, double sd, double *matrix, double *side) {
    double weight = 1.0 / (sd * sd);
    for (int i = 0; i < COUNT; i++) {
        if (row[i] == 0.0) continue;
        double part = weight * row[i];
        side[i] += part * miss;
        for (int j = 0; j <= i; j++) matrix[COUNT * i + j] += part * row[j];
    }
    return weight * miss * miss;
}

/* Take in the sample of one time; return what it adds to the cost. */
static double sample(const Setting *c, const State *x, double scale, double position, double speed,
                     double *matrix, double *side) {
    if (fabs(position - c->first) < c->doubt || fabs(position - c->second) < c->doubt) return 0.0;
    double row[COUNT], metre = position < c->second ? 1.0 + scale : 1.0, cost;
    double origin = position < c->first ? x->s.v : c->first; /* where the wheel began to count */
    for (int i = 0; i < SCALE; i++) row[i] = metre * x->s.d[1 + i];
    row[SCALE] = position < c->second ? x->s.v - origin : 0.0;
    double expected = position < c->second ? origin + metre * (x->s.v - origin) : x->s.v;
    double sd = position < c->first ? c->loose_sd : c->position_sd;
    cost = measured(row, position - expected, sd, matrix, side);
    for (int i = 0; i < SCALE; i++) row[i] = metre * x->v.d[1 + i];
    row[SCALE] = position < c->second ? x->v.v : 0.0;
    return cost + measured(row, speed - metre * x->v.v, c->speed_sd, matrix, side);
}

/* Solve the lower triangle's equations by Cholesky; return whether it is positive definite. */
static int solve(const double *matrix, double *x) {
    double l[COUNT * COUNT];
    for (int i = 0; i < COUNT; i++) {
        for (int j = 0; j <= i; j++) {
            double sum = matrix[COUNT * i + j];
            for (int k = 0; k < j; k++) sum -= l[COUNT * i + k] * l[COUNT * j + k];
            if (i != j) l[COUNT * i + j] = sum / l[COUNT * j + j];
            else if (sum > 0.0) l[COUNT * i + i] = sqrt(sum);
            else return 0;
        }
    }
    for (int i = 0; i < COUNT; i++) {
        for (int k = 0; k < i; k++) x[i] -= l[COUNT * i + k] * x[k];
        x[i] /= l[COUNT * i + i];
    }
    for (int i = COUNT - 1; i >= 0; i--) {
        for (int k = i + 1; k < COUNT; k++) x[i] -= l[COUNT * k + i] * x[k];
        x[i] /= l[COUNT * i + i];
    }
    return 1;
}

/* Towards the maximum a posteriori from theta, by some steps of Gauss-Newton.
 *
 * Samples are those of the times 0 to samples - 1 periods, the commands one fewer. The prior has
 * mean, information (inverse covariance) and standard deviations, in this order; no parameter
 * moves by more than `largest` of the latter in a step, nor further than `bound` from the mean. The
 * information at the last theta but one
 * is left in the lower triangle of `matrix`, the squares of data and prior there in `cost`.
 * Returns 0 if the equations could not be solved. */
EXPORT int stop_estimate(const Setting *setting, double *theta, double probed, int samples,
                         const double *commands, const double *positions, const double *speeds,
                         const double *prior, double largest, double bound, int steps,
                         double *matrix, double *cost) {
    const double *mean = prior, *information = prior + COUNT;
    const double *deviations = information + COUNT * COUNT;
    Model m;
    State x;
    for (int pass = 0; pass < steps; pass++) {
        double step[COUNT], part = 1.0;
        begin(&m, &x, setting, theta, probed, samples - 1, commands);
        memcpy(matrix, information, COUNT * COUNT * sizeof(double));
        cost[0] = cost[1] = 0.0;
        for (int i = 0; i < COUNT; i++) {
            step[i] = 0.0;
            for (int j = 0; j < COUNT; j++)
                step[i] += information[COUNT * i + j] * (mean[j] - theta[j]);
            cost[1] += step[i] * (mean[i] - theta[i]);
        }
        for (int k = 0; k < samples; k++) {
            if (k) run_full(&m, &x, k * setting->period);
            cost[0] +=
                sample(setting, &x, theta[SCALE], positions[k], speeds[k], matrix, step);
        }
        if (!solve(matrix, step)) return 0;
        for (int i = 0; i < COUNT; i++) {
            double most = largest * deviations[i] / (fabs(step[i]) + 1e-300);
            if (most < part) part = most;
        }
        for (int i = 0; i < COUNT; i++) {
            double low = mean[i] - bound * deviations[i], high = mean[i] + bound * deviations[i];
            double next = theta[i] + part * step[i];
            theta[i] = next < low ? low : next > high ? high : next;
        }
    }
    return 1;
}
