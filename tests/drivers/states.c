/* Every function in every state, against the tables of FMI 2.0.4, sections 3.2.3 and 4.2.4.
 *
 * A column for each state; x: the call is allowed, -: it is not. The tables' other columns cannot be
 * reached: nothing here is asynchronous, discards a step, or is fatal.
 *
 * The standard leaves an instance after a forbidden call in the error state. Here such a call
 * changes nothing, which is stricter to promise and easier to use; so that is what is checked.
 */
#include "fmu.h"

typedef fmi2Status (*Call)(Slave *s);

static const fmi2ValueReference *const no_vr = NULL;

static fmi2Status call_get_types_platform(Slave *s) {
    (void)s;
    return strcmp(fmi2GetTypesPlatform(), "default") ? fmi2Error : fmi2OK;
}
static fmi2Status call_get_version(Slave *s) {
    (void)s;
    return strcmp(fmi2GetVersion(), "2.0") ? fmi2Error : fmi2OK;
}
static fmi2Status call_set_debug_logging(Slave *s) {
    return fmi2SetDebugLogging(s->fmu, fmi2True, 0, NULL);
}
static fmi2Status call_instantiate(Slave *s) { /* another one; this one must not notice */
    release(make(s->type));
    return fmi2OK;
}
static fmi2Status call_setup_experiment(Slave *s) {
    return fmi2SetupExperiment(s->fmu, fmi2False, 0.0, start_time, fmi2False, 0.0);
}
static fmi2Status call_enter_initialization_mode(Slave *s) { return fmi2EnterInitializationMode(s->fmu); }
static fmi2Status call_exit_initialization_mode(Slave *s) { return fmi2ExitInitializationMode(s->fmu); }
static fmi2Status call_terminate(Slave *s) { return fmi2Terminate(s->fmu); }
static fmi2Status call_reset(Slave *s) { return fmi2Reset(s->fmu); }
static fmi2Status call_get_real(Slave *s) { return fmi2GetReal(s->fmu, no_vr, 0, NULL); }
static fmi2Status call_get_integer(Slave *s) { return fmi2GetInteger(s->fmu, no_vr, 0, NULL); }
static fmi2Status call_get_boolean(Slave *s) { return fmi2GetBoolean(s->fmu, no_vr, 0, NULL); }
static fmi2Status call_get_string(Slave *s) { return fmi2GetString(s->fmu, no_vr, 0, NULL); }
static fmi2Status call_set_real(Slave *s) { return fmi2SetReal(s->fmu, no_vr, 0, NULL); }
static fmi2Status call_set_integer(Slave *s) { return fmi2SetInteger(s->fmu, no_vr, 0, NULL); }
static fmi2Status call_set_boolean(Slave *s) { return fmi2SetBoolean(s->fmu, no_vr, 0, NULL); }
static fmi2Status call_set_string(Slave *s) { return fmi2SetString(s->fmu, no_vr, 0, NULL); }

