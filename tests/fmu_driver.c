/* Steps an FMU of FMI 2.0 for Co-Simulation through its library, and prints the bits of all outputs after each step.
 *
 *     fmu_driver LIBRARY RESOURCES_URI GUID INPUTS OUTPUTS STEPS INTERVAL
 */
#include <inttypes.h>
#include <string.h>

#include "fmu_callbacks.h"

#if defined _WIN32
#include <windows.h>
static void* opened(const char* path) { return (void*)LoadLibraryA(path); }
static void* found(void* library, const char* name) { return (void*)GetProcAddress((HMODULE)library, name); }
#else
#include <dlfcn.h>
static void* opened(const char* path) { return dlopen(path, RTLD_NOW | RTLD_LOCAL); }
static void* found(void* library, const char* name) { return dlsym(library, name); }
#endif

enum { most = 64 };

int main(int count, char** given) {
    check(count == 8, "reading the arguments");
    const unsigned n_in = (unsigned)atoi(given[4]), n_out = (unsigned)atoi(given[5]);
    const int steps = atoi(given[6]);
    const double interval = strtod(given[7], NULL);
    check(n_in <= most && n_out <= most, "counting the variables");
    void* library = opened(given[1]);
    check(library != NULL, "opening the library");
#define FUNCTION(NAME, RESULT, ...)                                       \
    RESULT (*NAME)(__VA_ARGS__) = (RESULT (*)(__VA_ARGS__))found(library, "fmi2" #NAME); \
    check(NAME != NULL, #NAME)
    FUNCTION(Instantiate, void*, const char*, int, const char*, const char*, const Callbacks*, int, int);
    FUNCTION(SetupExperiment, int, void*, int, double, double, int, double);
    FUNCTION(EnterInitializationMode, int, void*);
    FUNCTION(ExitInitializationMode, int, void*);
    FUNCTION(SetReal, int, void*, const unsigned*, size_t, const double*);
    FUNCTION(GetReal, int, void*, const unsigned*, size_t, double*);
    FUNCTION(SetRealInputDerivatives, int, void*, const unsigned*, size_t, const int*, const double*);
    FUNCTION(DoStep, int, void*, double, double, int);
    FUNCTION(FreeInstance, void, void*);
    const Callbacks callbacks = {say, calloc, free, NULL, NULL};
    void* drive = Instantiate("drive", 1, given[3], given[2], &callbacks, 0, 0);
    check(drive != NULL, "instantiating");
    check(SetupExperiment(drive, 0, 0.0, 0.0, 0, 0.0) == 0, "setting up");
    check(EnterInitializationMode(drive) == 0 && ExitInitializationMode(drive) == 0, "initialising");
    unsigned inputs[most], outputs[most];
    int orders[most];
    double value[most], rate[most], read[most];
    for (unsigned k = 0; k < n_in; ++k) {
        inputs[k] = 1000 + k;
        orders[k] = 1;
    }
    for (unsigned k = 0; k < n_out; ++k) outputs[k] = 3000 + k;
    for (int s = 0; s < steps; ++s) {
        for (unsigned k = 0; k < n_in; ++k) {
            value[k] = 0.0625 * (double)((s + (int)k) % 7 - 3);
            rate[k] = 8.0 * (double)(s % 3 - 1);
        }
        check(SetReal(drive, inputs, n_in, value) == 0, "setting the inputs");
        check(SetRealInputDerivatives(drive, inputs, n_in, orders, rate) == 0, "setting the input derivatives");
        check(DoStep(drive, (double)s * interval, interval, 1) == 0, "stepping");
        check(GetReal(drive, outputs, n_out, read) == 0, "reading the outputs");
        for (unsigned k = 0; k < n_out; ++k) {
            uint64_t bits;
            memcpy(&bits, &read[k], sizeof bits);
            printf("%016" PRIx64 "%c", bits, k + 1 < n_out ? ' ' : '\n');
        }
    }
    FreeInstance(drive);
    return 0;
}
