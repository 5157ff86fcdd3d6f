/* The braking model of a predictive stop, exact between events, with its sensitivities.
 *
 *     s' = v,  v' = w e + p - r(v, s),  T2 e' = g u(t - T1) - e,
 *     T4 p' = Ke phi(v) (min(u(t - T3), 0) on + probe(t - T3)) - p, on = 1 once the air brake is on
 *
 * as models/metro_precise.py has it. A step ends wherever something changes: a sample, an edge of
 * the delayed command or of the probe, the changeover, the air brake's onset, the end of the fading, the stop. In
 * between both brakes are exact exponentials and the rest is of second order or better. The ends
 * of the steps are functions of the parameters, and all numbers carry their derivatives, so the
 * sensitivities are those of the numbers computed. */

#include <math.h>
#include <stddef.h>
#include <string.h>

#define INLINE static inline __attribute__((always_inline))

/* Parameters; the last one belongs to the measurement alone. */
enum { T1, T2, G, T3, T4, KE, V_SW, K_BRA, APPROACH, PLATFORM, DAVIS, V0, S0, SCALE, COUNT };
/* Derivatives: by the planned level, then by the parameters of the motion. */
enum { LEVEL, WIDTH = SCALE + 1 };
enum { ELECTRIC, WAITING, BLENDING, AIR, STANDING };
enum { BEFORE, PROBING, AFTER }; /* the probe, as the air brake has it */
enum { MOST_TICKS = 1024 };

typedef struct {
    double period, horizon;     /* s: of the commands; longest prediction */
    double rate;                /* m/s2 by which a planned command may change in a period */
    double a, b, c;             /* running resistance, m/s2 over powers of v in m/s */
    double change, length;      /* m: where the platform's gradient begins; the train's length */
    double reference;           /* m/s2, of the fading */
    double position_sd, speed_sd;
    double first, second;       /* m: where balises set the position right, and calibrate */
    double doubt;               /* m: at a balise, measurements this near are left out */
    double loose_sd;            /* m: of positions before the first balise */
    double probe, probe_length; /* m/s2 (negative) and s: how the air brake is tried out */
} Setting;

typedef struct {
    double v, d[WIDTH];
} Number;

typedef struct {
    Number t, s, v, a, e, p, onset, off;
    int phase, electric, air; /* the commands that act: how many edges have passed */
    int probe;
} State;

typedef struct {
    const Setting *setting;
    Number theta[SCALE], before; /* `before`: motors' demand until the first command arrives */
    double probed;               /* s: when the probe is commanded */
    double u[MOST_TICKS], du[MOST_TICKS]; /* commands, and their derivatives by the level */
} Model;

/* Resistance over v and s: its value and the derivatives by v, s, the factor, the approach. */
typedef struct {
    double r, v, s, davis, approach, platform;
} Resistance;

/* The functions take n, how many derivatives to carry: 0, 1 (by the level) or WIDTH. */

static Resistance resistance(const Model *m, double v, double s) {
    const Setting *c = m->setting;
    const Number *q = m->theta;
    double share = (s - c->change) / c->length, steep = 0.0;
    if (share < 0.0) share = 0.0;
    else if (share > 1.0) share = 1.0;
    else steep = (q[PLATFORM].v - q[APPROACH].v) / c->length;
    double running = c->a + (c->b + c->c * v) * v;
    double graded = (1.0 - share) * q[APPROACH].v + share * q[PLATFORM].v;
    return (Resistance){q[DAVIS].v * running + graded, q[DAVIS].v * (c->b + 2.0 * c->c * v), steep,
                        running, 1.0 - share, share};
}

static const double to_level[WIDTH] = {1.0}; /* derivative of the level */

INLINE double by(const Model *m, Resistance r, int i, double v, double s) {
    const Number *q = m->theta;
    return r.v * v + r.s * s + r.davis * q[DAVIS].d[i] + r.approach * q[APPROACH].d[i] +
           r.platform * q[PLATFORM].d[i];
}

