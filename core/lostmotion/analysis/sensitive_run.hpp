// Runs of trains with their derivatives, one or many, on several threads. A run does not know of the others.
#pragma once

#include <atomic>
#include <functional>
#include <limits>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "variation.hpp"
#include "workers.hpp"

namespace lostmotion {

struct SensitiveCase {
    std::shared_ptr<const TrainRun> run;
    std::vector<Signal> inputs;
    TrainStart start;
    TrainOptions options;
    std::vector<Variation> variations;
};

// What is asked for, and where it goes.
struct SensitivityOutput {
    SampleTimes times;
    std::vector<int> channels;   // by their place among TrainRun::channels()
    double* out = nullptr;       // parameters x channels x samples; NaN from where the motion is not smooth
    double* axes_out = nullptr;  // parameters x (axes x signals) x samples, as TrainOptions::control_out

    double ends_at = std::numeric_limits<double>::infinity();  // [s] from where it is not, and why
    std::string ends_by;
    DerivativeFault fault;  // then there is no run
};

// Refuses what has no derivative among the controllers of a run.
DerivativeFault check_derivatives(const Control& control, const std::vector<Variation>& variations);

struct SensitiveRow {
    DerivativeFault problem;                                // of what is asked for
    std::string error;                                      // of the motion, or empty
    std::unique_ptr<double[]> values, derivatives;          // channels x samples; parameters x channels x samples
    std::unique_ptr<double[]> signals, signal_derivatives;  // of the controllers: (axes x signals) x samples, as above
    NamedInOrder end_state;                                 // of a run that has ended well
    double ends_at = std::numeric_limits<double>::infinity();  // [s] from where the derivatives do not exist, and why
    std::string ends_by;
};

// By the exact solver. out: values, as TrainRun::run; output: derivatives of the same channels and instants.
TrainReport run_with_derivatives(const SensitiveCase& c, double* out, SensitivityOutput& output);

// Up to this many runs of the same train come one after the other on a thread.
inline constexpr std::size_t together = 8;

// Where each of the pieces of work begins, and the end: runs of the same train that stand together. What they share
// does not depend on the number of threads.
std::vector<std::size_t> pieces_of_work(const std::vector<SensitiveCase>& cases);

std::vector<SensitiveRow> run_sensitive(const std::vector<SensitiveCase>& cases,
                                        const std::vector<std::string>& channels, bool signals, unsigned threads,
                                        const std::function<bool(std::size_t)>& waiting);

}  // namespace lostmotion
