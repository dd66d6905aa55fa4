// Sets of numbers below N, as bits.
#pragma once

#include <algorithm>
#include <bit>
#include <cstdint>
#include <type_traits>

namespace lostmotion {

// The words of a small set, and of a large one, which has them only as far as its highest number needs.
template <int n>
struct AllWords {
    std::uint64_t word[n]{};

    static constexpr int size() { return n; }
    static void reach(int) {}
};
template <int n>
struct FirstWords {
    std::uint64_t word[n];
    int used = 0;

    FirstWords() = default;
    FirstWords(const FirstWords& o) { *this = o; }
    FirstWords& operator=(const FirstWords& o) {
        used = o.used;
        std::copy_n(o.word, used, word);
        return *this;
    }
    int size() const { return used; }
    void reach(int w) {
        for (; used <= w; ++used) word[used] = 0;
    }
};

template <int N>
class BitSet {
 public:
    static BitSet below(int count) {
        BitSet out;
        for (int w = 0; w < words && count > 64 * w; ++w)
            out.word(w) = count - 64 * w >= 64 ? ~std::uint64_t{0} : (std::uint64_t{1} << (count - 64 * w)) - 1;
        return out;
    }
    void set(int k) { word(k / 64) |= std::uint64_t{1} << k % 64; }
    // Those of the lowest bits that are set, from the k-th number on; a word holds them all.
    void set(int k, unsigned bits) { word(k / 64) |= std::uint64_t{bits} << k % 64; }
    bool operator[](int k) const { return k / 64 < size() && (word(k / 64) >> k % 64 & 1) != 0; }
    bool empty() const {
        std::uint64_t all = 0;
        for (int w = 0; w < size(); ++w) all |= word(w);
        return all == 0;
    }
    BitSet& operator|=(const BitSet& o) {
        for (int w = 0; w < o.size(); ++w) word(w) |= o.word(w);
        return *this;
    }
    friend BitSet operator|(BitSet a, const BitSet& b) { return a |= b; }
    BitSet& operator-=(const BitSet& o) {
        for (int w = 0; w < std::min(size(), o.size()); ++w) word(w) &= ~o.word(w);
        return *this;
    }
    friend BitSet operator-(BitSet a, const BitSet& b) { return a -= b; }
    bool operator==(const BitSet& o) const { return (*this - o).empty() && (o - *this).empty(); }
    // Calls use(k) for each, in their order. Where it returns a truth value, a false one ends that.
    template <class Use>
    [[gnu::always_inline]] void each(Use&& use) const {
        for (int w = 0; w < size(); ++w)
            for (std::uint64_t left = word(w); left != 0; left &= left - 1) {
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

    int size() const { return words_.size(); }
    std::uint64_t word(int w) const { return words_.word[w]; }
    std::uint64_t& word(int w) {
        words_.reach(w);
        return words_.word[w];
    }

    std::conditional_t<words <= 4, AllWords<words>, FirstWords<words>> words_;
};

}  // namespace lostmotion
