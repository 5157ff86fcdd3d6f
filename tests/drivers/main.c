/* driver states | arguments | logs | random SEED COUNT | corrupted SEED COUNT
 *      | fault TYPE VALUE | memory ROUNDS INSTANCES | threads COUNT
 *
 * Prints how many checks were made; the exit code is 1 if one failed.
 */
#include "fmu.h"

int main(int count, char **argument) {
    const char *what = count > 1 ? argument[1] : "";
    double first = count > 2 ? atof(argument[2]) : 0.0, second = count > 3 ? atof(argument[3]) : 0.0;
    if (!strcmp(what, "states")) states();
    else if (!strcmp(what, "arguments")) arguments();
    else if (!strcmp(what, "logs")) logs();
    else if (!strcmp(what, "random")) random_runs((uint64_t)first, (int)second);
    else if (!strcmp(what, "corrupted")) corrupted((uint64_t)first, (int)second);
    else if (!strcmp(what, "fault")) fault((fmi2Type)(int)first, second);
    else if (!strcmp(what, "memory")) memory((int)first, (int)second);
    else if (!strcmp(what, "threads")) threads((int)first);
    else {
        fprintf(stderr, "driver: no program '%s'\n", what);
        return 2;
    }
    printf("%ld checks, %ld failed\n", checks, failures);
    return failures != 0;
}
