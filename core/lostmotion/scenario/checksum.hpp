// CRC-32 (ISO/IEC 3309, the one of zlib and PNG): files that are damaged on their way are told from those that are not.
#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>

namespace lostmotion {

class Checksum {
 public:
    void add(unsigned char byte) { rest_ = table[(rest_ ^ byte) & 0xffu] ^ (rest_ >> 8); }
    // As IEEE 754 doubles, lowest byte first, on every machine.
    void add(std::span<const double> numbers);
    void add(std::string_view text) {
        for (const char c : text) add(static_cast<unsigned char>(c));
    }
    std::uint32_t value() const { return ~rest_; }

 private:
    static constexpr std::array<std::uint32_t, 256> table = [] {
        std::array<std::uint32_t, 256> t{};
        for (std::uint32_t n = 0; n < 256; ++n) {
            t[n] = n;
            for (int bit = 0; bit < 8; ++bit) t[n] = (t[n] >> 1) ^ (t[n] & 1u ? 0xedb88320u : 0u);
        }
        return t;
    }();
    std::uint32_t rest_ = 0xffffffffu;
};

}  // namespace lostmotion
