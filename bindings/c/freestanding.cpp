// What the C library needs of libc++'s object files where it is built by the Zig compiler, so that they need not be
// compiled and linked: that takes minutes.
#include <cstdlib>
#include <new>
#include <string>

#include "lostmotion/base/decimal.hpp"

void* operator new(std::size_t n) {
    void* p = std::malloc(n == 0 ? 1 : n);
    if (p == nullptr) __builtin_trap();
    return p;
}
void* operator new(std::size_t n, const std::nothrow_t&) noexcept { return std::malloc(n == 0 ? 1 : n); }
void* operator new(std::size_t n, std::align_val_t alignment) {
    // The address that malloc gave stands before the place.
    const auto a = static_cast<std::size_t>(alignment);
    auto* p = static_cast<char*>(operator new(n + a + sizeof(void*)));
    auto* place = reinterpret_cast<char*>((reinterpret_cast<std::size_t>(p) + sizeof(void*) + a - 1) / a * a);
    reinterpret_cast<void**>(place)[-1] = p;
    return place;
}
void operator delete(void* p) noexcept { std::free(p); }
void operator delete(void* p, std::size_t) noexcept { std::free(p); }
void operator delete(void* p, std::align_val_t) noexcept {
    if (p != nullptr) std::free(static_cast<void**>(p)[-1]);
}
void operator delete(void* p, std::size_t, std::align_val_t a) noexcept { operator delete(p, a); }
void* operator new[](std::size_t n) { return operator new(n); }
void operator delete[](void* p) noexcept { operator delete(p); }
void operator delete[](void* p, std::size_t) noexcept { operator delete(p); }
void* operator new[](std::size_t n, std::align_val_t alignment) { return operator new(n, alignment); }
void operator delete[](void* p, std::align_val_t a) noexcept { operator delete(p, a); }
void operator delete[](void* p, std::size_t, std::align_val_t a) noexcept { operator delete(p, a); }

namespace std {
const nothrow_t nothrow = nothrow_t();
}

_LIBCPP_BEGIN_NAMESPACE_STD

void __libcpp_verbose_abort(const char*, ...) noexcept { __builtin_trap(); }

template class basic_string<char>;
template string operator+(const char*, const string&);

string to_string(unsigned long long value) {
    string digits;
    do digits.insert(digits.begin(), static_cast<char>('0' + value % 10));
    while (value /= 10);
    return digits;
}
string to_string(long long value) {
    const auto bits = static_cast<unsigned long long>(value);
    return value < 0 ? '-' + to_string(-bits) : to_string(bits);
}
string to_string(int value) { return to_string(static_cast<long long>(value)); }
string to_string(long value) { return to_string(static_cast<long long>(value)); }
string to_string(unsigned value) { return to_string(static_cast<unsigned long long>(value)); }
string to_string(unsigned long value) { return to_string(static_cast<unsigned long long>(value)); }
string to_string(double value) { return lostmotion::fixed_text(value); }

_LIBCPP_END_NAMESPACE_STD
