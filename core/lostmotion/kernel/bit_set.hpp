// Sets of numbers below N, as bits.
#pragma once

#include <array>
#include <bit>
#include <cstdint>

namespace lostmotion {

template <int N>
class BitSet {
 public:
    static BitSet below(int count) {
        BitSet out;
        for (int w = 0; w < words && count > 64 * w; ++w)
            out.word_[w] = count - 64 * w >= 64 ? ~std::uint64_t{0} : (std::uint64_t{1} << (count - 64 * w)) - 1;
        return out;
    }
    void set(int k) { word_[k / 64] |= std::uint64_t{1} << k % 64; }
    // Those of the lowest bits that are set, from the k-th number on; a word holds them all.
    void set(int k, unsigned bits) { word_[k / 64] |= std::uint64_t{bits} << k % 64; }
    bool operator[](int k) const { return (word_[k / 64] >> k % 64 & 1) != 0; }
    bool empty() const {
        std::uint64_t all = 0;
        for (const std::uint64_t w : word_) all |= w;
        return all == 0;
    }
    BitSet& operator|=(const BitSet& o) {
        for (int w = 0; w < words; ++w) word_[w] |= o.word_[w];
        return *this;
    }
    friend BitSet operator|(BitSet a, const BitSet& b) { return a |= b; }
    BitSet& operator-=(const BitSet& o) {
        for (int w = 0; w < words; ++w) word_[w] &= ~o.word_[w];
        return *this;
    }
    friend BitSet operator-(BitSet a, const BitSet& b) { return a -= b; }
    bool operator==(const BitSet&) const = default;
    // Calls use(k) for each, in their order. Where it returns a truth value, a false one ends that.
    template <class Use>
    void each(Use&& use) const {
        for (int w = 0; w < words; ++w)
            for (std::uint64_t left = word_[w]; left != 0; left &= left - 1) {
                const int k = 64 * w + std::countr_zero(left);
                if constexpr (requires { static_cast<bool>(use(k)); }) {
                    if (!use(k)) return;
                } else {
                    use(k);
                }
            }
    }

 private:
    static constexpr int words = (N + 63) / 64;
    std::array<std::uint64_t, words> word_{};
};

}  // namespace lostmotion
