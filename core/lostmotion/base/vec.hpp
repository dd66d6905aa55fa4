// Numbers that are computed with at once, as many as the instruction set holds in one register.
#pragma once

#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstring>
#include <type_traits>
#include <utility>

// Vectors are an extension of GCC and Clang. Other compilers take arrays, which have the same bits.
#if defined __GNUC__ && !defined LOSTMOTION_PLAIN_VECTORS
#define LOSTMOTION_VECTORS
#ifdef __SSE2__
#include <immintrin.h>
#endif
#endif

// On a lambda, where the attribute of the standard form would belong to the type of the function.
#if defined __GNUC__
#define ALWAYS_INLINE __attribute__((always_inline))
#else
#define ALWAYS_INLINE
#endif

namespace lostmotion {

#ifdef LOSTMOTION_VECTORS
template <int n>
struct VecOf {
    typedef double Type __attribute__((vector_size(8 * n)));
    typedef long long Bits __attribute__((vector_size(8 * n)));
};

template <class Bits, class V>
[[gnu::always_inline]] inline V chosen(Bits condition, V then, V otherwise) {
    return condition ? then : otherwise;
}
// The numbers of v, followed by those of w, at these indices.
template <int... at, class V>
[[gnu::always_inline]] inline V shuffled(V v, V w) {
    return __builtin_shufflevector(v, w, at...);
}
template <class V>
[[gnu::always_inline]] inline V magnitude_of(V v) {
    typedef long long Bits __attribute__((vector_size(sizeof(V))));
    return std::bit_cast<V>(std::bit_cast<Bits>(v) & 0x7fffffffffffffff);
}
#else
template <int n>
struct VecOf {
    struct Bits {
        bool bit[n];
    };
    struct Type {
        double number[n];

        double& operator[](int k) { return number[k]; }
        double operator[](int k) const { return number[k]; }
        template <class Act>
        static Type each(Act&& act) {
            Type out;
            for (int k = 0; k < n; ++k) out.number[k] = act(k);
            return out;
        }
        static Type all(double a) {
            return each([=](int) { return a; });
        }
        friend Type operator+(Type a, Type b) {
            return each([&](int k) { return a[k] + b[k]; });
        }
        friend Type operator-(Type a, Type b) {
            return each([&](int k) { return a[k] - b[k]; });
        }
        friend Type operator*(Type a, Type b) {
            return each([&](int k) { return a[k] * b[k]; });
        }
        friend Type operator/(Type a, Type b) {
            return each([&](int k) { return a[k] / b[k]; });
        }
        friend Type operator+(Type a, double b) { return a + all(b); }
        friend Type operator+(double a, Type b) { return all(a) + b; }
        friend Type operator-(Type a, double b) { return a - all(b); }
        friend Type operator-(double a, Type b) { return all(a) - b; }
        friend Type operator*(Type a, double b) { return a * all(b); }
        friend Type operator*(double a, Type b) { return all(a) * b; }
        friend Type operator/(Type a, double b) { return a / all(b); }
        friend Type operator/(double a, Type b) { return all(a) / b; }
        Type operator-() const {
            return each([this](int k) { return -number[k]; });
        }
        template <class Other>
        Type& operator+=(Other b) {
            return *this = *this + b;
        }
        template <class Other>
        Type& operator-=(Other b) {
            return *this = *this - b;
        }
        template <class Other>
        Type& operator*=(Other b) {
            return *this = *this * b;
        }
        friend Bits operator<(Type a, Type b) {
            Bits out;
            for (int k = 0; k < n; ++k) out.bit[k] = a[k] < b[k];
            return out;
        }
        friend Bits operator>(Type a, Type b) { return b < a; }
        friend Type chosen(Bits condition, Type then, Type otherwise) {
            return each([&](int k) { return condition.bit[k] ? then[k] : otherwise[k]; });
        }
        friend Type magnitude_of(Type v) {
            return each([&](int k) { return std::fabs(v[k]); });
        }
    };
};

template <int... at, class V>
inline V shuffled(V v, V w) {
    constexpr int n = sizeof...(at);
    const auto number = [&](int k) { return k < n ? v[k] : w[k - n]; };
    return {{number(at)...}};
}
#endif

#if defined LOSTMOTION_VECTORS && defined __AVX__
inline constexpr int vec_width = 4;
#else
inline constexpr int vec_width = 2;
#endif
using Vec = VecOf<vec_width>::Type;

template <class V = Vec>
[[gnu::always_inline]] inline V load(const double* from) {
    V v;
    std::memcpy(&v, from, sizeof v);
    return v;
}
template <class V>
[[gnu::always_inline]] inline void store(V v, double* to) {
    std::memcpy(to, &v, sizeof v);
}
// The sum of n terms, term(0), term(1), ..., in pairs and four at a time, so that few additions wait for one another.
template <int n, class Term>
[[gnu::always_inline]] inline auto sum_in_fours(Term&& term) {
    static_assert(n % 4 == 0);
    const auto four = [&]<int k>(std::integral_constant<int, k>) ALWAYS_INLINE {
        return (term(std::integral_constant<int, k>{}) + term(std::integral_constant<int, k + 1>{})) +
               (term(std::integral_constant<int, k + 2>{}) + term(std::integral_constant<int, k + 3>{}));
    };
    auto sum = four(std::integral_constant<int, 0>{});
    [&]<int... k>(std::integer_sequence<int, k...>) ALWAYS_INLINE {
        ((sum = sum + four(std::integral_constant<int, 4 * (k + 1)>{})), ...);
    }(std::make_integer_sequence<int, n / 4 - 1>{});
    return sum;
}

// n numbers in as many registers as they need.
template <int n>
struct Pack {
    static constexpr int width = vec_width < n ? vec_width : n, parts = n / width;
    static_assert(parts * width == n);
    using Part = VecOf<width>::Type;
    Part part[parts];

