/* Carries out a schedule: the operations of a tick, one after the other, on registers.
 *
 * One file for all diagrams: what there is to do stands in tables that Python has made (table.py; the
 * structures below have their twins in structures.py). Python's functions come as pointers, so that
 * neither its headers nor its library are needed; nor is a C library, or memory of our own. The caller
 * holds the interpreter's lock.
 *
 * The results are those of the generated Python (generate.py), bit for bit. Plain floats, and the ints
 * that FMUs give, are computed with here; whatever else a block hands out goes through Python's own
 * operators, with what these raise.
 */
#include <stddef.h>

#ifdef _WIN32
#define EXPORT __declspec(dllexport)
#else
#define EXPORT __attribute__((visibility("default")))
#endif

#ifdef WITHOUT_C_RUNTIME /* a Windows DLL that is linked without the compiler's start-up code */
int DllMainCRTStartup(void *module, unsigned long reason, void *reserved) {
    (void)module, (void)reason, (void)reserved;
    return 1;
}
#endif

typedef void Object; /* a Python object */

/* Python's C API. References are new where not said otherwise; NULL and -1 are failures. */
typedef struct {
    Object *(*vectorcall)(Object *, Object *const *, size_t, Object *);
    void (*incref)(Object *);
    void (*decref)(Object *);
    double (*float_as_double)(Object *);
    Object *(*float_from_double)(double);
    Object *(*long_from_long_long)(long long);
    Object *(*tuple_new)(ptrdiff_t);
    int (*tuple_set_item)(Object *, ptrdiff_t, Object *); /* takes the reference */
    Object *(*tuple_get_item)(Object *, ptrdiff_t);       /* borrowed */
    ptrdiff_t (*tuple_size)(Object *);
    Object *(*list_new)(ptrdiff_t);
    int (*list_set_item)(Object *, ptrdiff_t, Object *); /* takes the reference */
    Object *(*list_get_item)(Object *, ptrdiff_t);       /* borrowed */
    int (*sequence_set_item)(Object *, ptrdiff_t, Object *);
    Object *(*number_add)(Object *, Object *);
    Object *(*number_subtract)(Object *, Object *);
    Object *(*number_multiply)(Object *, Object *);
    Object *(*number_true_divide)(Object *, Object *);
    Object *(*rich_compare)(Object *, Object *, int);
    int (*is_true)(Object *);
    Object *(*error_occurred)(void); /* borrowed */
    void (*error_clear)(void);
    void (*error_set_string)(Object *, const char *);
    int (*check_signals)(void);
    void *(*save_thread)(void);
    void (*restore_thread)(void *);
    Object *float_type, *tuple_type, *runtime_error;
    size_t type_offset; /* of the pointer to its type in an object */
} Python;

enum { LESS = 0, LESS_EQUAL = 1, NOT_EQUAL = 3 }; /* Py_LT, Py_LE, Py_NE */
#define FREE_BEFORE ((size_t)1 << (8 * sizeof(size_t) - 1)) /* PY_VECTORCALL_ARGUMENTS_OFFSET */

static Python py;

/* What a register holds. The object is also there for a number once someone has asked for it. */
enum { EMPTY, OBJECT, NUMBER, WHOLE };
typedef struct {
    int kind;
    long long whole;
    double number;
    Object *object;
} Register;

/* The first registers: the tick, its start, middle and end (s), and where a divided tick has come to (s) */
enum { K, T, TM, T1, TP };

/* An entry of `tuples` is a register, or −1 − the place where another tuple stands: its length and then
 * its entries. */
typedef struct {
    Object *function, *self; /* `self` comes first, if there is one */
    const int *tuples;       /* at 0 the arguments */
    int results, has_results;
    Object *unpack; /* takes a result apart that is no plain tuple, or says why that cannot be */
} Call;

typedef struct {
    int result, is_whole;
    const void *address;
} Slot;

typedef struct {
    int count;
    const Slot *slots;
} Read;

