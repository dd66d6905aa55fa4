// The C interface: runs in one go.
#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "lostmotion/scenario/whole_run.hpp"
#include "objects.hpp"

namespace lm = lostmotion;

struct lm_result {
    lm::WholeRun run;
};

extern "C" {

void lm_scenario_set_interrupt(lm_scenario* scenario, int (*interrupted)(void*), void* context) {
    scenario->asked = {interrupted, context};
}
lm_result* lm_scenario_run(lm_scenario* scenario, int energy, size_t max_switchings) {
    lm_result* made = nullptr;
    scenario->changed(attempted([&]() -> std::string {
        made = new lm_result{lm::run_whole(scenario->description.scenario(),
                                           {energy != 0, max_switchings, Asked::ask, &scenario->asked})};
        return made->run.error;
    }));
    return made;
}
void lm_result_free(lm_result* result) { delete result; }
int lm_result_status(const lm_result* result) {
    if (result->run.error.empty()) return LM_OK;
    return result->run.status == lm::Status::done ? int(LM_INVALID) : static_cast<int>(result->run.status);
}
const char* lm_result_error(const lm_result* result) { return result->run.error.c_str(); }
double lm_result_time(const lm_result* result) { return result->run.time; }
double lm_result_left_data_at(const lm_result* result) { return result->run.left_data_at; }
size_t lm_result_samples(const lm_result* result) { return result->run.samples; }
size_t lm_result_switchings(const lm_result* result) {
    const lm::WholeRun& r = result->run;
    return r.switchings.size() / std::max<std::size_t>(1, r.switching_columns.size());
}
size_t lm_result_switching_count(const lm_result* result) { return result->run.switching_count; }

size_t lm_result_count(const lm_result* result, lm_part part) {
    const lm::WholeRun& r = result->run;
    switch (part) {
        case LM_SAMPLES: return r.variables.size();
        case LM_ENERGIES: return r.energies.size();
        case LM_END_STATE: return r.end_states.size();
        case LM_SWITCHINGS: return r.switching_columns.size();
    }
    return 0;
}
const char* lm_result_name(const lm_result* result, lm_part part, size_t k) {
    const lm::WholeRun& r = result->run;
    if (k >= lm_result_count(result, part)) return nullptr;
    switch (part) {
        case LM_SAMPLES: return r.variables[k].name.c_str();
        case LM_ENERGIES: return r.energies[k].c_str();
        case LM_END_STATE: return r.end_states[k].c_str();
        case LM_SWITCHINGS: return r.switching_columns[k].c_str();
    }
    return nullptr;
}
const char* lm_result_unit(const lm_result* result, size_t variable) {
    const lm::WholeRun& r = result->run;
    return variable < r.variables.size() ? r.variables[variable].unit.c_str() : nullptr;
}
const double* lm_result_values(const lm_result* result, lm_part part) {
    const lm::WholeRun& r = result->run;
    switch (part) {
        case LM_SAMPLES: return r.values.data();
        case LM_ENERGIES: return r.energy.data();
        case LM_END_STATE: return r.end_state.data();
        case LM_SWITCHINGS: return r.switchings.data();
    }
    return nullptr;
}

int lm_run(lm_simulation* simulation, const lm_signal* inputs, const double* states, const double* capacities,
           double duration, double interval, size_t samples, double* variables) {
    const std::vector<std::string>& names = simulation->simulation.names().inputs;
    if (!(std::isfinite(duration) && duration > 0.0 && std::isfinite(interval) && interval > 0.0))
        return simulation->failed("duration and interval must be > 0 and finite");
    if (samples > 0 && variables == nullptr) return simulation->failed("there is no place for the samples");
    if (!(static_cast<double>(samples) <= 2.0 + duration / interval) || samples > lm::sample_count(duration, interval))
        return simulation->failed("there are more samples than intervals in the duration");
    std::vector<lm::Signal> signals(names.size());
    for (std::size_t i = 0; i < names.size(); ++i)
        if (const std::string wrong = read_signal(inputs[i], signals[i]); !wrong.empty())
            return simulation->failed("input '" + names[i] + "' " + wrong);
    if (const int status = lm_reset(simulation, states, capacities); status != LM_OK) return status;
    lm::TrainOptions options;
    options.duration = duration;
    options.sample_interval = interval;
    options.samples = samples;
    options.energy = false;
    options.max_switchings = 0;
    options.interrupted = Asked::ask;
    options.interrupted_context = &simulation->asked;
    const lm::TrainRun run(simulation->simulation.train().assembly().train());
    const auto& known = simulation->simulation.names();
    std::vector<double> given = list(states, known.states.size()), held = list(capacities, known.capacities.size());
    given.resize(known.states.size());
    held.resize(known.capacities.size());
    const auto [x, memory] = run.in_layout(simulation->simulation.train_start(given, held));
    const lm::Variables& all = simulation->simulation.variables();
    std::vector<double> values(all.size() * samples);
    const lm::TrainReport report = run.run_exactly(signals, x, memory, options, values.data());
    for (std::size_t k = 0; k < samples; ++k) all.derive(values.data(), samples, k);
    std::copy(values.begin(), values.end(), variables);
    return simulation->failed(lm::error_text(report, run.assembly()), static_cast<int>(report.status));
}

}  // extern "C"
