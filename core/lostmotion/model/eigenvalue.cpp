#include "eigenvalue.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace lostmotion::model {

// Each rotation of two axes makes the entry between them zero; the sum of the squares off the diagonal falls by its
// square (Jacobi 1846; Golub and Van Loan, Matrix Computations, 8.5).
double smallest_eigenvalue(std::vector<std::vector<double>> A) {
    const std::size_t n = A.size();
    for (int sweep = 0; sweep < 64; ++sweep) {
        double off = 0.0, diagonal = 0.0;
        for (std::size_t p = 0; p < n; ++p)
            for (std::size_t q = 0; q < n; ++q) (p == q ? diagonal : off) += A[p][q] * A[p][q];
        constexpr double rounding = std::numeric_limits<double>::epsilon();
        if (!(off > rounding * rounding * diagonal)) break;
        for (std::size_t p = 0; p < n; ++p)
            for (std::size_t q = p + 1; q < n; ++q) {
                if (A[p][q] == 0.0) continue;
                const double theta = (A[q][q] - A[p][p]) / (2.0 * A[p][q]);
                const double t = std::copysign(1.0, theta) / (std::fabs(theta) + std::sqrt(theta * theta + 1.0));
                const double c = 1.0 / std::sqrt(t * t + 1.0), s = t * c;
                for (std::size_t k = 0; k < n; ++k) {
                    const double a = A[k][p], b = A[k][q];
                    A[k][p] = c * a - s * b;
                    A[k][q] = s * a + c * b;
                }
                for (std::size_t k = 0; k < n; ++k) {
                    const double a = A[p][k], b = A[q][k];
                    A[p][k] = c * a - s * b;
                    A[q][k] = s * a + c * b;
                }
            }
    }
    double least = A[0][0];
    for (std::size_t k = 1; k < n; ++k) least = std::fmin(least, A[k][k]);
    return least;
}

}  // namespace lostmotion::model
