// Periodic motions and harmonic responses of drives and trains, asked for by name.
#pragma once

#include <functional>
#include <map>
#include <string>
#include <vector>

#include "../simulation/train_run.hpp"

namespace lostmotion {

struct ResponseSpec {
    std::size_t samples = 2048;  // a period
    int harmonics = 8;           // coefficients 0 (mean) to this
    int max_periods = 20000;
    double tolerance = 1e-10;
    bool keep_table = false;   // of the samples, with each result
    bool limit_cycle = false;  // the inputs are constant, and the periods of the points are first estimates
};

// A signal for each input, the period [s], components at the start by name; those left out are 0.
struct ResponseRequest {
    std::vector<Signal> inputs;
    double period = 1.0;
    Named start;
};

// Of each point, one after the other.
struct ResponseTable {
    std::vector<std::string> components;
    std::vector<int> neutral;  // nothing depends on this component
    std::size_t channels = 0;
    std::vector<std::string> error;  // why there is no motion, or empty
    std::vector<double> converged, smooth, periods, newton_steps;
    std::vector<double> period;                              // [s]
    std::vector<double> residual;                            // of the motion
    std::vector<double> motor_power, load_power, gear_loss;  // mean [W]
    std::vector<double> advance, start;                      // by component
    std::vector<double> jacobian;                            // components x components
    std::vector<double> harmonics;                           // channels x (harmonics + 1) x (cos, sin)
    std::vector<double> mean_square;                         // by channel
    std::vector<double> table;                               // channels x samples, if it is kept
};

using Waiting = std::function<bool(std::size_t)>;

ResponseTable respond_train(const TrainRun& run, const std::vector<ResponseRequest>& points, const ResponseSpec& spec,
                            unsigned threads, const Waiting& waiting);

}  // namespace lostmotion