enum { AS_IT_IS, ROUNDED, BOOLEAN };
typedef struct {
    int value, ahead; /* −1: nothing ahead */
    int conversion, has_slope;
    void *address;
    Object *array, *converter; /* for what is no plain number */
    ptrdiff_t index;
    double *slope_address;
    Object *slope_array;
    ptrdiff_t slope_index;
} Input;

enum { DO_STEP, TRANSFER, TRANSFER_SLOPES };
typedef struct {
    int kind, flag; /* flag: noSetFMUStatePriorToCurrentPoint of fmi2DoStep */
    int at_end;     /* whether a failure belongs to the step's end */
    void *function, *component;
    const unsigned *references;
    size_t size;
    const int *orders;
    void *values;
    Object *name;
} FmuCall;

typedef struct {
    int inputs, calls;
    int is_unlocked; /* the interpreter's lock is released meanwhile */
    int is_divided;  /* it begins at TP and goes over the state's span */
    const Input *input;
    const FmuCall *call;
    double span;
    Object *span_object, *half;
    Object *fail;
    Object *method, *self; /* instead of calls */
} Advance;

typedef struct {
    int result, ring, newest, time_register;
    long long length, whole, ahead, first;
    double part, time;
    Object *part_object;
    Object *initial, *history; /* history: a function, in place of a number */
} Past;

typedef struct {
    int ring, source;
    long long length;
} Keep;

typedef struct {
    int result, source;
} Move;

typedef struct {
    int result, start, end;
    Object *two;
} Line;

typedef struct {
    int event, state;
    Object *function, *self;
} Announce;

typedef struct {
    int event; /* −1: an edge */
    int ring, always;
    long long length, whole, first;
} Test;

typedef struct {
    int count;
    const Test *tests;
} Branch;

typedef struct {
    int result, ring;
    long long length, shift;
    double part;
    Object *part_object;
    Object *initial, *history; /* history: a function of k, in place of a number */
} Within;

/* A place at (a + k b) / q (s) inside the tick. Up to tick `last` doubles hold these numbers, later the
 * objects have to do. */
typedef struct {
    int count;
    const Test *tests;
    long long last;
    double a, b, q;
    Object *a_object, *b_object, *q_object;
    const double *spans; /* to each later stop, then to the tick's end */
} Stop;

typedef struct {
    int count; /* no more than `jumps` has bits */
    const Stop *stops;
    const double *spans; /* from the tick's start */
} Divide;

typedef struct {
    const Divide *divide;
    int number;
} Land;

typedef struct {
    int count;
    const int *registers;
    Object *pack; /* for what is no number: raises */
} Record;

enum { CALL, READ, ADVANCE, PAST, KEEP, MOVE, LINE, ANNOUNCE, BRANCH, JUMP, RECORD, WITHIN, DIVIDE, LAND };
typedef struct {
    int kind;
    int next; /* after it; for a branch, a division or a stop if no test holds */
    long long every;
    const void *what;
} Operation;

enum { USES_T = 1, USES_TM = 2, USES_T1 = 4 };
typedef struct {
    long long a, b; /* t_k = (a + k b) / q */
    double q;
    int times;
    int operations;
    const Operation *operation;
    int registers, living, first_living;
    Object *pause; /* a function that does nothing, where Python does what is due */
} Table;

typedef struct {
    const Table *table;
    Register *registers;
    Object **stack; /* for arguments, with one place before them */
    double *row;
    long long k, end;
    int operation; /* −1 between ticks */
    unsigned jumps; /* the stops of this tick, as bits */
    double span;    /* of a divided step (s) */
} State;

/* Registers */

static Object *type_of(Object *object) { return *(Object **)((char *)object + py.type_offset); }

static void set_object(Register *r, Object *object) { /* takes the reference */
    Object *old = r->object;
    r->kind = OBJECT;
    r->object = object;
    if (old) py.decref(old);
}

static void set_number(Register *r, double number) {
    Object *old = r->object;
    r->kind = NUMBER;
    r->number = number;
    r->object = NULL;
    if (old) py.decref(old);
}

