// What is kept of a variable over time: one number of many samples.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <span>

#include "../base/vec.hpp"
#include "../simulation/enum_table.hpp"

namespace lostmotion {

enum class Reduction : int { peak, rms, mean, final, min, max };
struct ReductionName {
    Reduction value;
    const char* name;
};
inline constexpr std::array<ReductionName, 6> reduction_names{{
    {Reduction::peak, "peak"},
    {Reduction::rms, "rms"},
    {Reduction::mean, "mean"},
    {Reduction::final, "final"},
    {Reduction::min, "least"},
    {Reduction::max, "largest"},
}};
static_assert(in_order(reduction_names));

using Eight = Pack<8>;

// The sum of a term of each. Eight are summed up side by side in every build, so that all give the same bits.
template <class Term>
double sum_over(const double* v, std::size_t n, Term&& term) {
    Eight sum{};
    std::size_t k = 0;
    for (; k + 8 <= n; k += 8) sum = sum + term(Eight::load(v + k));
    double total = ((sum[0] + sum[1]) + (sum[2] + sum[3])) + ((sum[4] + sum[5]) + (sum[6] + sum[7]));
    for (; k < n; ++k) total += term(v[k]);
    return total;
}

// The one that `better` prefers of them all, as `seen`.
template <class Better, class Seen>
double best_of(const double* v, std::size_t n, Better&& better, Seen&& seen) {
    double best = seen(v[0]);
    if (n >= 8) {
        Eight found = seen(Eight::load(v));
        for (std::size_t k = 8; k + 8 <= n; k += 8) found = better(found, seen(Eight::load(v + k)));
        found = better(found, seen(Eight::load(v + n - 8)));
        for (int k = 0; k < 8; ++k) best = better(best, found[k]);
    } else {
        for (std::size_t k = 1; k < n; ++k) best = better(best, seen(v[k]));
    }
    return best;
}

// last: the share of an interval that the last sample is behind the one before, which is its weight in a mean. NaN
// without samples; undefined if one of them is NaN.
double reduce(Reduction r, const double* v, std::size_t n, double last = 1.0);

// One number to keep of each run: a reduction of the samples of a channel, by its place among those of the run.
struct Kept {
    std::size_t channel = 0;
    Reduction how = Reduction::peak;
};

// samples: channels x n.
inline void reduce_all(std::span<const Kept> kept, const double* samples, std::size_t n, double last, double* out) {
    for (std::size_t k = 0; k < kept.size(); ++k) out[k] = reduce(kept[k].how, samples + kept[k].channel * n, n, last);
}

}  // namespace lostmotion
