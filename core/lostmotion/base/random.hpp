// Random numbers by their place in a sequence, so that each can be had without those before it: Philox 4x32-10
// (Salmon et al. 2011, "Parallel random numbers: as easy as 1, 2, 3").
#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <numbers>

#include "logarithm.hpp"
#include "sine.hpp"

namespace lostmotion {

using RandomBlock = std::array<std::uint32_t, 4>;

inline RandomBlock philox(RandomBlock counter, std::uint64_t key) {
    auto low = static_cast<std::uint32_t>(key), high = static_cast<std::uint32_t>(key >> 32);
    for (int round = 0; round < 10; ++round) {
        const std::uint64_t a = std::uint64_t{0xD2511F53} * counter[0], b = std::uint64_t{0xCD9E8D57} * counter[2];
        counter = {static_cast<std::uint32_t>(b >> 32) ^ counter[1] ^ low, static_cast<std::uint32_t>(b),
                   static_cast<std::uint32_t>(a >> 32) ^ counter[3] ^ high, static_cast<std::uint32_t>(a)};
        low += 0x9E3779B9;
        high += 0xBB67AE85;
    }
    return counter;
}

// Number n of a stream of a seed, normally distributed with mean 0 and deviation 1 (Box and Muller 1958).
inline double normal(std::uint64_t seed, std::uint32_t stream, std::uint64_t n) {
    const auto r = philox({static_cast<std::uint32_t>(n), static_cast<std::uint32_t>(n >> 32), stream, 0}, seed);
    // 53 bits each, in the middle of its step: never 0.
    const auto share = [](std::uint32_t high, std::uint32_t low) {
        const std::uint64_t bits = (std::uint64_t{high} << 21) | (low >> 11);
        return (static_cast<double>(bits) + 0.5) * 0x1p-53;
    };
    return std::sqrt(-2.0 * logarithm(share(r[0], r[1]))) * sine_cosine(2.0 * std::numbers::pi * share(r[2], r[3])).cos;
}

}  // namespace lostmotion
