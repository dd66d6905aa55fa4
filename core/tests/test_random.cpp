// Random numbers by their place in a sequence, and the logarithm that normal ones are made with.
#include <doctest/doctest.h>
#include <quadmath.h>

#include "lostmotion/base/random.hpp"

TEST_SUITE_BEGIN("random");

namespace lostmotion {

TEST_CASE("Philox gives the known answers that its authors publish") {
    constexpr std::uint32_t all = 0xFFFFFFFF;
    CHECK(philox({0, 0, 0, 0}, 0) == RandomBlock{0x6627E8D5, 0xE169C58D, 0xBC57AC4C, 0x9B00DBD8});
    CHECK(philox({all, all, all, all}, 0xFFFFFFFFFFFFFFFF) ==
          RandomBlock{0x408F276D, 0x41C83B0E, 0xA20BC7C6, 0x6D5451FD});
    CHECK(philox({0x243F6A88, 0x85A308D3, 0x13198A2E, 0x03707344}, 0x299F31D0A4093822) ==
          RandomBlock{0xD16CFE09, 0x94FDCCEB, 0x5001E420, 0x24126EA1});
}

TEST_CASE("the logarithm is that of quadruple precision to two units in the last place") {
    double worst = 0.0;
    for (std::uint64_t n = 0; n < 300000; ++n) {
        const RandomBlock r = philox({static_cast<std::uint32_t>(n), 0, 0, 0}, 1);
        const double x = std::ldexp(r[0] + 0.5, static_cast<int>(r[1] % (n % 2 == 0 ? 3 : 2000)) - 1000);
        const __float128 exact = logq(x);
        const double near = std::fabs(static_cast<double>(exact));
        const double unit = std::nextafter(near, 1e300) - near;
        worst = std::fmax(worst, std::fabs(static_cast<double>(logarithm(x) - exact)) / unit);
    }
    CHECK(worst < 2.0);
    CHECK(logarithm(1.0) == 0.0);
}

}  // namespace lostmotion

TEST_SUITE_END();