    [[gnu::always_inline]] static Pack of(const std::array<double, n>& numbers) {
        Pack v;
        for (int k = 0; k < n; ++k) v.part[k / width][k % width] = numbers[k];
        return v;
    }
    [[gnu::always_inline]] static Pack load(const double* from) {
        Pack v;
        for (int p = 0; p < parts; ++p) v.part[p] = lostmotion::load<Part>(from + p * width);
        return v;
    }
    [[gnu::always_inline]] void store(double* to) const {
        for (int p = 0; p < parts; ++p) lostmotion::store(part[p], to + p * width);
    }
    [[gnu::always_inline]] double operator[](int k) const {
        const auto at = static_cast<unsigned>(k);  // which is divided by a shift
        return part[at / width][at % width];
    }
    void set(int k, double number) { part[k / width][k % width] = number; }
    // In pairs, four at a time: in the same order in every build.
    [[gnu::always_inline]] double sum() const {
        return sum_in_fours<n>([this](auto k) { return (*this)[k]; });
    }
    // The k-th four of the numbers.
    [[gnu::always_inline]] Pack<4> four(int k) const {
        static_assert(n % 4 == 0);
        if constexpr (n == 4) {
            return *this;
        } else {
            Pack<4> out;
            std::memcpy(&out, reinterpret_cast<const char*>(this) + sizeof out * static_cast<std::size_t>(k),
                        sizeof out);
            return out;
        }
    }
    [[gnu::always_inline]] void set_four(int k, const Pack<4>& numbers) {
        std::memcpy(reinterpret_cast<char*>(this) + sizeof numbers * static_cast<std::size_t>(k), &numbers,
                    sizeof numbers);
    }
    // The k-th number in every place.
    template <int k>
    [[gnu::always_inline]] Pack spread() const {
        const Part v = part[k / width];
        constexpr int at = k % width;
        Pack all;
        for (Part& p : all.part) {
            if constexpr (width == 4)
                p = shuffled<at, at, at, at>(v, v);
            else
                p = shuffled<at, at>(v, v);
        }
        return all;
    }
    // The two numbers of each pair exchanged.
    [[gnu::always_inline]] Pack swapped() const {
        static_assert(width == 2);
        Pack out;
        for (int p = 0; p < parts; ++p) out.part[p] = shuffled<1, 0>(part[p], part[p]);
        return out;
    }
    [[gnu::always_inline]] friend Pack operator+(Pack a, const Pack& b) {
        for (int p = 0; p < parts; ++p) a.part[p] += b.part[p];
        return a;
    }
    [[gnu::always_inline]] friend Pack operator*(double a, Pack b) {
        for (int p = 0; p < parts; ++p) b.part[p] *= a;
        return b;
    }
    [[gnu::always_inline]] friend Pack operator*(Pack a, const Pack& b) {
        for (int p = 0; p < parts; ++p) a.part[p] *= b.part[p];
        return a;
    }
};

// The sums of four packs.
template <int n>
[[gnu::always_inline]] inline Pack<4> sums(const Pack<n>& a, const Pack<n>& b, const Pack<n>& c, const Pack<n>& d) {
    Pack<4> out;
    if constexpr (n > 4) {
        out = sums(a.four(0), b.four(0), c.four(0), d.four(0));
        for (int k = 1; k < n / 4; ++k) out = out + sums(a.four(k), b.four(k), c.four(k), d.four(k));
    } else if constexpr (Pack<n>::parts == 1) {
        const auto pairs = [](auto v, auto w) { return shuffled<0, 4, 2, 6>(v, w) + shuffled<1, 5, 3, 7>(v, w); };
        const auto ab = pairs(a.part[0], b.part[0]), cd = pairs(c.part[0], d.part[0]);
        out.part[0] = shuffled<0, 1, 4, 5>(ab, cd) + shuffled<2, 3, 6, 7>(ab, cd);
    } else {
        const auto pairs = [](auto v, auto w) { return shuffled<0, 2>(v, w) + shuffled<1, 3>(v, w); };
        out.part[0] = pairs(a.part[0], b.part[0]) + pairs(a.part[1], b.part[1]);
        out.part[1] = pairs(c.part[0], d.part[0]) + pairs(c.part[1], d.part[1]);
    }
    return out;
}

inline Vec min_of(Vec a, Vec b) { return chosen(a < b, a, b); }
template <class V>
    requires(!requires(V v) { v.four(0); })
[[gnu::always_inline]] inline V absolute(V a) {
    return magnitude_of(a);
}
inline double absolute(double a) { return a < -a ? -a : a; }
template <int n>
[[gnu::always_inline]] inline Pack<n> absolute(Pack<n> a) {
    for (auto& part : a.part) part = absolute(part);
    return a;
}
// The greater of two numbers, for each pair.
inline double max_of(double a, double b) { return a < b ? b : a; }
template <int n>
Pack<n> max_of(Pack<n> a, const Pack<n>& b) {
    for (int p = 0; p < Pack<n>::parts; ++p) a.part[p] = chosen(a.part[p] < b.part[p], b.part[p], a.part[p]);
    return a;
}
// Each number, but `bound` at most.
template <int n>
Pack<n> at_most(Pack<n> a, double bound) {
    const auto limit = typename Pack<n>::Part{} + bound;
    for (auto& part : a.part) part = chosen(part < limit, part, limit);
    return a;
}
// Where a > b, as bits, the first number lowest.
inline unsigned above(Vec a, Vec b) {
#if defined LOSTMOTION_VECTORS && defined __AVX__
    return static_cast<unsigned>(_mm256_movemask_pd(_mm256_cmp_pd(a, b, _CMP_GT_OQ)));
#elif defined LOSTMOTION_VECTORS && defined __SSE2__
    return static_cast<unsigned>(_mm_movemask_pd(_mm_cmpgt_pd(a, b)));
#else
    unsigned out = 0;
    for (int k = 0; k < vec_width; ++k) out |= a[k] > b[k] ? 1u << k : 0u;
    return out;
#endif
}
inline constexpr unsigned all_bits = (1u << vec_width) - 1;

}  // namespace lostmotion
