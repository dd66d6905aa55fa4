#define DOCTEST_CONFIG_IMPLEMENT_WITH_MAIN
#include <doctest/doctest.h>

// Where the address sanitizer is: the tests take an eighth less time if it neither remembers where memory was allocated
// nor fills it. ASAN_OPTIONS=malloc_context_size=30 says more of what it has found.
extern "C" const char* __asan_default_options();
extern "C" const char* __asan_default_options() {
    return "malloc_context_size=0:max_malloc_fill_size=0:quarantine_size_mb=16:thread_local_quarantine_size_kb=64";
}
