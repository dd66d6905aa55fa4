// What solves drives takes long to compile: once for all tests, in drive_runs.cpp.
#pragma once

#include "lostmotion/simulation/run.hpp"
#include "lostmotion/simulation/stepping.hpp"
#include "support.hpp"

namespace lostmotion {

struct Samples {
    RunReport report;
    std::size_t count = 0;
    std::vector<double> data;
    double operator()(Channel c, std::size_t k) const { return data[c * count + k]; }
};

// By the exact solver, or by the adaptive one to a tolerance.
Samples run(const Drive& drive, const Signals& signals, double duration, double interval = 1e-3,
            const Start& start = {}, double adaptive_tolerance = 0.0);

}  // namespace lostmotion
