/* The FMU's state: a copy of struct State, serialized byte by byte. */

/* Bytes may come from anywhere: a stage or an integer that cannot be. */
static int is_damaged(const State *s) {
    int possible = s->type == fmi2CoSimulation ? ANY & ~(EVENT | CONTINUOUS) : ANY & ~STEPPING, i;
    for (i = 0; i < N_VALUES; i++)
        if (is_integer[i] && !(fabs(s->value[i]) <= 2147483647.0)) return 1;
    return !(s->stage & possible) || s->stage & (s->stage - 1);
}

static fmi2Status restore(Instance *m, const char *function, const State *state) {
    if (memcmp(state->guid, MODEL_GUID, sizeof state->guid))
        REFUSE("%s: the state is not of this model", function);
    if (state->type != m->now.type)
        REFUSE("%s: the state is of an instance of the other FMU type", function);
    if (is_damaged(state)) REFUSE("%s: the state is damaged", function);
    m->now = *state;
    m->interpolating = 0;
    m->slope_known = m->start_known = 0;
#if N_E
    if (m->now.stage & RUNNING) conditions(m);
#endif
    return fmi2OK;
}

fmi2Status fmi2GetFMUstate(fmi2Component component, fmi2FMUstate *state) {
    BEGIN("fmi2GetFMUstate", ANY);
    if (!state) REFUSE("fmi2GetFMUstate: a null pointer was given");
    if (!*state) *state = malloc(sizeof(State));
    if (!*state) REFUSE("fmi2GetFMUstate: out of memory");
    memcpy(*state, &m->now, sizeof(State));
    return fmi2OK;
}

fmi2Status fmi2SetFMUstate(fmi2Component component, fmi2FMUstate state) {
    BEGIN("fmi2SetFMUstate", ANY);
    if (!state) REFUSE("fmi2SetFMUstate: a null pointer was given");
    return restore(m, "fmi2SetFMUstate", (const State *)state);
}

fmi2Status fmi2FreeFMUstate(fmi2Component component, fmi2FMUstate *state) {
    BEGIN("fmi2FreeFMUstate", ANY);
    if (state) {
        free(*state);
        *state = NULL;
    }
    return fmi2OK;
}

fmi2Status fmi2SerializedFMUstateSize(fmi2Component component, fmi2FMUstate state, size_t *size) {
    BEGIN("fmi2SerializedFMUstateSize", ANY);
    if (!state || !size) REFUSE("fmi2SerializedFMUstateSize: a null pointer was given");
    *size = sizeof(State);
    return fmi2OK;
}

fmi2Status fmi2SerializeFMUstate(fmi2Component component, fmi2FMUstate state, fmi2Byte bytes[],
                                 size_t size) {
    BEGIN("fmi2SerializeFMUstate", ANY);
    if (!state || !bytes) REFUSE("fmi2SerializeFMUstate: a null pointer was given");
    if (size != sizeof(State)) REFUSE("fmi2SerializeFMUstate: the size must be %u", (unsigned)sizeof(State));
    memcpy(bytes, state, sizeof(State));
    return fmi2OK;
}

fmi2Status fmi2DeSerializeFMUstate(fmi2Component component, const fmi2Byte bytes[], size_t size,
                                   fmi2FMUstate *state) {
    BEGIN("fmi2DeSerializeFMUstate", ANY);
    if (!state || !bytes) REFUSE("fmi2DeSerializeFMUstate: a null pointer was given");
    if (size != sizeof(State)) REFUSE("fmi2DeSerializeFMUstate: the size must be %u", (unsigned)sizeof(State));
    if (memcmp(bytes, MODEL_GUID, sizeof MODEL_GUID)) REFUSE("fmi2DeSerializeFMUstate: the state is not of this model");
    if (!*state) *state = malloc(sizeof(State));
    if (!*state) REFUSE("fmi2DeSerializeFMUstate: out of memory");
    memcpy(*state, bytes, sizeof(State));
    return fmi2OK;
}
