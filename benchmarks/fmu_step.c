/* Time of a step of 1 ms, by the C interface and by the FMU over it: prints both [us], each the best of ROUNDS.
 *
 *     fmu_step FMU_LIBRARY RESOURCES_URI GUID C_LIBRARY DESCRIPTION
 *
 * The same steps: inputs that run in straight lines, nothing read.
 */
#define _POSIX_C_SOURCE 200809L
#include <dlfcn.h>
#include <time.h>

#include "../tests/fmu_callbacks.h"

enum { STEPS = 20000, ROUNDS = 9, most = 16 };
static const double interval = 1e-3;

static double now(void) {
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec * 1e6 + (double)t.tv_nsec * 1e-3;
}
/* The corners of the command: a triangle of 1 Hz that makes the drive reverse. The other inputs stay 0. */
static double corner(int step) {
    const int k = step % 1000;
    return 1e-3 * (double)(k < 250 ? k : k < 750 ? 500 - k : k - 1000);
}

#define FUNCTION(LIBRARY, PREFIX, NAME, RESULT, ...)                                             \
    RESULT (*NAME)(__VA_ARGS__) = (RESULT (*)(__VA_ARGS__))dlsym(LIBRARY, PREFIX #NAME); \
    check(NAME != NULL, #NAME)

static double by_fmu(void* library, const char* resources, const char* guid) {
    FUNCTION(library, "fmi2", Instantiate, void*, const char*, int, const char*, const char*, const Callbacks*, int, int);
    FUNCTION(library, "fmi2", SetupExperiment, int, void*, int, double, double, int, double);
    FUNCTION(library, "fmi2", EnterInitializationMode, int, void*);
    FUNCTION(library, "fmi2", ExitInitializationMode, int, void*);
    FUNCTION(library, "fmi2", SetReal, int, void*, const unsigned*, size_t, const double*);
    FUNCTION(library, "fmi2", SetRealInputDerivatives, int, void*, const unsigned*, size_t, const int*, const double*);
    FUNCTION(library, "fmi2", DoStep, int, void*, double, double, int);
    FUNCTION(library, "fmi2", FreeInstance, void, void*);
    const Callbacks callbacks = {say, calloc, free, NULL, NULL};
    const unsigned command = 1000;
    const int order = 1;
    void* drive = Instantiate("drive", 1, guid, resources, &callbacks, 0, 0);
    check(drive != NULL && SetupExperiment(drive, 0, 0.0, 0.0, 0, 0.0) == 0, "instantiating");
    check(EnterInitializationMode(drive) == 0 && ExitInitializationMode(drive) == 0, "initialising");
    const double begin = now();
    for (int s = 0; s < STEPS; ++s) {
        const double value = corner(s), rate = (corner(s + 1) - value) / interval;
        check(SetReal(drive, &command, 1, &value) == 0 &&
                  SetRealInputDerivatives(drive, &command, 1, &order, &rate) == 0 &&
                  DoStep(drive, s * interval, interval, 1) == 0,
              "a step of the FMU");
    }
    const double us = (now() - begin) / STEPS;
    FreeInstance(drive);
    return us;
}

static double by_core(void* library, const char* path) {
    FUNCTION(library, "lm_", scenario_read, void*, const double*, size_t, char*, size_t);
    FUNCTION(library, "lm_", scenario_free, void, void*);
    FUNCTION(library, "lm_", simulation_from, void*, void*, double);
    FUNCTION(library, "lm_", simulation_free, void, void*);
    FUNCTION(library, "lm_", advance, int, void*, double, const double*, const double*);
    static double numbers[1 << 16];
    FILE* file = fopen(path, "rb");
    check(file != NULL, "opening the description");
    const size_t n = fread(numbers, sizeof *numbers, sizeof numbers / sizeof *numbers, file);
    fclose(file);
    void* scenario = scenario_read(numbers, n, NULL, 0);
    check(scenario != NULL, "reading the description");
    void* simulation = simulation_from(scenario, interval);
    check(simulation != NULL, "making the simulation");
    double first[most] = {0}, last[most] = {0};
    const double begin = now();
    for (int s = 0; s < STEPS; ++s) {
        first[0] = corner(s);
        last[0] = corner(s + 1);
        check(advance(simulation, interval, first, last) == 0, "a step of the core");
    }
    const double us = (now() - begin) / STEPS;
    simulation_free(simulation);
    scenario_free(scenario);
    return us;
}

int main(int count, char** given) {
    check(count == 6, "reading the arguments");
    void *fmu = dlopen(given[1], RTLD_NOW | RTLD_LOCAL), *core = dlopen(given[4], RTLD_NOW | RTLD_LOCAL);
    check(fmu != NULL && core != NULL, "opening the libraries");
    double best_fmu = 1e9, best_core = 1e9;
    for (int k = 0; k < ROUNDS; ++k) {
        const double a = by_core(core, given[5]), b = by_fmu(fmu, given[2], given[3]);
        if (a < best_core) best_core = a;
        if (b < best_fmu) best_fmu = b;
    }
    printf("%.4f %.4f\n", best_core, best_fmu);
    return 0;
}
