// What run.cpp needs of libc++'s object files, so that they need not be compiled for WebAssembly: that takes a minute.
#include <cstdio>
#include <cstdlib>
#include <new>
#include <string>

template class std::basic_string<char>;

void* operator new(std::size_t n) { return std::malloc(n); }
void* operator new(std::size_t n, std::align_val_t alignment) {
    const auto a = static_cast<std::size_t>(alignment);
    return std::aligned_alloc(a, (n + a - 1) / a * a);
}
void operator delete(void* p) noexcept { std::free(p); }
void operator delete(void* p, std::size_t) noexcept { std::free(p); }
void operator delete(void* p, std::align_val_t) noexcept { std::free(p); }
void operator delete(void* p, std::size_t, std::align_val_t) noexcept { std::free(p); }

_LIBCPP_BEGIN_NAMESPACE_STD

void __libcpp_verbose_abort(const char*, ...) noexcept { std::abort(); }

template <class Number>
static string printed(const char* format, Number value) {
    char text[400];
    return {text, text + std::snprintf(text, sizeof text, format, value)};
}
string to_string(double value) { return printed("%f", value); }
string to_string(int value) { return printed("%d", value); }
string to_string(unsigned long value) { return printed("%lu", value); }

_LIBCPP_END_NAMESPACE_STD
