// Many runs in one call, on several threads: parameters as arrays in, samples and totals as arrays out. A run does not
// know of the others, so a row is the single run to the last bit, for any number of threads.
#pragma once

#include <algorithm>
#include <atomic>
#include <functional>
#include <limits>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "../drive/parameters.hpp"
#include "../simulation/result_names.hpp"
#include "../simulation/run.hpp"
#include "reduction.hpp"
#include "workers.hpp"

namespace lostmotion {

// What a run is made of.
struct Case {
    Drive drive;
    Signals signals;
    Start start;
};

// What may differ from run to run.
struct BatchField {
    std::string key;  // as in a scenario file
    std::function<void(Case&, double)> set;
    bool of_drive;  // whether the drive itself changes
};

void add_signal_fields(std::vector<BatchField>& fields, const std::string& prefix, std::size_t input);

const std::vector<BatchField>& batch_fields();

struct BatchInput {
    Case base;
    RunOptions options;
    std::span<const int> fields;     // numbers in batch_fields()
    std::span<const double> values;  // runs x fields
    std::size_t runs = 0;
    std::vector<Kept> kept;  // none: the samples themselves
};

struct BatchRow {
    Status status = Status::interrupted;
    Contact contact = input_contact;
    double time = 0.0;
    double switchings = 0.0;
    double left_data_at = 0.0;
    EnergyLedger energy;
};

// out: runs x channels x samples or, of what is to be kept, runs x kept; NaN all through a run that did not end well.
std::vector<BatchRow> run_batch(WorkspacePool& pool, const BatchInput& in, double* out, unsigned threads,
                                const std::function<bool(std::size_t)>& waiting);

}  // namespace lostmotion
