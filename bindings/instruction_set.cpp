// Tells which builds of the core this processor can run. A module of its own, compiled for any processor.
#include <nanobind/nanobind.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

NB_MODULE(_instruction_set, m) {
    m.def(
        "builds",
        [] {
            std::vector<std::string> names;
#if defined(__x86_64__) || defined(_M_X64)
            if (__builtin_cpu_supports("avx512dq") && __builtin_cpu_supports("avx512vl")) names.emplace_back("avx512");
            if (__builtin_cpu_supports("avx2")) names.emplace_back("avx2");
#endif
            names.emplace_back("any");
            return names;
        },
        "Names of the builds of the core that processor and system can run, the widest vectors first.");
}
