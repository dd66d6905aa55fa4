// Tells which builds of the core this processor can run. A module of its own, compiled for any processor.
#include <nanobind/nanobind.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>
#if defined(__x86_64__) || defined(_M_X64)
#include <cpuid.h>
#endif

namespace {

struct Vectors {
    bool avx2 = false, avx512 = false;
};

// The processor has the instructions, and the operating system keeps their registers. Bits: Intel 64 and IA-32
// Architectures Software Developer's Manual, volume 2, CPUID, and volume 1, 13.3 (XCR0). Not __builtin_cpu_supports,
// which takes a library that not every compiler brings.
Vectors vectors() {
    Vectors v;
#if defined(__x86_64__) || defined(_M_X64)
    constexpr unsigned saves_registers = 1u << 27, ymm = 0x06, zmm = 0xe6;
    constexpr unsigned avx2 = 1u << 5, avx512f = 1u << 16, avx512dq = 1u << 17, avx512vl = 1u << 31;
    unsigned a = 0, b = 0, c = 0, d = 0;
    if (!__get_cpuid(1, &a, &b, &c, &d) || (c & saves_registers) == 0) return v;
    unsigned kept = 0, high = 0;
    __asm__ volatile("xgetbv" : "=a"(kept), "=d"(high) : "c"(0));
    if (!__get_cpuid_count(7, 0, &a, &b, &c, &d)) return v;
    constexpr unsigned wide = avx512f | avx512dq | avx512vl;
    v.avx2 = (kept & ymm) == ymm && (b & avx2) != 0;
    v.avx512 = v.avx2 && (kept & zmm) == zmm && (b & wide) == wide;
#endif
    return v;
}

}  // namespace

NB_MODULE(_instruction_set, m) {
    m.def(
        "builds",
        [] {
            const Vectors v = vectors();
            std::vector<std::string> names;
            if (v.avx512) names.emplace_back("avx512");
            if (v.avx2) names.emplace_back("avx2");
            names.emplace_back("any");
            return names;
        },
        "Names of the builds of the core that processor and system can run, the widest vectors first.");
}