static void set_whole(Register *r, long long whole) {
    Object *old = r->object;
    r->kind = WHOLE;
    r->whole = whole;
    r->object = NULL;
    if (old) py.decref(old);
}

static void move(Register *to, const Register *from) {
    Object *old = to->object;
    if (from->object) py.incref(from->object);
    *to = *from;
    if (old) py.decref(old);
}

static void clear(Register *r) {
    Object *old = r->object;
    r->kind = EMPTY;
    r->object = NULL;
    if (old) py.decref(old);
}

/* Put what a call returned; NULL is a failure. */
static int set_result(Register *r, Object *object) {
    if (!object) return -1;
    set_object(r, object);
    return 0;
}

/* Return a borrowed reference. */
static Object *object_of(Register *r) {
    if (r->object) return r->object;
    if (r->kind == NUMBER) r->object = py.float_from_double(r->number);
    else if (r->kind == WHOLE) r->object = py.long_from_long_long(r->whole);
    else py.error_set_string(py.runtime_error, "a register is read before it is written");
    return r->object;
}

/* Whether it is a float, or an int that an FMU gave: these are exact as doubles. */
static int is_number(Register *r, double *number) {
    if (r->kind == OBJECT && type_of(r->object) == py.float_type) {
        r->number = py.float_as_double(r->object);
        r->kind = NUMBER;
    }
    if (r->kind == NUMBER) *number = r->number;
    else if (r->kind == WHOLE) *number = (double)r->whole;
    else return 0;
    return 1;
}

/* Python's operators */

static Object *call1(Object *function, Object *self, Object *argument) {
    Object *stack[3];
    stack[1] = self ? self : argument;
    stack[2] = argument;
    return py.vectorcall(function, stack + 1, (self ? 2 : 1) | FREE_BEFORE, NULL);
}

static int compare(Object *a, Object *b, int how) {
    Object *answer = a && b ? py.rich_compare(a, b, how) : NULL;
    int truth;
    if (!answer) return -1;
    truth = py.is_true(answer);
    py.decref(answer);
    return truth;
}

static Object *and_release(Object *result, Object *used) {
    py.decref(used);
    return result;
}

/* start + factor · (end − start) */
static int along(Register *result, Register *start, Register *end, double factor, Object *factor_object) {
    double a, b;
    Object *from, *x;
    if (is_number(start, &a) && is_number(end, &b)) {
        set_number(result, a + factor * (b - a));
        return 0;
    }
    if (!(from = object_of(start)) || !(x = object_of(end))) return -1;
    if (!(x = py.number_subtract(x, from))) return -1;
    if (!(x = and_release(py.number_multiply(factor_object, x), x))) return -1;
    return set_result(result, and_release(py.number_add(from, x), x));
}

/* Calls */

static Object *argument_of(State *s, const int *tuples, int entry) {
    Object *tuple, *item;
    const int *entries;
    int i;
    if (entry >= 0) {
        if ((item = object_of(&s->registers[entry]))) py.incref(item);
        return item;
    }
    entries = tuples - 1 - entry;
    if (!(tuple = py.tuple_new(entries[0]))) return NULL;
    for (i = 0; i < entries[0]; i++) {
        item = argument_of(s, tuples, entries[1 + i]);
        if (!item) {
            py.decref(tuple);
            return NULL;
        }
        py.tuple_set_item(tuple, i, item);
    }
    return tuple;
}

/* Whether an object consists of plain tuples as the entry does. */
static int fits(const int *tuples, int entry, Object *object) {
    const int *entries = tuples - 1 - entry;
    int i;
    if (entry >= 0) return 1;
    if (type_of(object) != py.tuple_type || py.tuple_size(object) != entries[0]) return 0;
    for (i = 0; i < entries[0]; i++)
        if (entries[1 + i] < 0 && !fits(tuples, entries[1 + i], py.tuple_get_item(object, i))) return 0;
    return 1;
}

