/* The heavy-haul train by hand: what heavy_haul.py compares the FMU with. N, the number of
 * vehicles, is defined before this file is included. MT-2 gears at all joints, locomotives HXD1
 * (the first LOCOMOTIVES vehicles, one group), one gradient, semi-implicit Euler. Parameters and
 * states are arrays, one for each quantity; what does not change in a run is worked out before it,
 * and what a step has found at its end the next one uses. Coupler i is behind vehicle i.
 */
#include <math.h>
#include <string.h>

enum { J = N - 1 }; /* joints */
#define PER_MILLE 9.81e-3 /* m/s² */

static inline double least(double a, double b) { return a < b ? a : b; }
static inline double most(double a, double b) { return a > b ? a : b; }
static inline double within(double a, double limit) { return most(-limit, least(a, limit)); }

/* As they are given, in this order. */
typedef struct {
    double mass[N], constant[N], linear[N], quadratic[N], starting[N], length[N], behind[N];
    double brake_area[N], shoes[N], full_pressure[N];
    double slack[J], stiffness[J], ratio[J], damping[J];
    double location, gradient, application_speed, release_speed, application_time, release_time;
} Parameters;

/* What the steps need of them. */
typedef struct {
    double per_mass[N], weight[N], on[N], off[N], half_slack[J], per_on, per_off;
} Prepared;

typedef struct {
    double v[N], x[N], pipe[N], cylinder[N];
    double gear[J], stretch[J], force[J], highest[J], lowest[J], work[J];
    double traction, electric, resisted, shod, damped; /* energies */
    double damping_power, start;
} State;

/* At communication points; what else is an output is in the state. */
typedef struct {
    double position[N], speed, applied, upper, lower, standing, maximum, maximum_at, minimum,
        minimum_at, gears, stored, kinetic, potential, residual;
} Outputs;

static void prepare(const Parameters *p, Prepared *q) {
    int i;
    for (i = 0; i < N; i++) {
        q->per_mass[i] = 1.0 / p->mass[i];
        q->weight[i] = PER_MILLE * p->mass[i];
        q->on[i] = p->application_speed / p->length[i];
        q->off[i] = p->release_speed / p->length[i];
    }
    for (i = 0; i < J; i++) q->half_slack[i] = 0.5 * p->slack[i];
    q->per_on = 1.0 / p->application_time;
    q->per_off = 1.0 / p->release_time;
}

/* Two MT-2 in series. */
static const double STROKE = 0.166, BEGIN = 0.004, STOP = 100e6;

static inline double loading(double stroke) {
    double share = stroke * (1.0 / 0.166);
    return least(stroke * (100e3 / 0.004), 100e3) + 2170e3 * share * share * sqrt(share);
}

static inline double loading_work(double stroke) {
    double begun = least(stroke, BEGIN), share = stroke / STROKE;
    return 100e3 * (0.5 * begun * begun / BEGIN + (stroke - begun)) +
           2170e3 / 3.5 * stroke * share * share * sqrt(share);
}

static const double service_at[] = {0.0, 50.0, 60.0, 80.0, 110.0, 120.0, 160.0, 170.0};
static const double service_slope[] = {0.0034, 0.011, 0.009, 0.007, 0.006, 0.005, 0.003, 0.0};

static inline double service(double reduction) {
    double share = 0.0;
    int k;
    for (k = 0; k < 7 && reduction > service_at[k]; k++)
        share += service_slope[k] * (least(reduction, service_at[k + 1]) - service_at[k]);
    return share;
}

/* HXD1 with an axle load of 25 t. */
static inline double traction_limit(double v) {
    double force = v <= 5.0 / 3.6 ? 760e3 : 779e3 - 13.68e3 * least(v, 70.0 / 3.6);
    return v * force > 9600e3 ? 9600e3 / v : force;
}

static inline double electric_limit(double v) {
    double force = within(207450.0 * most(v - 2.0 / 3.6, 0.0), 461e3);
    return v * force > 9600e3 ? 9600e3 / v : force;
}

static inline double locomotive(double demand, double v, double *upper, double *lower) {
    *upper = traction_limit(fabs(v));
    *lower = -electric_limit(most(v, 0.0));
    return least(most(demand, *lower), *upper);
}