static fmi2Status call_get_fmu_state(Slave *s) {
    fmi2FMUstate state = NULL;
    fmi2Status status = fmi2GetFMUstate(s->fmu, &state);
    free(state); /* without the FMU's help, which is another row */
    return status;
}
static fmi2Status call_set_fmu_state(Slave *s) { /* another instance's, made in the same state */
    Slave *other = make_in(s->type, INSTANTIATED);
    fmi2FMUstate state = NULL;
    fmi2Status status;
    fmi2GetFMUstate(other->fmu, &state);
    status = fmi2SetFMUstate(s->fmu, state);
    fmi2FreeFMUstate(other->fmu, &state);
    release(other);
    return status;
}
static fmi2Status call_free_fmu_state(Slave *s) {
    fmi2FMUstate state = NULL;
    return fmi2FreeFMUstate(s->fmu, &state);
}
static fmi2Status with_state(Slave *s, int what) {
    Slave *other = make(s->type);
    fmi2FMUstate state = NULL, again = NULL;
    fmi2Byte *bytes;
    size_t size = 0, asked = 0;
    fmi2Status status;
    fmi2GetFMUstate(other->fmu, &state);
    fmi2SerializedFMUstateSize(other->fmu, state, &size);
    bytes = (fmi2Byte *)malloc(size);
    if (!bytes) abort();
    fmi2SerializeFMUstate(other->fmu, state, bytes, size);
    if (what == 0) status = fmi2SerializedFMUstateSize(s->fmu, state, &asked);
    else if (what == 1) status = fmi2SerializeFMUstate(s->fmu, state, bytes, size);
    else status = fmi2DeSerializeFMUstate(s->fmu, bytes, size, &again);
    free(bytes);
    fmi2FreeFMUstate(other->fmu, &state);
    fmi2FreeFMUstate(other->fmu, &again);
    release(other);
    return status;
}
static fmi2Status call_serialized_fmu_state_size(Slave *s) { return with_state(s, 0); }
static fmi2Status call_serialize_fmu_state(Slave *s) { return with_state(s, 1); }
static fmi2Status call_deserialize_fmu_state(Slave *s) { return with_state(s, 2); }
static fmi2Status call_get_directional_derivative(Slave *s) {
    return fmi2GetDirectionalDerivative(s->fmu, no_vr, 0, no_vr, 0, NULL, NULL);
}

static fmi2Status call_enter_event_mode(Slave *s) { return fmi2EnterEventMode(s->fmu); }
static fmi2Status call_new_discrete_states(Slave *s) {
    fmi2EventInfo info;
    return fmi2NewDiscreteStates(s->fmu, &info);
}
static fmi2Status call_enter_continuous_time_mode(Slave *s) { return fmi2EnterContinuousTimeMode(s->fmu); }
static fmi2Status call_completed_integrator_step(Slave *s) {
    fmi2Boolean enter, terminate;
    return fmi2CompletedIntegratorStep(s->fmu, fmi2True, &enter, &terminate);
}
static fmi2Status call_set_time(Slave *s) { return fmi2SetTime(s->fmu, s->time); }
static fmi2Status call_set_continuous_states(Slave *s) {
    double x[MOST];
    int k, n = 0;
    for (k = 0; k < n_variables; k++)
        if (variable[k].kind == 's') x[n++] = variable[k].start;
    return fmi2SetContinuousStates(s->fmu, x, (size_t)n);
}
static fmi2Status call_get_event_indicators(Slave *s) {
    double z[MOST];
    return fmi2GetEventIndicators(s->fmu, z, (size_t)n_indicators);
}
static fmi2Status call_get_continuous_states(Slave *s) {
    double x[MOST];
    return fmi2GetContinuousStates(s->fmu, x, (size_t)n_states);
}
static fmi2Status call_get_derivatives(Slave *s) {
    double dx[MOST];
    return fmi2GetDerivatives(s->fmu, dx, (size_t)n_states);
}
static fmi2Status call_get_nominals(Slave *s) {
    double x[MOST];
    return fmi2GetNominalsOfContinuousStates(s->fmu, x, (size_t)n_states);
}

