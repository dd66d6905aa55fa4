// A small linear system with a positive definite matrix.
#pragma once

#include <cstddef>
#include <vector>

namespace lostmotion::model {

// rows: the matrix, and the right side as the last column. Such a matrix needs no pivoting.
inline std::vector<double> solve_positive(std::vector<std::vector<double>> rows) {
    const std::size_t n = rows.size();
    for (std::size_t k = 0; k < n; ++k)
        for (std::size_t r = k + 1; r < n; ++r) {
            const double factor = rows[r][k] / rows[k][k];
            if (factor == 0.0) continue;
            for (std::size_t c = k; c <= n; ++c) rows[r][c] -= factor * rows[k][c];
        }
    std::vector<double> x(n);
    for (std::size_t k = n; k-- > 0;) {
        double sum = rows[k][n];
        for (std::size_t c = k + 1; c < n; ++c) sum -= rows[k][c] * x[c];
        x[k] = sum / rows[k][k];
    }
    return x;
}

}  // namespace lostmotion::model
