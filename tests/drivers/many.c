/* Many instances: memory after rounds of making and freeing, and instances in threads. */
#include <malloc.h>
#include <pthread.h>
#include <unistd.h>

#include "fmu.h"

static long resident(void) {
    long size = 0, pages = 0;
    FILE *file = fopen("/proc/self/statm", "r");
    if (!file || fscanf(file, "%ld %ld", &size, &pages) != 2) pages = -1;
    if (file) fclose(file);
    return pages * (sysconf(_SC_PAGESIZE) / 1024);
}

static void one_round(int instances) {
    Slave **slaves = (Slave **)calloc((size_t)instances, sizeof(Slave *));
    int k;
    if (!slaves) abort();
    for (k = 0; k < instances; k++) slaves[k] = make(k % 2 ? fmi2CoSimulation : fmi2ModelExchange);
    for (k = 0; k < instances; k++) play(slaves[k], (uint64_t)k + 1, 10);
    for (k = 0; k < instances; k++) release(slaves[k]);
    free(slaves);
}

/* Prints kB resident and bytes in use after each round. */
void memory(int rounds, int instances) {
    size_t settled = 0;
    int k;
    for (k = 0; k < rounds; k++) {
        one_round(instances);
        printf("round %d: %ld kB resident, %zu bytes in use\n", k + 1, resident(), mallinfo2().uordblks);
        if (k == 1) settled = mallinfo2().uordblks; /* stdio's buffer included */
        if (k > 1) CHECK(mallinfo2().uordblks == settled, "round %d: memory in use grew", k + 1);
    }
}

typedef struct {
    pthread_t thread;
    uint64_t seed, digest[2];
} Worker;

static void *work(void *argument) {
    Worker *worker = (Worker *)argument;
    int type, k;
    for (type = fmi2ModelExchange; type <= fmi2CoSimulation; type++) {
        Slave *pair[2];
        uint64_t digest = 0;
        for (k = 0; k < 2; k++) pair[k] = make((fmi2Type)type);
        for (k = 0; k < 2; k++) digest ^= play(pair[k], worker->seed + (uint64_t)k, 30) >> k;
        for (k = 0; k < 2; k++) release(pair[k]);
        worker->digest[type] = digest;
    }
    return NULL;
}

/* Each worker has instances of its own; at once they give what they give one after the other. */
void threads(int count) {
    Worker *workers = (Worker *)calloc((size_t)count, sizeof(Worker)), alone;
    int k;
    if (!workers) abort();
    for (k = 0; k < count; k++) workers[k].seed = 100u + (uint64_t)(k / 2); /* some do the same */
    for (k = 0; k < count; k++) pthread_create(&workers[k].thread, NULL, work, &workers[k]);
    for (k = 0; k < count; k++) pthread_join(workers[k].thread, NULL);
    for (k = 0; k < count; k++) {
        alone.seed = workers[k].seed;
        work(&alone);
        CHECK(!memcmp(alone.digest, workers[k].digest, sizeof alone.digest), "thread %d differs from a serial run", k);
    }
    free(workers);
}