static fmi2Status call_set_real_input_derivatives(Slave *s) {
    return fmi2SetRealInputDerivatives(s->fmu, no_vr, 0, NULL, NULL);
}
static fmi2Status call_get_real_output_derivatives(Slave *s) {
    return fmi2GetRealOutputDerivatives(s->fmu, no_vr, 0, NULL, NULL);
}
static fmi2Status call_do_step(Slave *s) { return fmi2DoStep(s->fmu, s->time, step_size, fmi2True); }
static fmi2Status call_cancel_step(Slave *s) { return fmi2CancelStep(s->fmu); }
static fmi2Status call_get_status(Slave *s) {
    fmi2Status value;
    return fmi2GetStatus(s->fmu, fmi2DoStepStatus, &value);
}
static fmi2Status call_get_real_status(Slave *s) {
    fmi2Real value;
    return fmi2GetRealStatus(s->fmu, fmi2LastSuccessfulTime, &value);
}
static fmi2Status call_get_integer_status(Slave *s) {
    fmi2Integer value;
    return fmi2GetIntegerStatus(s->fmu, fmi2DoStepStatus, &value);
}
static fmi2Status call_get_boolean_status(Slave *s) {
    fmi2Boolean value;
    return fmi2GetBooleanStatus(s->fmu, fmi2Terminated, &value);
}
static fmi2Status call_get_string_status(Slave *s) {
    fmi2String value;
    return fmi2GetStringStatus(s->fmu, fmi2PendingStatus, &value);
}

static const struct {
    const char *function;
    Call call;
    const char *exchange;      /* instantiated, initialization, event, continuous, terminated, error */
    const char *co_simulation; /* instantiated, initialization, step complete, terminated, error */
} table[] = {
    {"fmi2GetTypesPlatform", call_get_types_platform, "xxxxxx", "xxxxx"},
    {"fmi2GetVersion", call_get_version, "xxxxxx", "xxxxx"},
    {"fmi2SetDebugLogging", call_set_debug_logging, "xxxxxx", "xxxxx"},
    {"fmi2Instantiate", call_instantiate, "xxxxxx", "xxxxx"},
    {"fmi2SetupExperiment", call_setup_experiment, "x-----", "x----"},
    {"fmi2EnterInitializationMode", call_enter_initialization_mode, "x-----", "x----"},
    {"fmi2ExitInitializationMode", call_exit_initialization_mode, "-x----", "-x---"},
    {"fmi2Terminate", call_terminate, "--xx--", "--x--"},
    {"fmi2Reset", call_reset, "xxxxxx", "xxxxx"},
    {"fmi2GetReal", call_get_real, "-xxxxx", "-xxxx"},
    {"fmi2GetInteger", call_get_integer, "-xxxxx", "-xxxx"},
    {"fmi2GetBoolean", call_get_boolean, "-xxxxx", "-xxxx"},
    {"fmi2GetString", call_get_string, "-xxxxx", "-xxxx"},
    {"fmi2SetReal", call_set_real, "xxxx--", "xxx--"},
    {"fmi2SetInteger", call_set_integer, "xxx---", "xxx--"},
    {"fmi2SetBoolean", call_set_boolean, "xxx---", "xxx--"},
    {"fmi2SetString", call_set_string, "xxx---", "xxx--"},
    {"fmi2GetFMUstate", call_get_fmu_state, "xxxxxx", "xxxxx"},
    {"fmi2SetFMUstate", call_set_fmu_state, "xxxxxx", "xxxxx"},
    {"fmi2FreeFMUstate", call_free_fmu_state, "xxxxxx", "xxxxx"},
    {"fmi2SerializedFMUstateSize", call_serialized_fmu_state_size, "xxxxxx", "xxxxx"},
    {"fmi2SerializeFMUstate", call_serialize_fmu_state, "xxxxxx", "xxxxx"},
    {"fmi2DeSerializeFMUstate", call_deserialize_fmu_state, "xxxxxx", "xxxxx"},
    {"fmi2GetDirectionalDerivative", call_get_directional_derivative, "-xxxxx", "-xxxx"},
    {"fmi2EnterEventMode", call_enter_event_mode, "--xx--", "-----"},
    {"fmi2NewDiscreteStates", call_new_discrete_states, "--x---", "-----"},
    {"fmi2EnterContinuousTimeMode", call_enter_continuous_time_mode, "--x---", "-----"},
    {"fmi2CompletedIntegratorStep", call_completed_integrator_step, "---x--", "-----"},
    {"fmi2SetTime", call_set_time, "--xx--", "-----"},
    {"fmi2SetContinuousStates", call_set_continuous_states, "---x--", "-----"},
    {"fmi2GetEventIndicators", call_get_event_indicators, "-xxxxx", "-----"},
    {"fmi2GetContinuousStates", call_get_continuous_states, "-xxxxx", "-----"},
    {"fmi2GetDerivatives", call_get_derivatives, "-xxxxx", "-----"},
    {"fmi2GetNominalsOfContinuousStates", call_get_nominals, "x-xxxx", "-----"},
    {"fmi2SetRealInputDerivatives", call_set_real_input_derivatives, "------", "xxx--"},
    {"fmi2GetRealOutputDerivatives", call_get_real_output_derivatives, "------", "--xxx"},
    {"fmi2DoStep", call_do_step, "------", "--x--"},
    {"fmi2CancelStep", call_cancel_step, "------", "-----"},
    {"fmi2GetStatus", call_get_status, "------", "--xx-"},
    {"fmi2GetRealStatus", call_get_real_status, "------", "--xx-"},
    {"fmi2GetIntegerStatus", call_get_integer_status, "------", "--xx-"},
    {"fmi2GetBooleanStatus", call_get_boolean_status, "------", "--xx-"},
    {"fmi2GetStringStatus", call_get_string_status, "------", "--xx-"},
};