/* Put the parts of an object that fits, or of a flat tuple, of which `next` is the next one. */
static void distribute(State *s, const int *tuples, int entry, Object *object, Object *flat, int *next) {
    const int *entries = tuples - 1 - entry;
    int i;
    if (entry >= 0) {
        if (flat) object = py.tuple_get_item(flat, (*next)++);
        py.incref(object);
        set_object(&s->registers[entry], object);
        return;
    }
    for (i = 0; i < entries[0]; i++)
        distribute(s, tuples, entries[1 + i], flat ? NULL : py.tuple_get_item(object, i), flat, next);
}

static int assign(State *s, const Call *c, Object *result) { /* takes the reference */
    Object *flat;
    int next = 0;
    if (c->results >= 0) {
        set_object(&s->registers[c->results], result);
        return 0;
    }
    if (fits(c->tuples, c->results, result)) {
        distribute(s, c->tuples, c->results, result, NULL, &next);
        py.decref(result);
        return 0;
    }
    flat = and_release(call1(c->unpack, NULL, result), result);
    if (!flat) return -1;
    distribute(s, c->tuples, c->results, NULL, flat, &next);
    py.decref(flat);
    return 0;
}

static int call(State *s, const Call *c) {
    const int *entries = c->tuples + 1;
    int count = c->tuples[0], i, made;
    Object **arguments = s->stack + 1, *result = NULL;
    if (c->self) *arguments++ = c->self;
    for (made = 0; made < count; made++) {
        int entry = entries[made];
        arguments[made] = entry >= 0 ? object_of(&s->registers[entry]) : argument_of(s, c->tuples, entry);
        if (!arguments[made]) break;
    }
    if (made == count) {
        size_t size = (size_t)count + (c->self != NULL);
        result = py.vectorcall(c->function, s->stack + 1, size | FREE_BEFORE, NULL);
    }
    for (i = 0; i < made; i++)
        if (entries[i] < 0) py.decref(arguments[i]);
    if (!result) return -1;
    if (c->has_results) return assign(s, c, result);
    py.decref(result);
    return 0;
}

/* FMUs */

static void read(State *s, const Read *r) {
    int i;
    for (i = 0; i < r->count; i++) {
        const Slot *slot = &r->slots[i];
        if (slot->is_whole) set_whole(&s->registers[slot->result], *(const int *)slot->address);
        else set_number(&s->registers[slot->result], *(const double *)slot->address);
    }
}

static int write_object(const Input *in, Object *object) {
    int status;
    if (!object) return -1;
    if (!in->converter) return py.sequence_set_item(in->array, in->index, object);
    if (!(object = call1(in->converter, NULL, object))) return -1;
    status = py.sequence_set_item(in->array, in->index, object);
    py.decref(object);
    return status;
}

/* array[index] = converter(value) */
static int write(const Input *in, Register *value) {
    static const double shift = 6755399441055744.0; /* 1.5 · 2^52: what is below 1 is rounded off */
    double x;
    if (!is_number(value, &x)) return write_object(in, object_of(value));
    if (in->conversion == AS_IT_IS) *(double *)in->address = x;
    else if (in->conversion == BOOLEAN) *(int *)in->address = x != 0.0;
    else if (-2147483648.0 <= x && x <= 2147483647.0) *(int *)in->address = (int)((x + shift) - shift);
    else return write_object(in, object_of(value));
    return 0;
}

/* slopes[index] = (ahead − value) / span */
static int write_slope(const Advance *advance, const Input *in, Register *value, Register *ahead) {
    double a, b;
    Object *from, *x;
    int status;
    if (is_number(value, &a) && is_number(ahead, &b)) {
        *in->slope_address = (b - a) / advance->span;
        return 0;
    }
    if (!(from = object_of(value)) || !(x = object_of(ahead))) return -1;
    if (!(x = py.number_subtract(x, from))) return -1;
    if (!(x = and_release(py.number_true_divide(x, advance->span_object), x))) return -1;
    status = py.sequence_set_item(in->slope_array, in->slope_index, x);
    py.decref(x);
    return status;
}

