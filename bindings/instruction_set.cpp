// Tells which builds of the core this processor can run. A module of its own, compiled for any processor.
#include <nanobind/nanobind.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>
#if defined(__x86_64__) || defined(_M_X64)
#include <cpuid.h>
#endif

namespace {

// The processor has the instructions, and the operating system keeps their registers. Bits: Intel 64 and IA-32
// Architectures Software Developer's Manual, volume 2, CPUID, and volume 1, 13.3 (XCR0). Not __builtin_cpu_supports,
// which takes a library that not every compiler brings.
bool has_avx2() {
#if defined(__x86_64__) || defined(_M_X64)
    constexpr unsigned saves_registers = 1u << 27, ymm = 0x06, avx2 = 1u << 5;
    unsigned a = 0, b = 0, c = 0, d = 0;
    if (!__get_cpuid(1, &a, &b, &c, &d) || (c & saves_registers) == 0) return false;
    unsigned kept = 0, high = 0;
    __asm__ volatile("xgetbv" : "=a"(kept), "=d"(high) : "c"(0));
    if (!__get_cpuid_count(7, 0, &a, &b, &c, &d)) return false;
    return (kept & ymm) == ymm && (b & avx2) != 0;
#else
    return false;
#endif
}

}  // namespace

NB_MODULE(_instruction_set, m) {
    m.def(
        "builds",
        [] {
            std::vector<std::string> names;
            if (has_avx2()) names.emplace_back("avx2");
            names.emplace_back("any");
            return names;
        },
        "Names of the builds of the core that processor and system can run, the widest vectors first.");
}
