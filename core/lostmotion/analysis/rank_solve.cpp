#include "rank_solve.hpp"

namespace lostmotion {

std::vector<double> solve_leaving_neutral(std::vector<std::vector<double>> M, std::vector<double> b, std::size_t n,
                                          double neutral) {
    std::vector<std::size_t> column(n);
    for (std::size_t k = 0; k < n; ++k) column[k] = k;
    std::size_t rank = 0;
    for (; rank < n; ++rank) {
        std::size_t row = rank, col = rank;
        for (std::size_t r = rank; r < M.size(); ++r)
            for (std::size_t c = rank; c < n; ++c)
                if (std::fabs(M[r][c]) > std::fabs(M[row][col])) row = r, col = c;
        if (!(std::fabs(M[row][col]) > neutral)) break;
        std::swap(M[rank], M[row]);
        std::swap(b[rank], b[row]);
        for (auto& line : M) std::swap(line[rank], line[col]);
        std::swap(column[rank], column[col]);
        for (std::size_t r = rank + 1; r < M.size(); ++r) {
            const double factor = M[r][rank] / M[rank][rank];
            for (std::size_t c = rank; c < n; ++c) M[r][c] -= factor * M[rank][c];
            b[r] -= factor * b[rank];
        }
    }
    std::vector<double> x(n);
    for (std::size_t r = rank; r-- > 0;) {
        double sum = b[r];
        for (std::size_t c = r + 1; c < rank; ++c) sum -= M[r][c] * x[column[c]];
        x[column[r]] = sum / M[r][r];
    }
    return x;
}

}  // namespace lostmotion