static int give(State *s, const Advance *advance, const Input *in) {
    Register *value = &s->registers[in->value], middle = {EMPTY, 0, 0.0, NULL};
    int status;
    if (in->ahead < 0) {
        if (in->has_slope) *in->slope_address = 0.0;
        return write(in, value);
    }
    if (in->has_slope) {
        if (write(in, value)) return -1;
        return write_slope(advance, in, value, &s->registers[in->ahead]);
    }
    status = along(&middle, value, &s->registers[in->ahead], 0.5, advance->half);
    if (!status) status = write(in, &middle);
    clear(&middle);
    return status;
}

static int invoke(const FmuCall *c, double t, double span) {
    typedef int Step(void *, double, double, int);
    typedef int Transfer(void *, const unsigned *, size_t, void *);
    typedef int TransferSlopes(void *, const unsigned *, size_t, const int *, const void *);
    switch (c->kind) {
        case DO_STEP: return ((Step *)c->function)(c->component, t, span, c->flag);
        case TRANSFER: return ((Transfer *)c->function)(c->component, c->references, c->size, c->values);
    }
    return ((TransferSlopes *)c->function)(c->component, c->references, c->size, c->orders, c->values);
}

/* Have Python raise what an FMU's status means. */
static int fail(const Advance *advance, const FmuCall *c, int status, double t, double span) {
    Object *stack[4], **arguments = stack + 1, *result = NULL;
    arguments[0] = c->name;
    arguments[1] = py.long_from_long_long(status);
    arguments[2] = py.float_from_double(c->at_end ? t + span : t);
    if (arguments[1] && arguments[2]) result = py.vectorcall(advance->fail, arguments, 3 | FREE_BEFORE, NULL);
    if (arguments[1]) py.decref(arguments[1]);
    if (arguments[2]) py.decref(arguments[2]);
    if (!result) return -1;
    py.decref(result);
    return 0;
}

static int advance_by_method(State *s, const Advance *advance) {
    Object *stack[4], **arguments = stack + 1, *span = advance->span_object, *result;
    size_t count = 0;
    if (advance->self) arguments[count++] = advance->self;
    if (!(arguments[count++] = object_of(&s->registers[advance->is_divided ? TP : T]))) return -1;
    if (advance->is_divided && !(span = py.float_from_double(s->span))) return -1;
    arguments[count++] = span;
    result = py.vectorcall(advance->method, arguments, count | FREE_BEFORE, NULL);
    if (advance->is_divided) py.decref(span);
    if (!result) return -1;
    py.decref(result);
    return 0;
}

static int advance(State *s, const Advance *advance) {
    double t = s->registers[advance->is_divided ? TP : T].number;
    double span = advance->is_divided ? s->span : advance->span;
    int i, status;
    for (i = 0; i < advance->inputs; i++)
        if (give(s, advance, &advance->input[i])) return -1;
    if (advance->method) return advance_by_method(s, advance);
    for (i = 0; i < advance->calls;) {
        void *thread = advance->is_unlocked ? py.save_thread() : NULL;
        for (status = 0; i < advance->calls && status <= 1; i++)
            status = invoke(&advance->call[i], t, span);
        if (advance->is_unlocked) py.restore_thread(thread);
        if (status > 1 && fail(advance, &advance->call[i - 1], status, t, span)) return -1;
    }
    return 0;
}

/* Delays */

/* tick modulo length, from 0. With 32 bits processors divide in a fraction of the time. */
static long long modulo(long long tick, long long length) {
    long long place;
    if (!(((unsigned long long)tick | (unsigned long long)length) >> 32))
        return (unsigned)tick % (unsigned)length;
    place = tick % length;
    return place < 0 ? place + length : place;
}

static Object *sample(State *s, int ring, long long length, long long tick) { /* borrowed */
    Object *list = object_of(&s->registers[ring]);
    return list ? py.list_get_item(list, (ptrdiff_t)modulo(tick, length)) : NULL;
}

