// Gauss-Jordan elimination of unknowns from linear forms, with row pivoting.
#pragma once

#include <cmath>
#include <cstddef>
#include <utility>

namespace lostmotion {

// Solves rows[k] = 0 for the unknowns, columns `unknowns[k]` of the forms; then row k is 1 times its unknown, none of
// the others, and the known terms. `subtract(f, factor, row)` is f -= factor * row. False if there is no unique
// solution.
template <class Rows, class Unknowns, class Subtract>
bool eliminate(Rows& rows, const Unknowns& unknowns, std::size_t n, const Subtract& subtract) {
    for (std::size_t k = 0; k < n; ++k) {
        std::size_t pivot = k;
        for (std::size_t row = k + 1; row < n; ++row)
            if (std::fabs(rows[row].c[unknowns[k]]) > std::fabs(rows[pivot].c[unknowns[k]])) pivot = row;
        std::swap(rows[k], rows[pivot]);
        const double p = rows[k].c[unknowns[k]];
        if (p == 0.0) return false;
        rows[k] = rows[k] / p;
        rows[k].c[unknowns[k]] = 1.0;
        for (std::size_t row = 0; row < n; ++row) {
            const double factor = rows[row].c[unknowns[k]];
            if (row == k || factor == 0.0) continue;
            subtract(rows[row], factor, rows[k]);
            rows[row].c[unknowns[k]] = 0.0;
        }
    }
    return true;
}

// Puts the solution of `eliminate` into a form.
template <class F, class Rows, class Unknowns, class Subtract>
void substitute(F& f, const Rows& rows, const Unknowns& unknowns, std::size_t n, const Subtract& subtract) {
    for (std::size_t k = 0; k < n; ++k) {
        const double factor = f.c[unknowns[k]];
        if (factor == 0.0) continue;
        subtract(f, factor, rows[k]);
        f.c[unknowns[k]] = 0.0;
    }
}

}  // namespace lostmotion
