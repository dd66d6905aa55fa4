// Tells which build of the core suits this processor. A module of its own, compiled for any processor.
#include <nanobind/nanobind.h>

NB_MODULE(_instruction_set, m) {
    m.def(
        "supports_avx2",
        [] {
#if defined(__x86_64__) || defined(_M_X64)
            return __builtin_cpu_supports("avx2") != 0;
#else
            return false;
#endif
        },
        "Whether processor and system can run the build of the core for AVX2.");
}
