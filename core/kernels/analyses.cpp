// What is not called at each event, for 4 and any number of coupled states: adaptive solver, responses, sensitivities.
#include "lostmotion/analysis/analyses.hpp"

#include "sensitive_solving.hpp"
#include "solving.hpp"
#include "train_adaptive.hpp"
#include "train_response.hpp"

namespace lostmotion {

template <class D>
class AnalysesIn final : public Analyses {
 public:
    explicit AnalysesIn(const char* name) : Analyses(name, sizes_of<D>) {}
    ResponseTable respond(const TrainModel& model, const std::vector<ResponseRequest>& points, const ResponseSpec& spec,
                          unsigned threads, const Waiting& waiting) const override {
        return respond_train_in<D>(model, points, spec, threads, waiting);
    }
    TrainReport run_with_derivatives(const TrainModel& model, const SensitiveCase& c, double* out,
                                     SensitivityOutput& output) const override {
        return SensitiveRuns<D>(model)(c, c.options, out, output);
    }
    void run_sensitive(const TrainModel& model, std::span<const SensitiveCase> cases, std::span<SensitiveRow> rows,
                       const std::vector<std::string>& channels, bool signals, std::atomic<bool>& stop) const override {
        run_sensitive_cases<D>(model, cases, rows, channels, signals, stop);
    }
};

LOSTMOTION_SOLVING(extern template, Any)
namespace {
const AdaptiveKernelIn<Any> adaptive("any");
const AnalysesIn<Any> analyses("any");
}  // namespace
#ifndef LOSTMOTION_ANY_SIZE_ALONE
LOSTMOTION_SOLVING(extern template, model::Least)
namespace {
const AdaptiveKernelIn<model::Least> adaptive_of_drives("drive");
const AnalysesIn<model::Least> analyses_of_drives("drive");
}  // namespace
#endif
}  // namespace lostmotion
