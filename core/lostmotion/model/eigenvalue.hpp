// Eigenvalues of a symmetric matrix, by Jacobi's rotations.
#pragma once

#include <vector>

namespace lostmotion::model {

// The smallest; the matrix has at least one row.
double smallest_eigenvalue(std::vector<std::vector<double>> matrix);

}  // namespace lostmotion::model