/* Advance by h without any event, from x to y. One lag over h: with E = exp(-h/T) its end is
 * D + (x - D) E for the demand D, and its integral h D - T (end - x). */
INLINE void advance(int n, const Model *restrict m, const State *restrict x, State *restrict y,
                    const Number *restrict h) {
    const Number *q = m->theta;
    const double H = h->v, ref = m->setting->reference;
    const int blending = x->phase == BLENDING, on = x->phase >= BLENDING;
    const int filled = on || x->probe != BEFORE; /* the air brake has acted */
    const double t1 = x->t.v + H, vm = x->v.v + 0.5 * H * x->a.v, sm = x->s.v + 0.5 * H * x->v.v;
    /* the electric brake, and its share in the middle and at the end */
    const int k = x->electric;
    const double u = k ? m->u[k - 1] : 0.0, du = k ? q[G].v * m->du[k - 1] : 0.0;
    const double De = k ? q[G].v * u : m->before.v, Te = q[T2].v, Ee = exp(-H / Te);
    const double gap = x->e.v - De, e = De + gap * Ee, Ie = H * De - Te * (e - x->e.v);
    double w = x->phase < BLENDING ? 1.0 : 0.0, w1 = w;
    if (blending) {
        w = 1.0 - q[K_BRA].v * (x->t.v + 0.5 * H - x->onset.v) / ref;
        w1 = 1.0 - q[K_BRA].v * (t1 - x->onset.v) / ref;
    }
    /* the air brake; shoes grip by phi(V) = (V + 150)/(2 V + 150), V in km/h */
    const double below = 7.2 * vm + 150.0, phi = (3.6 * vm + 150.0) / below;
    const double held = on && x->air && m->u[x->air - 1] < 0.0 ? m->u[x->air - 1] : 0.0;
    const double dz = held < 0.0 ? q[KE].v * phi * m->du[x->air - 1] : 0.0;
    const double z = x->probe == PROBING ? held + m->setting->probe : held;
    const double Dp = q[KE].v * z * phi, slope = q[KE].v * z * (-540.0 / (below * below));
    const double Tp = q[T4].v, Ep = filled ? exp(-H / Tp) : 0.0, rest = x->p.v - Dp;
    const double p = filled ? Dp + rest * Ep : 0.0;
    const double Ip = filled ? H * Dp - Tp * (p - x->p.v) : 0.0;
    /* the motion */
    const Resistance rm = resistance(m, vm, sm);
    const double v = x->v.v + w * Ie + Ip - H * rm.r, s = x->s.v + 0.5 * H * (x->v.v + v);
    const Resistance r1 = resistance(m, v, s);
    const double a = w1 * e + p - r1.r, bend = H * H / 12.0;
    /* No branch within: what is off has coefficients of 0. */
    const double early = k ? 0.0 : 1.0, fall = blending ? q[K_BRA].v / ref : 0.0;
    const double cw = blending ? (w - 1.0) / q[K_BRA].v : 0.0;
    const double cw1 = blending ? (w1 - 1.0) / q[K_BRA].v : 0.0;
    for (int i = 0; i < n; i++) {
        const double dH = h->d[i], dt1 = x->t.d[i] + dH;
        const double dvm = x->v.d[i] + 0.5 * (H * x->a.d[i] + dH * x->a.v);
        const double dsm = x->s.d[i] + 0.5 * (H * x->v.d[i] + dH * x->v.v);
        const double dDe = u * q[G].d[i] + early * m->before.d[i] + du * to_level[i];
        const double dTe = q[T2].d[i], dEe = Ee / Te * (H / Te * dTe - dH);
        const double de = dDe + (x->e.d[i] - dDe) * Ee + gap * dEe;
        const double dIe = dH * De + H * dDe - dTe * (e - x->e.v) - Te * (de - x->e.d[i]);
        const double dm = dt1 - 0.5 * dH - x->onset.d[i], d1 = dt1 - x->onset.d[i];
        const double dw = cw * q[K_BRA].d[i] - fall * dm;
        const double dw1 = cw1 * q[K_BRA].d[i] - fall * d1;
        const double dDp = z * phi * q[KE].d[i] + slope * dvm + dz * to_level[i];
        const double dTp = q[T4].d[i], dEp = Ep / Tp * (H / Tp * dTp - dH);
        const double dp = dDp + (x->p.d[i] - dDp) * Ep + rest * dEp;
        const double dIp = dH * Dp + H * dDp - dTp * (p - x->p.v) - Tp * (dp - x->p.d[i]);
        const double dr = dH * rm.r + H * by(m, rm, i, dvm, dsm);
        const double dv = x->v.d[i] + w * dIe + dw * Ie + dIp - dr;
        const double ds = x->s.d[i] + 0.5 * (dH * (x->v.v + v) + H * (x->v.d[i] + dv));
        const double da = w1 * de + dw1 * e + dp - by(m, r1, i, dv, ds);
        y->t.d[i] = dt1;
        y->e.d[i] = de;
        y->p.d[i] = dp;
        y->v.d[i] = dv;
        y->a.d[i] = da;
        y->s.d[i] = ds + bend * (x->a.d[i] - da) + H / 6.0 * dH * (x->a.v - a);
        y->onset.d[i] = x->onset.d[i];
        y->off.d[i] = x->off.d[i];
    }
    y->t.v = t1;
    y->e.v = e;
    y->p.v = p;
    y->v.v = v;
    y->a.v = a;
    y->s.v = s + bend * (x->a.v - a);
    y->onset.v = x->onset.v;
    y->off.v = x->off.v;
    y->phase = x->phase;
    y->electric = x->electric;
    y->air = x->air;
    y->probe = x->probe;
}

