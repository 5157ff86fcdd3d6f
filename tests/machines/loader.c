/* Load an FMI 2.0 library and do what a scenario says, one command a line.
 *
 *     loader LIBRARY GUID TYPE SCENARIO        TYPE as in fmi2Type: 1 is co-simulation
 *
 *     setup START STOP | enter | exit | terminate | reset
 *     set real|integer|boolean VR VALUE
 *     get real|integer|boolean VR VR ...       prints the values in one line
 *     step TIME SIZE
 *     save | load                              the state, as bytes
 *
 * Reals are written and read as the 16 hexadecimal digits of their 64 bits: every machine and
 * every C library writes the same number the same way. The exit code is 0 only if each function
 * returned fmi2OK; else the line and the function are named on standard error.
 */
#include <inttypes.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "fmi2FunctionTypes.h"

#ifdef _WIN32
#include <windows.h>
#define OPEN(path) ((void *)LoadLibraryA(path))
#define FIND(library, name) ((void *)GetProcAddress((HMODULE)(library), name))
#define CLOSE(library) (!FreeLibrary((HMODULE)(library)))
#else
#include <dlfcn.h>
#define OPEN(path) dlopen(path, RTLD_NOW | RTLD_LOCAL)
#define FIND(library, name) dlsym(library, name)
#define CLOSE(library) dlclose(library)
#endif

/* Every function the scenarios use: fmi2.GetReal(...) and so on. */
#define FUNCTIONS(DO) \
    DO(GetTypesPlatform) DO(GetVersion) DO(Instantiate) DO(FreeInstance) DO(SetupExperiment) \
    DO(EnterInitializationMode) DO(ExitInitializationMode) DO(Terminate) DO(Reset) \
    DO(GetReal) DO(GetInteger) DO(GetBoolean) DO(SetReal) DO(SetInteger) DO(SetBoolean) \
    DO(GetFMUstate) DO(SetFMUstate) DO(FreeFMUstate) DO(SerializedFMUstateSize) \
    DO(SerializeFMUstate) DO(DeSerializeFMUstate) DO(DoStep)

#define MEMBER(name) fmi2##name##TYPE *name;
static struct { FUNCTIONS(MEMBER) } fmi2;

static void *library;
static fmi2Component fmu;
static fmi2Byte *bytes; /* the saved state */
static size_t size;
static int line_number;

__attribute__((noreturn)) static void fail(const char *what) {
    fprintf(stderr, "loader: line %d: %s\n", line_number, what);
    exit(1);
}