/* The tables' footnotes: which variables a call may name. Getters are laxer than the footnote for
 * initialization mode, which leaves out what the caller has set itself. */
static const struct {
    char kind;
    const char *set_exchange, *set_co_simulation, *get_exchange, *get_co_simulation;
} footnotes[] = {
    {'i', "xxxx--", "xxx--", "-xxxxx", "-xxxx"},
    {'p', "xx----", "xx---", "-xxxxx", "-xxxx"},
    {'t', "xxx---", "xxx--", "-xxxxx", "-xxxx"},
    {'c', "------", "-----", "-xxxxx", "-xxxx"},
    {'s', "xx----", "xx---", "-xxxxx", "-xxxx"},
    {'d', "------", "-----", "-xxxxx", "-xxxx"},
    {'e', "xx----", "xx---", "-xxxxx", "-xxxx"},
    {'m', "xx----", "xx---", "-xxxxx", "-xxxx"},
    {'o', "------", "-----", "-xxxxx", "-xxxx"},
};

static int is_allowed(fmi2Type type, State state, const char *exchange, const char *co_simulation) {
    static const int column[2][STATES] = {{0, 1, -1, 2, 3, 4, 5}, {0, 1, 2, -1, -1, 3, 4}};
    const char *row = type == fmi2CoSimulation ? co_simulation : exchange;
    return row[column[type == fmi2CoSimulation][state]] == 'x';
}

/* A forbidden call: fmi2Error, one line that names the function and when, and nothing changed. */
static void check_refusal(Slave *s, State state, const char *function, fmi2Status status, int lines,
                          const Snapshot *before) {
    const char *where = state_name[state], *type = type_name(s->type);
    CHECK(status == fmi2Error, "%s: %s in %s: status %d", type, function, where, (int)status);
    CHECK(s->log.lines == lines + 1, "%s: %s in %s: %d log lines", type, function, where, s->log.lines - lines);
    CHECK(s->log.status == fmi2Error && s->log.category == ERROR, "%s in %s: logged as status %d, %s",
          function, where, (int)s->log.status, category_name[s->log.category % CATEGORIES]);
    CHECK(strstr(s->log.text, function), "%s in %s: the line does not name it: %s", function, where, s->log.text);
    CHECK(strstr(s->log.text, "t = "), "%s in %s: the line has no time: %s", function, where, s->log.text);
    CHECK(is_same(s, before), "%s: %s in %s: refused, but it changed something", type, function, where);
}

