// The C interface: descriptions of scenarios.
#include <algorithm>
#include <cmath>
#include <cstring>
#include <string>
#include <vector>

#include "objects.hpp"

namespace lm = lostmotion;

std::string read_signal(const lm_signal& from, lm::Signal& to) {
    NumberLists numbers;
    return numbers.list(from.breakpoints, from.n_breakpoints, 3).list(from.sines, from.n_sines, 3).read(to);
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
    lm::control::Reference reference;
    NumberLists numbers;
    const std::string wrong = numbers.list(pieces, n, 5).list(sines, n_sines, 3).read(reference);
    if (!wrong.empty()) return scenario->changed(wrong);
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
