// Fourier coefficients of one period of samples.
#pragma once

#include <cstddef>
#include <numbers>
#include <vector>

#include "../base/sine.hpp"

namespace lostmotion {

// Cosines and sines of equidistant angles of one revolution.
struct UnitCircle {
    std::vector<double> cosine, sine;

    explicit UnitCircle(std::size_t samples);
};

// Writes the coefficients c_n = 2/N sum x_k exp(-2 pi i n k / N) (n = 0: the mean) of the order 0 to `harmonics`, real
// and imaginary part of each, and returns the mean square of the samples.
double harmonics_of(const double* x, const UnitCircle& circle, int harmonics, double* out);

}  // namespace lostmotion
