#include "checksum.hpp"

namespace lostmotion {

void Checksum::add(std::span<const double> numbers) {
    for (const double v : numbers)
        for (auto bits = std::bit_cast<std::uint64_t>(v), k = std::uint64_t{0}; k < 8; ++k, bits >>= 8)
            add(static_cast<unsigned char>(bits & 0xffu));
}

}  // namespace lostmotion
