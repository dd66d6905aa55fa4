// Analyses of trains in a kernel: periodic motions with their responses, and derivatives by parameters.
#pragma once

#include <atomic>
#include <span>
#include <string>
#include <vector>

#include "respond.hpp"
#include "sensitive_run.hpp"

namespace lostmotion {

class Analyses : public Linked<Analyses> {
 public:
    using Linked::Linked;

    virtual ResponseTable respond(const TrainModel& model, const std::vector<ResponseRequest>& points,
                                  const ResponseSpec& spec, unsigned threads, const Waiting& waiting) const = 0;
    // As the function of this name.
    virtual TrainReport run_with_derivatives(const TrainModel& model, const SensitiveCase& c, double* out,
                                             SensitivityOutput& output) const = 0;
    // Cases of one train, each into its row. signals: also what the controllers show; then the instants must be
    // multiples of an interval.
    virtual void run_sensitive(const TrainModel& model, std::span<const SensitiveCase> cases,
                               std::span<SensitiveRow> rows, const std::vector<std::string>& channels, bool signals,
                               std::atomic<bool>& stop) const = 0;
};

}  // namespace lostmotion