static inline double resistance(const Parameters *p, const Prepared *q, int i, double way) {
    double kmh = 3.6 * way;
    double formula = p->constant[i] + kmh * (p->linear[i] + kmh * p->quadratic[i]);
    if (kmh < 5.0) formula = p->starting[i] + most((kmh - 2.5) * 0.4, 0.0) * (formula - p->starting[i]);
    return formula * q->weight[i];
}

static inline double shoes(const Parameters *p, int i, double cylinder, double way) {
    double k = p->brake_area[i] * cylinder, kmh = 3.6 * way;
    return 410.0 * p->shoes[i] * k * (k + 200.0) * (kmh + 150.0) /
           ((4.0 * k + 200.0) * (2.0 * kmh + 150.0));
}

static void step_vehicles(const Parameters *restrict p, const Prepared *restrict q, State *restrict s,
                          double demand, double reduction, double h) {
    double traction = 0.0, electric = 0.0, resisted = 0.0, shod = 0.0, ahead = 0.0, before = reduction;
    int i;
    for (i = 0; i < N; i++) {
        double v = s->v[i], way = fabs(v), pipe = s->pipe[i], cylinder = s->cylinder[i];
        double behind = i < J ? s->force[i] : 0.0, pull = ahead - behind, target, u, l, new, hold;
        double w = resistance(p, q, i, way), fb = shoes(p, i, cylinder, way);
        if (i < LOCOMOTIVES) {
            double force = locomotive(demand, v, &u, &l);
            pull += force;
            if (force > 0.0) traction += force * v;
            else electric -= force * v;
        }
        resisted += w * way;
        shod += fb * way;
        target = p->full_pressure[i] * service(pipe);
        s->cylinder[i] = cylinder + h * (target - cylinder) * (target > cylinder ? q->per_on : q->per_off);
        s->pipe[i] = pipe + h * (before - pipe) * (before > pipe ? q->on[i] : q->off[i]);
        new = v + h * (pull * q->per_mass[i] - PER_MILLE * p->gradient);
        hold = h * (w + fb) * q->per_mass[i];
        new -= within(new, hold);
        s->v[i] = new;
        s->x[i] += h * new;
        ahead = behind;
        before = pipe;
    }
    s->traction += h * traction;
    s->electric += h * electric;
    s->resisted += h * resisted;
    s->shod += h * shod;
    s->damped += h * s->damping_power;
}

static void step_couplers(const Parameters *restrict p, const Prepared *restrict q, State *restrict s) {
    double power = 0.0;
    int i;
    for (i = 0; i < J; i++) {
        double d = s->x[i] - s->x[i + 1], relative = s->v[i] - s->v[i + 1], way = d - s->stretch[i];
        double used = fabs(d) - q->half_slack[i], last = s->gear[i], force = last + p->stiffness[i] * way;
        double up, low, high, total, damping = p->damping[i] * relative;
        if (used > 0.0) {
            up = loading(least(used, STROKE));
            low = d > 0.0 ? p->ratio[i] * up : -up;
            high = d > 0.0 ? up : -p->ratio[i] * up;
            force = least(most(force, low), high);
        } else {
            force = 0.0;
        }
        total = force + damping;
        if (used > STROKE) total += (d > 0.0 ? STOP : -STOP) * (used - STROKE);
        power += damping * relative;
        s->work[i] += 0.5 * (last + force) * way;
        s->gear[i] = force;
        s->stretch[i] = d;
        s->force[i] = total;
        s->highest[i] = most(s->highest[i], total);
        s->lowest[i] = least(s->lowest[i], total);
    }
    s->damping_power = power;
}

/* What a gear gives back: down the slope to the unloading curve, then along it. */
static inline double recoverable(const Parameters *p, const Prepared *q, int i, double d, double force) {
    double slack = q->half_slack[i], k = p->stiffness[i], ratio = p->ratio[i], at = d, low, stroke;
    int n;
    stroke = least(most(d - slack, 0.0), STROKE);
    low = d > 0.0 ? ratio * loading(stroke) : 0.0;
    for (n = 0; n < 3; n++) {
        double used;
        at = d - (force - low) / k;
        used = least(most(fabs(at) - slack, 0.0), STROKE);
        low = at > 0.0 ? ratio * loading(used) : -loading(used);
    }
    stroke = least(most(at - slack, 0.0), STROKE);
    return (force - 0.5 * k * (d - at)) * (d - at) + ratio * loading_work(stroke);
}

