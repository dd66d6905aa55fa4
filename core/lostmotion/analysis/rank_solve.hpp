// A small system of linear equations that may be singular.
#pragma once

#include <cmath>
#include <utility>
#include <vector>

namespace lostmotion {

// Solves M x = b, with at least as many equations as unknowns, by elimination with full pivoting. Where no pivot above
// `neutral` in magnitude is left, the equations say nothing: the unknowns that remain are zero.
std::vector<double> solve_leaving_neutral(std::vector<std::vector<double>> M, std::vector<double> b, std::size_t n,
                                          double neutral);

}  // namespace lostmotion
