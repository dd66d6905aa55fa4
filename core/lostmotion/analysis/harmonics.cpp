#include "harmonics.hpp"

namespace lostmotion {

UnitCircle::UnitCircle(std::size_t samples) : cosine(samples), sine(samples) {
    for (std::size_t k = 0; k < samples; ++k) {
        const double angle = 2.0 * std::numbers::pi * static_cast<double>(k) / static_cast<double>(samples);
        const SineCosine at = sine_cosine(angle);
        cosine[k] = at.cos;
        sine[k] = at.sin;
    }
}

double harmonics_of(const double* x, const UnitCircle& circle, int harmonics, double* out) {
    const std::size_t samples = circle.cosine.size();
    double square = 0.0;
    for (std::size_t k = 0; k < samples; ++k) square += x[k] * x[k];
    for (int n = 0; n <= harmonics; ++n) {
        double re = 0.0, im = 0.0;
        std::size_t at = 0;
        for (std::size_t k = 0; k < samples; ++k) {
            re += x[k] * circle.cosine[at];
            im -= x[k] * circle.sine[at];
            at += static_cast<std::size_t>(n);
            if (at >= samples) at -= samples;
        }
        const double scale = (n == 0 ? 1.0 : 2.0) / static_cast<double>(samples);
        *out++ = scale * re;
        *out++ = scale * im;
    }
    return square / static_cast<double>(samples);
}

}  // namespace lostmotion
