/* Log categories: what fmi2SetDebugLogging lets through. Errors are always told. */
#include "fmu.h"

static const Variable *bounded(const char *kinds) {
    int k;
    for (k = 0; k < n_variables; k++)
        if (strchr(kinds, variable[k].kind) && variable[k].maximum < HUGE_VAL) return &variable[k];
    for (k = 0; k < n_variables; k++)
        if (strchr(kinds, variable[k].kind) && variable[k].minimum > -HUGE_VAL) return &variable[k];
    return NULL;
}

static double outside(const Variable *v) {
    return v->maximum < HUGE_VAL ? v->maximum + 1.0 + fabs(v->maximum) : v->minimum - 1.0 - fabs(v->minimum);
}

/* Make one line of every category that there can be, and more than one of events. */
static void provoke(Slave *s) {
    double none = 0.0, start;
    fmi2ValueReference unknown = 0xFFFFFFFFu;
    const Variable *v = bounded("p");
    start = v->start;
    CHECK(fmi2SetReal(s->fmu, &inner_step, 1, &none) == fmi2Warning, "inner_step = 0 is no warning");
    if (v->vr != inner_step) fmi2SetReal(s->fmu, &v->vr, 1, &start);
    CHECK(fmi2GetReal(s->fmu, &unknown, 1, &none) == fmi2Error, "an unknown reference is no error");
    fmi2Reset(s->fmu);
    play(s, 3, 250);
    if (s->type == fmi2CoSimulation) {
        fmi2String text;
        CHECK(fmi2GetStringStatus(s->fmu, fmi2PendingStatus, &text) == fmi2Discard, "a pending step?");
    }
}

/* `n` categories are switched on in an instance that logs everything; `seen` are to be seen. */
static void filtered(fmi2Type type, size_t n, const fmi2String *categories, const char *seen, const Log *all) {
    Slave *s = make(type);
    int c;
    CHECK(fmi2SetDebugLogging(s->fmu, fmi2True, n, categories) == fmi2OK, "%s", s->log.text);
    provoke(s);
    for (c = 0; c < CATEGORIES; c++)
        CHECK(s->log.of[c] == (seen[c] == 'x' ? all->of[c] : 0), "%s lines of %s: %d", n ? categories[0] : "all",
              category_name[c], s->log.of[c]);
    release(s);
}

static void switched_off(fmi2Type type, const Log *all) {
    fmi2String events[1] = {"logEvents"};
    Slave *s = make(type);
    CHECK(fmi2SetDebugLogging(s->fmu, fmi2False, 0, NULL) == fmi2OK, "switching off");
    provoke(s);
    CHECK(s->log.lines == s->log.of[ERROR] && s->log.lines == all->of[ERROR], "off: %d lines", s->log.lines);
    release(s);
    s = make(type);
    CHECK(fmi2SetDebugLogging(s->fmu, fmi2False, 1, events) == fmi2OK, "switching events off");
    provoke(s);
    CHECK(s->log.of[EVENTS] == 0, "events, switched off: %d lines", s->log.of[EVENTS]);
    CHECK(s->log.of[WARNING] == all->of[WARNING], "warnings: %d lines", s->log.of[WARNING]);
    release(s);
}

/* An input or tunable parameter out of bounds is warned of, and taken. */
static void bounds(fmi2Type type) {
    static const char *const kinds[2] = {"i", "t"};
    static const State some[2][3] = {{INSTANTIATED, INITIALIZATION, EVENT_MODE},
                                     {INSTANTIATED, INITIALIZATION, STEP_COMPLETE}};
    int k, j;
    for (k = 0; k < 2; k++) {
        const Variable *v = bounded(kinds[k]);
        for (j = 0; v && j < 3; j++) {
            Slave *s = make_in(type, some[type == fmi2CoSimulation][j]);
            double value = outside(v), got = 0.0;
            CHECK(fmi2SetReal(s->fmu, &v->vr, 1, &value) == fmi2Warning, "%s out of bounds", v->name);
            CHECK(s->log.category == WARNING && s->log.status == fmi2Warning && strstr(s->log.text, v->name) &&
                      strstr(s->log.text, "outside"), "%s out of bounds: %s", v->name, s->log.text);
            if (j) CHECK(fmi2GetReal(s->fmu, &v->vr, 1, &got) == fmi2OK && got == value, "%s is not taken", v->name);
            release(s);
        }
    }
}

/* A parameter out of bounds is refused when initialization ends, not before. */
static void parameters(fmi2Type type) {
    int k;
    for (k = 0; k < n_variables; k++) {
        const Variable *v = &variable[k];
        double value = outside(v);
        Slave *s;
        if (!strchr("pt", v->kind) || (v->minimum == -HUGE_VAL && v->maximum == HUGE_VAL)) continue;
        s = make(type);
        CHECK(fmi2SetReal(s->fmu, &v->vr, 1, &value) == fmi2Warning, "%s out of bounds", v->name);
        fmi2SetupExperiment(s->fmu, fmi2False, 0.0, start_time, fmi2False, 0.0);
        CHECK(fmi2EnterInitializationMode(s->fmu) == fmi2OK, "%s", s->log.text);
        CHECK(fmi2ExitInitializationMode(s->fmu) == fmi2Error, "%s out of bounds is taken", v->name);
        CHECK(strstr(s->log.text, v->name) && strstr(s->log.text, "t = ") && s->log.category == ERROR,
              "%s out of bounds: %s", v->name, s->log.text);
        check_reset(s, "a parameter out of bounds");
        release(s);
    }
}

void logs(void) {
    static const fmi2String one[CATEGORIES][1] = {
        {"logEvents"}, {"logStatusWarning"}, {"logStatusDiscard"}, {"logStatusError"}, {"logStatusFatal"}, {"logAll"},
    };
    static const fmi2String two[2] = {"logStatusWarning", "logStatusDiscard"};
    static const char *const seen[CATEGORIES] = {"x--x--", "-x-x--", "--xx--", "---x--", "---x--", "xxxxxx"};
    int type, c;
    for (type = fmi2ModelExchange; type <= fmi2CoSimulation; type++) {
        Slave *s = make((fmi2Type)type);
        provoke(s);
        CHECK(s->log.of[WARNING] && s->log.of[ERROR], "no warning, or no error");
        printf("%s: %d events logged\n", type_name((fmi2Type)type), s->log.of[EVENTS]);
        for (c = 0; c < CATEGORIES; c++) filtered((fmi2Type)type, 1, one[c], seen[c], &s->log);
        filtered((fmi2Type)type, 2, two, "-xxx--", &s->log);
        filtered((fmi2Type)type, 0, NULL, "xxxxxx", &s->log);
        switched_off((fmi2Type)type, &s->log);
        bounds((fmi2Type)type);
        parameters((fmi2Type)type);
        release(s);
    }
}