static int history(State *s, const Past *p, Register *result) {
    Object *time, *value;
    if (!p->history) {
        py.incref(p->initial);
        return set_result(result, p->initial);
    }
    if (!(time = py.float_from_double(s->registers[p->time_register].number - p->time))) return -1;
    value = call1(p->history, NULL, time);
    py.decref(time);
    return set_result(result, value);
}

/* Put the sample of `back` ticks before the one asked for. */
static int put_sample(State *s, const Past *p, long long back, Register *result) {
    Object *object;
    if (back == 0 && !p->ahead) {
        move(result, &s->registers[p->newest]);
        return 0;
    }
    object = sample(s, p->ring, p->length, s->k - (back - p->ahead));
    if (object) py.incref(object);
    return set_result(result, object);
}

static int past(State *s, const Past *p) {
    Register *result = &s->registers[p->result];
    Register later = {EMPTY, 0, 0.0, NULL}, earlier = {EMPTY, 0, 0.0, NULL};
    int status;
    if (s->k < p->first) return history(s, p, result);
    if (p->part == 0.0) return put_sample(s, p, p->whole, result);
    status = put_sample(s, p, p->whole, &later);
    if (!status) status = put_sample(s, p, p->whole + 1, &earlier);
    if (!status) status = along(result, &later, &earlier, p->part, p->part_object);
    clear(&later);
    clear(&earlier);
    return status;
}

static int keep(State *s, const Keep *k) {
    Object *list = object_of(&s->registers[k->ring]), *object = object_of(&s->registers[k->source]);
    if (!list || !object) return -1;
    py.incref(object);
    return py.list_set_item(list, (ptrdiff_t)modulo(s->k, k->length), object);
}

/* Events */

/* Whether a < b, or a <= b: 1 or 0. */
static int precedes(Register *a, Register *b, int how) {
    double x, y;
    if (is_number(a, &x) && is_number(b, &y)) return how == LESS ? x < y : x <= y;
    return compare(object_of(a), object_of(b), how);
}

static int announce(State *s, const Announce *a) {
    Register *event = &s->registers[a->event], *time = &s->registers[T];
    Object *stack[4], **arguments = stack + 1;
    size_t count = 0;
    int is_past = precedes(event, time, LESS_EQUAL);
    if (is_past <= 0) return is_past;
    if (a->self) arguments[count++] = a->self;
    if (!(arguments[count++] = object_of(&s->registers[a->state]))) return -1;
    if (!(arguments[count++] = object_of(time))) return -1;
    return set_result(event, py.vectorcall(a->function, arguments, count | FREE_BEFORE, NULL));
}

static int is_edge(State *s, const Test *test) {
    Object *list, *old, *new;
    long long place;
    int answer;
    if (s->k == test->first) return 1;
    if (!test->always || s->k < test->first) return 0;
    if (!(list = object_of(&s->registers[test->ring]))) return -1;
    place = modulo(s->k - test->whole, test->length);
    if (!(old = py.list_get_item(list, (ptrdiff_t)place))) return -1;
    place = place + 1 < test->length ? place + 1 : 0;
    if (!(new = py.list_get_item(list, (ptrdiff_t)place))) return -1;
    if (type_of(old) == py.float_type && type_of(new) == py.float_type) {
        double before = py.float_as_double(old);
        return before != (old == new ? before : py.float_as_double(new));
    }
    py.incref(old);
    py.incref(new);
    answer = compare(old, new, NOT_EQUAL);
    py.decref(old);
    py.decref(new);
    return answer;
}

static int any(State *s, const Branch *b) {
    int i, answer = 0;
    for (i = 0; i < b->count && !answer; i++) {
        const Test *test = &b->tests[i];
        if (test->event < 0) answer = is_edge(s, test);
        else answer = precedes(&s->registers[test->event], &s->registers[T1], LESS);
    }
    return answer;
}