INLINE void copy(int n, Number *to, const Number *from) {
    to->v = from->v;
    for (int i = 0; i < n; i++) to->d[i] = from->d[i];
}

/* The time (s) within which the speed comes down to `speed`; it does so within h. */
static double reached(const Model *m, const State *x, double h, double speed) {
    State y;
    double low = 0.0, high = h;
    Number guess = {.v = 0.0};
    for (int i = 0; i < 60; i++) {
        advance(0, m, x, &y, &guess);
        double miss = y.v.v - speed;
        if (fabs(miss) < 1e-13) break;
        if (miss > 0.0) low = guess.v; else high = guess.v;
        double next = y.a.v < 0.0 ? guess.v - miss / y.a.v : high;
        guess.v = next > low && next < high ? next : 0.5 * (low + high);
    }
    return guess.v;
}

/* Advance to where the speed comes down to `speed`, which it does within h. */
INLINE void advance_to(int n, const Model *m, const State *x, State *y, double h,
                       const Number *speed) {
    Number within = {.v = reached(m, x, h, speed->v)}, miss;
    advance(n, m, x, y, &within);
    for (int i = 0; i < n; i++) miss.d[i] = speed->d[i] - y->v.d[i];
    double rate = -y->v.d[0]; /* of v by the step as it is computed, not quite the acceleration */
    within.d[0] = 1.0;
    advance(n, m, x, y, &within);
    rate += y->v.d[0];
    for (int i = 0; i < n; i++) within.d[i] = miss.d[i] / rate;
    advance(n, m, x, y, &within);
    copy(n, &y->v, speed);
}

enum { NOTHING, ELECTRIC_EDGE, AIR_EDGE, PROBE_EDGE, ONSET, OFF };

