#include "regime.hpp"

namespace lostmotion::model {

std::size_t Key::hash() const {
    // A sum of products that do not wait for one another, each with another odd number.
    std::uint64_t h = 0, factor = 0x9e3779b97f4a7c15u;
    for (const std::uint64_t word : std::bit_cast<std::array<std::uint64_t, sizeof(Key) / 8>>(*this)) {
        h += (word ^ (word >> 29)) * factor;
        factor += 0xc2b2ae3d27d4eb4eu;
    }
    return static_cast<std::size_t>(h ^ (h >> 32));
}

}  // namespace lostmotion::model
