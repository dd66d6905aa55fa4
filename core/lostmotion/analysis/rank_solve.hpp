// A small system of linear equations that may be singular.
#pragma once

#include <array>
#include <cmath>
#include <utility>

namespace lostmotion {

// Solves M x = b by elimination with full pivoting. Where no pivot above `neutral` in magnitude is left, the equations
// say nothing: the unknowns that remain are zero.
template <int n>
std::array<double, n> solve_leaving_neutral(std::array<std::array<double, n>, n> M, std::array<double, n> b,
                                            double neutral) {
    std::array<int, n> column{};
    for (int k = 0; k < n; ++k) column[k] = k;
    int rank = 0;
    for (; rank < n; ++rank) {
        int row = rank, col = rank;
        for (int r = rank; r < n; ++r)
            for (int c = rank; c < n; ++c)
                if (std::fabs(M[r][c]) > std::fabs(M[row][col])) row = r, col = c;
        if (!(std::fabs(M[row][col]) > neutral)) break;
        std::swap(M[rank], M[row]);
        std::swap(b[rank], b[row]);
        for (auto& line : M) std::swap(line[rank], line[col]);
        std::swap(column[rank], column[col]);
        for (int r = rank + 1; r < n; ++r) {
            const double factor = M[r][rank] / M[rank][rank];
            for (int c = rank; c < n; ++c) M[r][c] -= factor * M[rank][c];
            b[r] -= factor * b[rank];
        }
    }
    std::array<double, n> x{};
    for (int r = rank - 1; r >= 0; --r) {
        double sum = b[r];
        for (int c = r + 1; c < rank; ++c) sum -= M[r][c] * x[column[c]];
        x[column[r]] = sum / M[r][r];
    }
    return x;
}

}  // namespace lostmotion