#define CALL(function, ...) \
    do { if (fmi2.function(fmu, __VA_ARGS__) != fmi2OK) fail("fmi2" #function); } while (0)
#define CALL_ALONE(function) \
    do { if (fmi2.function(fmu) != fmi2OK) fail("fmi2" #function); } while (0)

static void logger(fmi2ComponentEnvironment environment, fmi2String name, fmi2Status status,
                   fmi2String category, fmi2String message, ...) {
    va_list arguments;
    (void)environment;
    fprintf(stderr, "%s: %s (%d): ", name, category, (int)status);
    va_start(arguments, message);
    vfprintf(stderr, message, arguments);
    va_end(arguments);
    fputc('\n', stderr);
}

static void open_library(const char *path) {
    library = OPEN(path);
    if (!library) {
#ifdef _WIN32
        fprintf(stderr, "loader: cannot load %s: error %lu\n", path, GetLastError());
#else
        fprintf(stderr, "loader: cannot load %s: %s\n", path, dlerror());
#endif
        exit(1);
    }
    /* By memcpy: C has no cast from a pointer to data to one to a function. */
#define FILL(name) { \
        void *found = FIND(library, "fmi2" #name); \
        if (!found) fail("the library lacks fmi2" #name); \
        memcpy(&fmi2.name, &found, sizeof found); \
    }
    FUNCTIONS(FILL)
}

static const char *word(void) {
    const char *next = strtok(NULL, " \r\n");
    if (!next) fail("the line is too short");
    return next;
}

static double real(const char *text) {
    uint64_t bits;
    double value;
    if (strlen(text) != 16 || sscanf(text, "%16" SCNx64, &bits) != 1) fail("a real has 16 digits");
    memcpy(&value, &bits, sizeof value);
    return value;
}

static void set(void) {
    const char *kind = word();
    fmi2ValueReference vr = (fmi2ValueReference)strtoul(word(), NULL, 10);
    if (!strcmp(kind, "real")) {
        fmi2Real value = real(word());
        CALL(SetReal, &vr, 1, &value);
    } else {
        fmi2Integer value = (fmi2Integer)strtol(word(), NULL, 10); /* fmi2Boolean is an int, too */
        if (!strcmp(kind, "integer")) CALL(SetInteger, &vr, 1, &value);
        else if (!strcmp(kind, "boolean")) CALL(SetBoolean, &vr, 1, &value);
        else fail("set what?");
    }
}

static void get(void) {
    const char *kind = word(), *text;
    printf("%s", kind);
    while ((text = strtok(NULL, " \r\n"))) {
        fmi2ValueReference vr = (fmi2ValueReference)strtoul(text, NULL, 10);
        if (!strcmp(kind, "real")) {
            fmi2Real value;
            uint64_t bits;
            CALL(GetReal, &vr, 1, &value);
            memcpy(&bits, &value, sizeof bits);
            printf(" %016" PRIx64, bits);
        } else {
            fmi2Integer value;
            if (!strcmp(kind, "integer")) CALL(GetInteger, &vr, 1, &value);
            else if (!strcmp(kind, "boolean")) CALL(GetBoolean, &vr, 1, &value);
            else fail("get what?");
            printf(" %d", value);
        }
    }
    printf("\n");
}

static void save(void) {
    fmi2FMUstate state = NULL;
    CALL(GetFMUstate, &state);
    CALL(SerializedFMUstateSize, state, &size);
    free(bytes);
    bytes = (fmi2Byte *)malloc(size);
    if (!bytes) fail("out of memory");
    CALL(SerializeFMUstate, state, bytes, size);
    CALL(FreeFMUstate, &state);
    if (state) fail("fmi2FreeFMUstate leaves a pointer behind");
}

static void load(void) {
    fmi2FMUstate state = NULL;
    if (!bytes) fail("load before save");
    CALL(DeSerializeFMUstate, bytes, size, &state);
    CALL(SetFMUstate, state);
    CALL(FreeFMUstate, &state);
}

static void obey(const char *command) {
    if (!strcmp(command, "set")) set();
    else if (!strcmp(command, "get")) get();
    else if (!strcmp(command, "save")) save();
    else if (!strcmp(command, "load")) load();
    else if (!strcmp(command, "enter")) CALL_ALONE(EnterInitializationMode);
    else if (!strcmp(command, "exit")) CALL_ALONE(ExitInitializationMode);
    else if (!strcmp(command, "terminate")) CALL_ALONE(Terminate);
    else if (!strcmp(command, "reset")) CALL_ALONE(Reset);
    else if (!strcmp(command, "setup")) {
        double start = real(word()), stop = real(word());
        CALL(SetupExperiment, fmi2False, 0.0, start, fmi2True, stop);
    } else if (!strcmp(command, "step")) {
        double time = real(word()), step = real(word());
        CALL(DoStep, time, step, fmi2True);
    } else fail("unknown command");
}

int main(int count, char **argument) {
    const fmi2CallbackFunctions callbacks = {logger, calloc, free, NULL, NULL};
    static char line[65536];
    const char *command;
    FILE *scenario;
    if (count != 5) fail("usage: loader LIBRARY GUID TYPE SCENARIO");
    scenario = fopen(argument[4], "r");
    if (!scenario) fail("cannot read the scenario");
    open_library(argument[1]);
    printf("%s %s\n", fmi2.GetVersion(), fmi2.GetTypesPlatform());
    fmu = fmi2.Instantiate("loaded", (fmi2Type)atoi(argument[3]), argument[2], "", &callbacks,
                           fmi2False, fmi2True);
    if (!fmu) fail("fmi2Instantiate");
    while (fgets(line, sizeof line, scenario)) {
        line_number++;
        command = strtok(line, " \r\n");
        if (command) obey(command);
    }
    fclose(scenario);
    fmi2.FreeInstance(fmu);
    free(bytes);
    if (CLOSE(library)) fail("the library cannot be unloaded");
    return 0;
}