static int any_edge(State *s, int count, const Test *tests) {
    int i, answer = 0;
    for (i = 0; i < count && !answer; i++) answer = is_edge(s, &tests[i]);
    return answer;
}

/* Go on from before stop `from`: the span is that to the next stop of this tick, or to its end. */
static void choose_span(State *s, const Divide *d, const double *spans, int from) {
    int next = from;
    while (next < d->count && !(s->jumps >> next & 1)) next++;
    s->span = spans[next - from];
}

/* Whether the tick is divided: 1 or 0. */
static int divide(State *s, const Divide *d) {
    int i;
    s->jumps = 0;
    for (i = 0; i < d->count; i++) {
        int answer = any_edge(s, d->stops[i].count, d->stops[i].tests);
        if (answer < 0) return -1;
        s->jumps |= (unsigned)answer << i;
    }
    if (!s->jumps) return 0;
    set_number(&s->registers[TP], s->registers[T].number);
    choose_span(s, d, d->spans, 0);
    return 1;
}

static int place_time(State *s, const Stop *stop, double *t) {
    Object *x;
    if (s->k <= stop->last) {
        *t = (stop->a + (double)s->k * stop->b) / stop->q;
        return 0;
    }
    if (!(x = py.long_from_long_long(s->k))) return -1;
    if (!(x = and_release(py.number_multiply(x, stop->b_object), x))) return -1;
    if (!(x = and_release(py.number_add(stop->a_object, x), x))) return -1;
    if (!(x = and_release(py.number_true_divide(x, stop->q_object), x))) return -1;
    *t = py.float_as_double(x);
    py.decref(x);
    return 0;
}

/* Whether this tick has the stop: 1 or 0. */
static int land(State *s, const Land *l) {
    const Stop *stop = &l->divide->stops[l->number];
    double t;
    if (!(s->jumps >> l->number & 1)) return 0;
    if (place_time(s, stop, &t)) return -1;
    set_number(&s->registers[TP], t);
    choose_span(s, l->divide, stop->spans, l->number + 1);
    return 1;
}

static int put_ring(State *s, const Within *w, long long tick, Register *result) {
    Object *object = sample(s, w->ring, w->length, tick);
    if (object) py.incref(object);
    return set_result(result, object);
}

static int within(State *s, const Within *w) {
    Register *result = &s->registers[w->result];
    Register old = {EMPTY, 0, 0.0, NULL}, new = {EMPTY, 0, 0.0, NULL};
    long long tick = s->k + w->shift;
    int status;
    if (tick < 0) {
        Object *k;
        if (!w->history) {
            py.incref(w->initial);
            return set_result(result, w->initial);
        }
        if (!(k = py.long_from_long_long(s->k))) return -1;
        return set_result(result, and_release(call1(w->history, NULL, k), k));
    }
    if (w->part == 0.0 || w->shift == 0) return put_ring(s, w, tick, result);
    status = put_ring(s, w, tick, &old);
    if (!status) status = put_ring(s, w, tick + 1, &new);
    if (!status) status = along(result, &old, &new, w->part, w->part_object);
    clear(&old);
    clear(&new);
    return status;
}

/* Rows */

static int record(State *s, const Record *r) {
    int i;
    for (i = 0; i < r->count; i++) {
        Register *value = &s->registers[r->registers[i]];
        Object *object, *packed;
        double x;
        if (!is_number(value, &x)) {
            if (!(object = object_of(value))) return -1;
            x = py.float_as_double(object);
            if (x == -1.0 && py.error_occurred()) {
                py.error_clear();
                if ((packed = call1(r->pack, NULL, object))) py.decref(packed);
                return -1;
            }
        }
        s->row[i] = x;
    }
    s->row += r->count;
    return 0;
}

/* Ticks */

static void begin(State *s) {
    const Table *table = s->table;
    Register *r = s->registers;
    set_whole(&r[K], s->k);
    if (table->times & (USES_T | USES_TM)) set_number(&r[T], (double)(table->a + s->k * table->b) / table->q);
    if (table->times & (USES_T1 | USES_TM))
        set_number(&r[T1], (double)(table->a + (s->k + 1) * table->b) / table->q);
    if (table->times & USES_TM) set_number(&r[TM], 0.5 * (r[T].number + r[T1].number));
}

