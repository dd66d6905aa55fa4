// The C interface: descriptions of scenarios.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <string>
#include <vector>

#include "objects.hpp"

namespace lm = lostmotion;

std::string read_signal(const lm_signal& from, lm::Signal& to) {
    if (!(from.n_breakpoints > 0 && finite(from.breakpoints, 3 * from.n_breakpoints)) ||
        (from.n_sines > 0 && !finite(from.sines, 3 * from.n_sines)))
        return "has no breakpoint, or a number is not finite";
    std::vector<std::array<double, 3>> breakpoints(from.n_breakpoints), sines(from.n_sines);
    for (std::size_t k = 0; k < from.n_breakpoints; ++k) {
        std::copy_n(from.breakpoints + 3 * k, 3, breakpoints[k].begin());
        if (k > 0 && breakpoints[k][0] <= breakpoints[k - 1][0]) return "has breakpoints that do not rise in time";
    }
    for (std::size_t k = 0; k < from.n_sines; ++k) std::copy_n(from.sines + 3 * k, 3, sines[k].begin());
    to = lm::signal_of(breakpoints, sines);
    return {};
}

extern "C" {

lm_scenario* lm_scenario_read(const double* numbers, size_t n, char* error, size_t error_size) {
    lm_scenario* made = nullptr;
    const std::string wrong = attempted([&]() -> std::string {
        if (numbers == nullptr && n > 0) return "there are no numbers";
        lm::ScenarioDescription description({numbers, n});
        if (description.error().empty()) made = new lm_scenario{description, {}, {}};
        return description.error();
    });
    if (error != nullptr && error_size > 0) {
        const std::size_t length = std::min(wrong.size(), error_size - 1);
        std::memcpy(error, wrong.data(), length);
        error[length] = '\0';
    }
    return made;
}
void lm_scenario_free(lm_scenario* scenario) { delete scenario; }
const char* lm_scenario_error(const lm_scenario* scenario) { return scenario->error.c_str(); }
const char* lm_scenario_title(const lm_scenario* scenario) { return scenario->description.scenario().title.c_str(); }
double lm_scenario_duration(const lm_scenario* scenario) { return scenario->description.scenario().duration; }
double lm_scenario_interval(const lm_scenario* scenario) { return scenario->description.scenario().sample_interval; }

int lm_scenario_set_times(lm_scenario* scenario, double duration, double interval) {
    return scenario->changed(scenario->description.set_times(duration, interval));
}
int lm_scenario_set_signal(lm_scenario* scenario, size_t input, const lm_signal* signal) {
    lm::Signal read;
    std::string wrong = read_signal(*signal, read);
    if (!wrong.empty()) return scenario->changed("the signal " + wrong);
    return scenario->changed(scenario->description.set_input(input, std::move(read)));
}

int lm_scenario_set_reference(lm_scenario* scenario, size_t controller, const double* pieces, size_t n,
                              const double* sines, size_t n_sines) {
    if (!(n > 0 && finite(pieces, 5 * n)) || (n_sines > 0 && !finite(sines, 3 * n_sines)))
        return scenario->changed("the reference has no piece, or a number is not finite");
    lm::control::Reference reference;
    reference.pieces.resize(n);
    for (std::size_t k = 0; k < n; ++k) {
        const double* p = pieces + 5 * k;
        reference.pieces[k] = {p[0], {p[1], p[2], p[3], p[4]}};
        if (k == 0 ? p[0] != 0.0 : !(p[0] > p[-5]))
            return scenario->changed("the reference must begin at 0 s, and its pieces rise in time");
    }
    for (std::size_t k = 0; k < n_sines; ++k)
        reference.sines.push_back({sines[3 * k], sines[3 * k + 1], sines[3 * k + 2]});
    return scenario->changed(scenario->description.set_reference(controller, std::move(reference)));
}

double lm_scenario_input_at_start(const lm_scenario* scenario, size_t input) {
    const lm::Scenario& s = scenario->description.scenario();
    if (input >= s.inputs.size()) return std::nan("");
    return lm::value_at_start(s.inputs[input]);
}

int lm_scenario_give_references(lm_scenario* scenario, int given) {
    return scenario->changed(scenario->description.give_references(given != 0));
}

void lm_scenario_play(lm_scenario* scenario, const int* played, size_t n) {
    scenario->description.play(std::vector<bool>(played, played + n));
}

size_t lm_scenario_parameter_count(const lm_scenario* scenario) { return scenario->description.parameters().size(); }
static const lm::ScenarioParameter* parameter(const lm_scenario* scenario, size_t k) {
    const auto& all = scenario->description.parameters();
    return k < all.size() ? &all[k] : nullptr;
}
const char* lm_scenario_parameter_key(const lm_scenario* scenario, size_t k) {
    const lm::ScenarioParameter* p = parameter(scenario, k);
    return p != nullptr ? p->key.c_str() : nullptr;
}
const char* lm_scenario_parameter_unit(const lm_scenario* scenario, size_t k) {
    const lm::ScenarioParameter* p = parameter(scenario, k);
    return p != nullptr ? p->unit.c_str() : nullptr;
}
double lm_scenario_get(const lm_scenario* scenario, size_t k) {
    const lm::ScenarioParameter* p = parameter(scenario, k);
    return p != nullptr ? p->value : std::nan("");
}
int lm_scenario_set_all(lm_scenario* scenario, const double* values) {
    return scenario->changed(attempted([&]() -> std::string {
        const std::size_t n = scenario->description.parameters().size();
        if (values == nullptr && n > 0) return "there are no values";
        return scenario->description.set_all({values, n});
    }));
}
int lm_scenario_set(lm_scenario* scenario, size_t k, double value) {
    return scenario->changed(attempted([&] { return scenario->description.set(k, value); }));
}

}  // extern "C"
