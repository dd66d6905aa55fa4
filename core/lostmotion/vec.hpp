// Numbers that are reckoned with at once, as many as the instruction set holds in one register.
#pragma once

#ifdef __SSE2__
#include <immintrin.h>
#endif

namespace lostmotion {

template <int n>
struct VecOf {
    typedef double Type __attribute__((vector_size(8 * n)));
};

#if defined __AVX512DQ__ && defined __AVX512VL__
inline constexpr int vec_width = 8;
#elif defined __AVX__
inline constexpr int vec_width = 4;
#else
inline constexpr int vec_width = 2;
#endif
using Vec = VecOf<vec_width>::Type;
using Mask = decltype(Vec{} < Vec{});

template <class V = Vec>
V load(const double* from) {
    V v;
    __builtin_memcpy(&v, from, sizeof v);
    return v;
}
template <class V>
void store(V v, double* to) {
    __builtin_memcpy(to, &v, sizeof v);
}
// Four numbers in as many registers as they need: the coupled states.
struct Quad {
    static constexpr int width = vec_width < 4 ? vec_width : 4, parts = 4 / width;
    using Part = VecOf<width>::Type;
    Part part[parts];

    static Quad load(const double* from) {
        Quad q;
        for (int p = 0; p < parts; ++p) q.part[p] = lostmotion::load<Part>(from + p * width);
        return q;
    }
    void store(double* to) const {
        for (int p = 0; p < parts; ++p) lostmotion::store(part[p], to + p * width);
    }
    double operator[](int k) const { return part[k / width][k % width]; }
    // The k-th number in every place.
    template <int k>
    Part spread() const {
        const Part v = part[k / width];
        constexpr int at = k % width;
        if constexpr (width == 4)
            return __builtin_shufflevector(v, v, at, at, at, at);
        else
            return __builtin_shufflevector(v, v, at, at);
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
// A single number, with zeros behind it. (What is read in one piece after it was written in several halts the
// processor.)
inline void store_single(double value, double* to) {
    Quad::Part v{};
    v[0] = value;
    store(v, to);
}

inline Vec least(Vec a, Vec b) { return a < b ? a : b; }
template <class V>
V absolute(V a) {
    return a < -a ? -a : a;
}
// One bit for each number, the first lowest.
inline unsigned bits(Mask m) {
#if defined __AVX512DQ__ && defined __AVX512VL__
    return _mm512_movepi64_mask((__m512i)m);
#elif defined __AVX__
    return static_cast<unsigned>(_mm256_movemask_pd((__m256d)m));
#elif defined __SSE2__
    return static_cast<unsigned>(_mm_movemask_pd((__m128d)m));
#else
    unsigned out = 0;
    for (int k = 0; k < vec_width; ++k) out |= m[k] != 0 ? 1u << k : 0u;
    return out;
#endif
}
inline bool all(Mask m) { return bits(m) == (1u << vec_width) - 1; }

}  // namespace lostmotion
