// What WebAssembly needs of a C library beside Zig's compiler_rt: compiling a whole one takes half a minute.
#include <cstddef>
#include <cstdint>
#include <cstring>

// No function may become a call of itself.
#define LIBRARY extern "C" [[clang::no_builtin]]

// The module begins; it never ends.
extern "C" void __wasm_call_ctors();
LIBRARY [[clang::export_name("_initialize")]] void _initialize() { __wasm_call_ctors(); }
LIBRARY int __cxa_atexit(void (*)(void*), void*, void*) { return 0; }

// A block has a power of two of bytes, of which the first 16 tell which; a free one, after these, where the next is.
extern "C" unsigned char __heap_base;
static constexpr std::size_t head = 16, page = 1 << 16;
static constexpr int most = 31;
static unsigned char* free_blocks[most + 1];
static std::size_t end_of_blocks = 0;

LIBRARY void* malloc(std::size_t n) {
    if (n > (std::size_t{1} << most) - head) return nullptr;
    const int power = n <= head ? 5 : 32 - __builtin_clz(n + head - 1);
    unsigned char* block = free_blocks[power];
    if (block != nullptr) {
        std::memcpy(&free_blocks[power], block + head, sizeof block);
        return block + head;
    }
    if (end_of_blocks == 0) end_of_blocks = (reinterpret_cast<std::size_t>(&__heap_base) + head - 1) / head * head;
    const std::size_t size = std::size_t{1} << power, there = __builtin_wasm_memory_size(0),
                      needed = end_of_blocks / page + size / page + 2;
    if (needed > there && (needed > page || __builtin_wasm_memory_grow(0, needed - there) > page)) return nullptr;
    block = reinterpret_cast<unsigned char*>(end_of_blocks);
    end_of_blocks += size;
    std::memcpy(block, &power, sizeof power);
    return block + head;
}
LIBRARY void free(void* p) {
    if (p == nullptr) return;
    unsigned char* const block = static_cast<unsigned char*>(p) - head;
    int power = 0;
    std::memcpy(&power, block, sizeof power);
    std::memcpy(block + head, &free_blocks[power], sizeof block);
    free_blocks[power] = block;
}

LIBRARY void* calloc(std::size_t n, std::size_t size) {
    void* p = size != 0 && n > SIZE_MAX / size ? nullptr : malloc(n * size);
    return p == nullptr ? p : std::memset(p, 0, n * size);
}

LIBRARY void* memchr(const void* from, int byte, std::size_t n) {
    for (auto p = static_cast<const unsigned char*>(from); n > 0; ++p, --n)
        if (*p == static_cast<unsigned char>(byte)) return const_cast<unsigned char*>(p);
    return nullptr;
}
LIBRARY wchar_t* wmemchr(const wchar_t* p, wchar_t wanted, std::size_t n) {
    for (; n > 0; ++p, --n)
        if (*p == wanted) return const_cast<wchar_t*>(p);
    return nullptr;
}

static std::uint64_t bits_of(double v) { return __builtin_bit_cast(std::uint64_t, v); }
static double of_bits(std::uint64_t bits) { return __builtin_bit_cast(double, bits); }
static int exponent_of(double v) { return static_cast<int>(bits_of(v) >> 52 & 0x7ff); }

LIBRARY double ldexp(double v, int exponent) {
    // Each step is exact but the last, which rounds.
    for (; exponent > 1023; exponent -= 1023) v *= 0x1p1023;
    for (; exponent < -1022; exponent += 969)
        if ((v *= 0x1p-969) == 0.0) return v;
    return v * of_bits(static_cast<std::uint64_t>(exponent + 1023) << 52);
}
LIBRARY double frexp(double v, int* exponent) {
    *exponent = 0;
    if (v == 0.0 || exponent_of(v) == 0x7ff) return v;
    if (exponent_of(v) == 0) {
        v *= 0x1p54;
        *exponent = -54;
    }
    *exponent += exponent_of(v) - 1022;
    return of_bits((bits_of(v) & ~(0x7ffULL << 52)) | 1022ULL << 52);
}
LIBRARY double nextafter(double from, double to) {
    if (from != from || to != to) return from + to;
    if (from == to) return to;
    if (from == 0.0) return __builtin_copysign(0x1p-1074, to);
    return of_bits(bits_of(from) + ((from < to) == (from > 0.0) ? 1 : -1));
}