static void mechanical(const Parameters *p, const State *s, double *position, double *kinetic, double *potential) {
    double moving = 0.0, high = 0.0;
    int i;
    for (i = 0; i < N; i++) {
        position[i] = p->location + s->x[i] - p->behind[i];
        moving += 0.5 * p->mass[i] * s->v[i] * s->v[i];
        high += p->mass[i] * (position[i] - 0.5 * p->length[i]);
    }
    *kinetic = moving;
    *potential = PER_MILLE * p->gradient * high;
}

static void outputs(const Parameters *restrict p, const Prepared *restrict q, const State *restrict s, double demand,
                    Outputs *restrict y) {
    double taken = 0.0, stored = 0.0, stops = 0.0, upper, lower;
    int i;
    mechanical(p, s, y->position, &y->kinetic, &y->potential);
    y->speed = s->v[0];
    y->applied = y->upper = y->lower = y->standing = 0.0;
    for (i = 0; i < LOCOMOTIVES; i++) {
        y->applied += locomotive(demand, s->v[i], &upper, &lower);
        y->upper += upper;
        y->lower += lower;
    }
    for (i = 0; i < N; i++) y->standing += s->v[i] == 0.0;
    y->maximum = y->minimum = s->force[0];
    y->maximum_at = y->minimum_at = 1.0;
    for (i = 0; i < J; i++) {
        double way = fabs(s->stretch[i]), stop = way - q->half_slack[i] - STROKE;
        if (s->force[i] > y->maximum) y->maximum = s->force[i], y->maximum_at = i + 1;
        if (s->force[i] < y->minimum) y->minimum = s->force[i], y->minimum_at = i + 1;
        taken += s->work[i];
        stored += recoverable(p, q, i, way, fabs(s->gear[i]));
        if (stop > 0.0) stops += 0.5 * STOP * stop * stop;
    }
    y->gears = taken - stored;
    y->stored = stored + stops;
    y->residual = y->kinetic + y->potential - s->start - s->traction + s->electric + s->resisted + s->shod +
                  s->damped + taken + stops;
}

/* Run from rest in the couplers, all vehicles at one speed. In each communication step the demands
 * (N per group, kPa) hold, `inner` steps of h (s) are made, and a row of the outputs is kept. */
__attribute__((visibility("default")))
void run_by_hand(const Parameters *p, double speed, const double *demand, const double *reduction,
                 double h, long inner, long steps, double *rows, long width) {
    static Prepared q;
    static State s;
    static Outputs y;
    long k, j;
    int i;
    prepare(p, &q);
    memset(&s, 0, sizeof s);
    for (i = 0; i < N; i++) s.v[i] = speed;
    mechanical(p, &s, y.position, &y.kinetic, &y.potential);
    s.start = y.kinetic + y.potential;
    for (k = 0; k < steps; k++) {
        double *row = rows + k * width;
        for (j = 0; j < inner; j++) {
            step_vehicles(p, &q, &s, demand[k] / LOCOMOTIVES, reduction[k], h);
            step_couplers(p, &q, &s);
        }
        outputs(p, &q, &s, demand[k] / LOCOMOTIVES, &y);
        memcpy(row, &y, sizeof y);
        memcpy(row + sizeof y / sizeof *row, &s, sizeof s);
    }
}

/* The FMU stepped from C as a tool does it: inputs set, one step, all outputs read into a row. */
typedef int (*SetReal)(void *, const unsigned *, size_t, const double *);
typedef int (*DoStep)(void *, double, double, int);
typedef int (*GetReal)(void *, const unsigned *, size_t, double *);

__attribute__((visibility("default")))
int run_fmu(void *component, SetReal set, DoStep step, GetReal get, const unsigned *inputs,
            const double *demand, const double *reduction, double h, long steps,
            const unsigned *read, size_t width, double *rows) {
    long k;
    int failed = 0;
    for (k = 0; k < steps; k++) {
        double u[2];
        u[0] = demand[k];
        u[1] = reduction[k];
        failed |= set(component, inputs, 2, u);
        failed |= step(component, (double)k * h, h, 1);
        failed |= get(component, read, width, rows + k * width);
    }
    return failed;
}
