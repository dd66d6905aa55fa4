#include "reduction.hpp"

namespace lostmotion {

double reduce(Reduction r, const double* v, std::size_t n, double last) {
    if (n == 0) return std::numeric_limits<double>::quiet_NaN();
    const auto mean = [&](auto&& term) {
        const double sum = sum_over(v, n, term), less = 1.0 - last;
        return (less == 0.0 ? sum : sum - less * term(v[n - 1])) / (static_cast<double>(n) - less);
    };
    const auto itself = [](auto x) { return x; };
    const auto larger = [](auto a, auto b) { return max_of(a, b); };
    switch (r) {
        case Reduction::peak: return best_of(v, n, larger, [](auto x) { return absolute(x); });
        case Reduction::rms: return std::sqrt(mean([](auto x) { return x * x; }));
        case Reduction::mean: return mean(itself);
        case Reduction::final: return v[n - 1];
        case Reduction::min: return -best_of(v, n, larger, [](auto x) { return -1.0 * x; });
        default: return best_of(v, n, larger, itself);
    }
}

}  // namespace lostmotion