static int tick(State *s) {
    Register *r = s->registers;
    int i = 0;
    begin(s);
    while (i < s->table->operations) {
        const Operation *o = &s->table->operation[i];
        const void *what = o->what;
        int status = 0;
        s->operation = i++;
        if (o->every > 1 && modulo(s->k, o->every)) continue;
        switch (o->kind) {
            case CALL: status = call(s, what); break;
            case READ: read(s, what); break;
            case ADVANCE: status = advance(s, what); break;
            case PAST: status = past(s, what); break;
            case KEEP: status = keep(s, what); break;
            case MOVE: move(&r[((const Move *)what)->result], &r[((const Move *)what)->source]); break;
            case LINE: {
                const Line *line = what;
                status = along(&r[line->result], &r[line->start], &r[line->end], 2.0, line->two);
                break;
            }
            case ANNOUNCE: status = announce(s, what); break;
            case BRANCH:
                status = any(s, what);
                if (!status) i = o->next;
                break;
            case JUMP: i = o->next; break;
            case WITHIN: status = within(s, what); break;
            case DIVIDE:
                status = divide(s, what);
                if (!status) i = o->next;
                break;
            case LAND:
                status = land(s, what);
                if (!status) i = o->next;
                break;
            case RECORD: status = record(s, what); break;
        }
        if (status < 0) return -1;
    }
    s->operation = -1;
    return 0;
}

/* Let other threads run where they wait, and signals arrive. */
static int breathe(State *s) {
    Object *done;
    if (s->k & 63) return py.check_signals();
    done = py.vectorcall(s->table->pause, s->stack + 1, 0 | FREE_BEFORE, NULL);
    if (!done) return -1;
    py.decref(done);
    return 0;
}

EXPORT void stepper_open(const Python *python) { py = *python; }

/* Return the sizes of the structures, for a comparison with their twins. */
EXPORT size_t stepper_size(int which) {
    static const size_t sizes[] = {
        sizeof(Python), sizeof(Register), sizeof(Call), sizeof(Slot), sizeof(Read), sizeof(Input),
        sizeof(FmuCall), sizeof(Advance), sizeof(Past), sizeof(Keep), sizeof(Move), sizeof(Line),
        sizeof(Announce), sizeof(Test), sizeof(Branch), sizeof(Within), sizeof(Stop), sizeof(Divide), sizeof(Land),
        sizeof(Record), sizeof(Operation), sizeof(Table), sizeof(State)};
    return which >= 0 && (size_t)which < sizeof sizes / sizeof *sizes ? sizes[which] : 0;
}

/* Return the living registers as a list. */
EXPORT Object *stepper_values(State *s) {
    const Table *table = s->table;
    Object *list = py.list_new(table->living), *object;
    int i;
    for (i = 0; list && i < table->living; i++) {
        if (!(object = object_of(&s->registers[table->first_living + i]))) {
            py.decref(list);
            return NULL;
        }
        py.incref(object);
        py.list_set_item(list, i, object);
    }
    return list;
}

/* Run the ticks k … end − 1 from the values of the living registers, and return those then. After a
 * failure the state tells where it was; call stepper_release in any case. */
EXPORT Object *stepper_run(State *s, Object *values) {
    const Table *table = s->table;
    int i;
    s->operation = -1;
    for (i = 0; i < table->living; i++) {
        Object *object = py.list_get_item(values, i);
        if (!object) return NULL;
        py.incref(object);
        set_object(&s->registers[table->first_living + i], object);
    }
    for (; s->k < s->end; s->k++)
        if (breathe(s) || tick(s)) return NULL;
    return stepper_values(s);
}

EXPORT void stepper_release(State *s) {
    int i;
    for (i = 0; i < s->table->registers; i++) clear(&s->registers[i]);
}
