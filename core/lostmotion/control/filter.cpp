#include "filter.hpp"

namespace lostmotion::control {

double DiscreteSystem::operator()(double u, double* slot) const {
    double* z = slot + first_;
    const std::size_t n = B.size();
    double y = D * u;
    std::array<double, max_order> next;
    for (std::size_t i = 0; i < n; ++i) {
        y += C[i] * z[i];
        next[i] = B[i] * u;
        for (std::size_t j = 0; j < n; ++j) next[i] += A[i * n + j] * z[j];
    }
    for (std::size_t i = 0; i < n; ++i) z[i] = next[i];
    return y;
}

}  // namespace lostmotion::control