static void check_call(fmi2Type type, State state, const char *function, Call call, int allowed) {
    Slave *s = make_in(type, state);
    Snapshot before = snapshot(s);
    int lines = s->log.lines;
    fmi2Status status = call(s);
    if (!allowed) {
        check_refusal(s, state, function, status, lines, &before);
        if (state != INSTANTIATED) read_all(s, 0);
    } else if (status == fmi2Discard) {
        CHECK(strstr(function, "Status"), "%s discards", function);
        CHECK(s->log.of[DISCARD], "%s says nothing about fmi2Discard", function);
    } else {
        CHECK(status == fmi2OK, "%s: %s in %s: status %d: %s", type_name(type), function,
              state_name[state], (int)status, s->log.text);
    }
    check_reset(s, function);
    forget(&before);
    release(s);
}

/* Write to, or read, one variable of a kind; `s` keeps what happened. */
static fmi2Status touch(Slave *s, const Variable *v, int writes) {
    fmi2Real real = v->start;
    fmi2Integer integer = (fmi2Integer)v->start;
    if (v->is_integer)
        return writes ? fmi2SetInteger(s->fmu, &v->vr, 1, &integer) : fmi2GetInteger(s->fmu, &v->vr, 1, &integer);
    return writes ? fmi2SetReal(s->fmu, &v->vr, 1, &real) : fmi2GetReal(s->fmu, &v->vr, 1, &real);
}

static void check_variable(fmi2Type type, State state, const Variable *v, int writes, int allowed) {
    Slave *s = make_in(type, state);
    Snapshot before = snapshot(s);
    int lines = s->log.lines;
    fmi2Status status = touch(s, v, writes);
    if (allowed)
        CHECK(status == fmi2OK, "%s: %s %s in %s: %s", type_name(type), writes ? "setting" : "getting",
              v->name, state_name[state], s->log.text);
    else
        check_refusal(s, state, writes ? "fmi2Set" : "fmi2Get", status, lines, &before);
    check_reset(s, v->name);
    forget(&before);
    release(s);
}

static const Variable *of_kind(char kind) {
    int k;
    for (k = 0; k < n_variables; k++)
        if (variable[k].kind == kind && variable[k].vr != inner_step) return &variable[k];
    return NULL;
}

static void without_instance(void) {
    Slave none;
    size_t k;
    memset(&none, 0, sizeof none);
    for (k = 0; k < sizeof table / sizeof *table; k++) {
        Call call = table[k].call;
        if (call == call_get_types_platform || call == call_get_version || call == call_instantiate) continue;
        CHECK(call(&none) == fmi2Error, "%s without an instance", table[k].function);
    }
    fmi2FreeInstance(NULL);
}

/* What the modelDescription.xml does not promise may not be called at all. */
static int is_supported(Call call) { return call != call_get_real_output_derivatives || output_derivatives; }

static void in_state(fmi2Type type, State state) {
    size_t k;
    for (k = 0; k < sizeof table / sizeof *table; k++)
        check_call(type, state, table[k].function, table[k].call, is_supported(table[k].call) &&
                   is_allowed(type, state, table[k].exchange, table[k].co_simulation));
    for (k = 0; k < sizeof footnotes / sizeof *footnotes; k++) {
        const Variable *v = of_kind(footnotes[k].kind);
        if (!v) continue;
        check_variable(type, state, v, 1, is_allowed(type, state, footnotes[k].set_exchange, footnotes[k].set_co_simulation));
        check_variable(type, state, v, 0, is_allowed(type, state, footnotes[k].get_exchange, footnotes[k].get_co_simulation));
    }
    release(make_in(type, state)); /* fmi2FreeInstance, allowed everywhere */
}

void states(void) {
    int type, state;
    for (type = fmi2ModelExchange; type <= fmi2CoSimulation; type++)
        for (state = 0; state < STATES; state++)
            if (has_state((fmi2Type)type, (State)state)) in_state((fmi2Type)type, (State)state);
    without_instance();
}