/* Take in the next time at which something changes, at most `until`; return what it is. */
INLINE int next_change(int n, const Model *m, const State *x, double until, Number *next) {
    const double period = m->setting->period;
    double edge = x->electric * period, air = x->air * period;
    int what = NOTHING;
    next->v = until;
    for (int i = 0; i < n; i++) next->d[i] = 0.0;
    if (edge + m->theta[T1].v <= next->v) {
        copy(n, next, &m->theta[T1]);
        next->v += edge;
        what = ELECTRIC_EDGE;
    }
    if (x->phase >= BLENDING && air + m->theta[T3].v <= next->v) {
        copy(n, next, &m->theta[T3]);
        next->v += air;
        what = AIR_EDGE;
    }
    double probe = m->probed + (x->probe == PROBING ? m->setting->probe_length : 0.0);
    if (x->probe != AFTER && probe + m->theta[T3].v <= next->v) {
        copy(n, next, &m->theta[T3]);
        next->v += probe;
        what = PROBE_EDGE;
    }
    if (x->phase == WAITING && x->onset.v <= next->v) {
        copy(n, next, &x->onset);
        what = ONSET;
    }
    if (x->phase == BLENDING && x->off.v <= next->v) {
        copy(n, next, &x->off);
        what = OFF;
    }
    return what;
}

INLINE void happen(int n, const Model *m, State *x, int what) {
    if (what == ELECTRIC_EDGE) x->electric++;
    if (what == AIR_EDGE) x->air++;
    if (what == PROBE_EDGE) x->probe++;
    if (what == OFF) x->phase = AIR;
    if (what != ONSET) return;
    const Number *rate = &m->theta[K_BRA];
    double lasts = m->setting->reference / rate->v, sent = x->onset.v - m->theta[T3].v;
    x->phase = BLENDING;
    x->off.v = x->onset.v + lasts;
    for (int i = 0; i < n; i++) x->off.d[i] = x->onset.d[i] - lasts / rate->v * rate->d[i];
    /* commands that have reached the air brake by now */
    x->air = 0;
    while (x->air < MOST_TICKS && x->air * m->setting->period <= sent) x->air++;
}

/* Run to a time (s), or to the stop. */
INLINE void run(int n, const Model *m, State *x, double until) {
    State other, *now = x, *then = &other;
    while (now->phase != STANDING) {
        Number next, h;
        int what = next_change(n, m, now, until, &next);
        h.v = next.v - now->t.v;
        for (int i = 0; i < n; i++) h.d[i] = next.d[i] - now->t.d[i];
        advance(n, m, now, then, &h);
        if (now->phase == ELECTRIC && then->v.v <= m->theta[V_SW].v) {
            advance_to(n, m, now, then, h.v, &m->theta[V_SW]);
            then->phase = WAITING;
            copy(n, &then->onset, &then->t);
            then->onset.v += m->theta[T3].v;
            for (int i = 0; i < n; i++) then->onset.d[i] += m->theta[T3].d[i];
            what = ONSET + OFF; /* no change that was foreseen */
        } else if (then->v.v <= 0.0) {
            const Number zero = {.v = 0.0};
            advance_to(n, m, now, then, h.v, &zero);
            then->phase = STANDING;
        } else {
            copy(n, &then->t, &next);
            happen(n, m, then, what);
        }
        State *swap = now;
        now = then;
        then = swap;
        if (what == NOTHING) break;
    }
    if (now != x) *x = *now;
}

static void run_level(const Model *m, State *x, double until) { run(1, m, x, until); }
static void run_full(const Model *m, State *x, double until) { run(WIDTH, m, x, until); }

/* Fill in the model, and the state at the first sample: in equilibrium on the approach. The probe
 * begins at the time `probed`, infinite for none. */
static void begin(Model *m, State *x, const Setting *setting, const double *theta, double probed,
                  int ticks, const double *commands) {
    memset(x, 0, sizeof *x);
    memset(m, 0, offsetof(Model, u));
    m->setting = setting;
    m->probed = probed;
    for (int i = 0; i < SCALE; i++) {
        m->theta[i].v = theta[i];
        m->theta[i].d[1 + i] = 1.0;
    }
    for (int i = 0; i < ticks; i++) {
        m->u[i] = commands[i];
        m->du[i] = 0.0;
    }
    x->s = m->theta[S0];
    x->v = m->theta[V0];
    Resistance r = resistance(m, x->v.v, x->s.v);
    m->before.v = r.r;
    for (int i = 0; i < WIDTH; i++) m->before.d[i] = by(m, r, i, x->v.d[i], x->s.d[i]);
    x->e = m->before;
}
