#include "filter.hpp"

#include <numbers>

#include "../base/sine.hpp"

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

namespace {

// Coefficients in z of those in s/w, c = 1/tan(w T/2): each power k gives ((z - 1) c)^k (z + 1)^(order - k).
std::vector<double> in_z(const std::vector<double>& in_s, double c) {
    const std::size_t order = in_s.size() - 1;
    std::vector<double> total(order + 1);
    double factor = 1.0;
    for (std::size_t power = 0; power <= order; ++power) {
        std::vector<double> term{in_s[order - power] * factor};
        for (std::size_t k = 0; k < order; ++k) {
            const double sign = k < power ? -1.0 : 1.0;
            term.push_back(0.0);
            for (std::size_t j = term.size() - 1; j > 0; --j) term[j] += sign * term[j - 1];
        }
        for (std::size_t j = 0; j <= order; ++j) total[j] += term[j];
        factor *= c;
    }
    return total;
}

}  // namespace

void Filter::discretise(double loop_time) {
    if (kind == transfer_function) return;
    const SineCosine half = sine_cosine(std::numbers::pi * frequency * loop_time);
    const double r = pole_frequency > 0.0 ? frequency / pole_frequency : 1.0;
    numerator = {1.0, 2.0 * depth, 1.0};
    denominator = {r * r, 2.0 * width * r, 1.0};
    if (kind == low_pass) {
        numerator = {0.0, 0.0, 1.0};
        denominator = {1.0, 2.0 * damping, 1.0};
        if (damping == 0.0) numerator = {0.0, 1.0}, denominator = {1.0, 1.0};
    }
    const double c = 1.0 / (half.sin / half.cos);
    numerator = in_z(numerator, c);
    denominator = in_z(denominator, c);
    kind = transfer_function;
}

DiscreteSystem Filter::system() const {
    const std::size_t n = denominator.size() - 1, lacking = n + 1 - numerator.size();
    const auto a = [&](std::size_t k) { return denominator[k] / denominator[0]; };
    const auto b = [&](std::size_t k) { return k < lacking ? 0.0 : numerator[k - lacking] / denominator[0]; };
    DiscreteSystem s;
    s.A.resize(n * n);
    s.B.resize(n);
    s.D = b(0);
    for (std::size_t k = 0; k < n; ++k) {
        s.A[k] = -a(k + 1);
        if (k > 0) s.A[k * n + k - 1] = 1.0;
        s.B[k] = k == 0 ? 1.0 : 0.0;
        s.C.push_back(b(k + 1) - b(0) * a(k + 1));
    }
    return s;
}

}  // namespace lostmotion::control
