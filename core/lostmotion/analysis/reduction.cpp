#include "reduction.hpp"

namespace lostmotion {

double reduce(Reduction r, const double* v, std::size_t n) {
    if (n == 0) return std::numeric_limits<double>::quiet_NaN();
    const auto count = static_cast<double>(n);
    const auto itself = [](auto x) { return x; };
    const auto larger = [](auto a, auto b) { return max_of(a, b); };
    switch (r) {
        case Reduction::peak: return best_of(v, n, larger, [](auto x) { return absolute(x); });
        case Reduction::rms: return std::sqrt(sum_over(v, n, [](auto x) { return x * x; }) / count);
        case Reduction::mean: return sum_over(v, n, itself) / count;
        case Reduction::final: return v[n - 1];
        case Reduction::min: return -best_of(v, n, larger, [](auto x) { return -1.0 * x; });
        default: return best_of(v, n, larger, itself);
    }
}

}  // namespace lostmotion
