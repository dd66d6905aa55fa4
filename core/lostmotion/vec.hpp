// Numbers that are reckoned with at once, as many as the instruction set holds in one register.
#pragma once

namespace lostmotion {

#ifdef __AVX__
inline constexpr int vec_width = 4;
#else
inline constexpr int vec_width = 2;
#endif
typedef double Vec __attribute__((vector_size(8 * vec_width)));
using Mask = decltype(Vec{} < Vec{});

inline Vec load(const double* from) {
    Vec v;
    __builtin_memcpy(&v, from, sizeof v);
    return v;
}
inline void store(Vec v, double* to) { __builtin_memcpy(to, &v, sizeof v); }
// A single number, with zeros behind it. (What is read in one piece after it was written in several halts the
// processor.)
inline void store_single(double value, double* to) {
    Vec v{};
    v[0] = value;
    store(v, to);
}
// Four numbers in as many registers as they need: the coupled states.
struct Quad {
    static constexpr int parts = 4 / vec_width;
    Vec part[parts];

    static Quad load(const double* from) {
        Quad q;
        for (int p = 0; p < parts; ++p) q.part[p] = lostmotion::load(from + p * vec_width);
        return q;
    }
    void store(double* to) const {
        for (int p = 0; p < parts; ++p) lostmotion::store(part[p], to + p * vec_width);
    }
    // The k-th number in every place.
    template <int k>
    Vec spread() const {
        const Vec v = part[k / vec_width];
        constexpr int at = k % vec_width;
#ifdef __AVX__
        return __builtin_shufflevector(v, v, at, at, at, at);
#else
        return __builtin_shufflevector(v, v, at, at);
#endif
    }
    friend Quad operator+(Quad a, const Quad& b) {
        for (int p = 0; p < parts; ++p) a.part[p] += b.part[p];
        return a;
    }
    friend Quad operator*(double a, Quad b) {
        for (int p = 0; p < parts; ++p) b.part[p] *= a;
        return b;
    }
};

inline Vec least(Vec a, Vec b) { return a < b ? a : b; }
inline Vec absolute(Vec a) { return a < -a ? -a : a; }
inline bool all(Mask m) {
    bool yes = true;
    for (int k = 0; k < vec_width; ++k) yes &= m[k] != 0;
    return yes;
}

}  // namespace lostmotion
