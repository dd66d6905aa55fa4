// Many runs in one call, on several threads. A run does not know of the others, so a row is the single run to the last
// bit, for any number of threads.
#pragma once

#include <functional>
#include <span>
#include <string>
#include <vector>

#include "../model/drive_train.hpp"
#include "../simulation/train_run.hpp"
#include "reduction.hpp"
#include "workers.hpp"

namespace lostmotion {

struct TrainCase {
    model::Train train;
    std::vector<Signal> inputs;  // as model::input_names
    TrainStart start;
};

// What may differ from run to run of a drive.
struct BatchField {
    std::string key;  // as in a scenario file
    std::function<void(TrainCase&, double)> set;
};
const std::vector<BatchField>& batch_fields();

struct TrainBatch {
    std::vector<TrainCase> cases;
    TrainOptions options;
    std::vector<std::string> channels;  // by name
    std::vector<Kept> kept;             // none: the samples themselves
    std::vector<std::string> energies;  // of the ledger, by name
    // Each row: the only case with these values of these fields, runs x fields.
    std::vector<int> fields = {};
    std::span<const double> values = {};

    std::size_t runs() const { return fields.empty() ? cases.size() : values.size() / fields.size(); }
    // The case of a row: one of the list, or made in `room`.
    const TrainCase& row(std::size_t k, TrainCase& room) const;

    // Numbers of a row.
    std::size_t width() const { return kept.empty() ? channels.size() * options.samples : kept.size(); }
};

struct TrainRow {
    std::string error;  // why it has not ended well, or empty
    double switchings = 0.0;
    std::vector<double> energies;  // [J]; 0 where the train has none of that name, NaN where there is an error
};

// The places of the channels of these names; the first that the train has not, as an error.
std::string find_channels(const TrainRun& run, const std::vector<std::string>& names, std::vector<int>& found);

// out: the numbers of the row; NaN if the run has not ended well.
// workspace: of another train, left for the next.
TrainRow run_case(const TrainCase& one, const TrainBatch& batch, TrainOptions options, double* samples, double* out,
                  std::unique_ptr<Workspace>& workspace);

// out: runs() x width().
std::vector<TrainRow> run_trains(const TrainBatch& batch, double* out, unsigned threads,
                                 const std::function<bool(std::size_t)>& waiting);

}  // namespace lostmotion
