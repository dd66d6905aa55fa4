// The C interface: step by step.
#include <algorithm>
#include <cmath>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "lostmotion/analysis/train_linear.hpp"
#include "lostmotion/scenario/linear_model.hpp"
#include "objects.hpp"

namespace lm = lostmotion;

namespace {

bool good_step(double step) { return std::isfinite(step) && step > 0.0; }

struct Named {
    std::string name, unit, meaning;
};
const std::vector<std::string>* names_of(const lm_simulation& s, lm_kind kind) {
    const lm::ScenarioSimulation::Names& n = s.simulation.names();
    return kind == LM_STATES       ? &n.states
           : kind == LM_INPUTS     ? &n.inputs
           : kind == LM_CAPACITIES ? &n.capacities
                                   : nullptr;
}
// The variable of the same name, or nullptr.
const lm::Variable* variable_of(const lm_simulation& s, lm_kind kind, std::size_t k) {
    const std::size_t free = s.simulation.free_inputs();
    if (kind == LM_INPUTS && k >= free) return &s.simulation.names().references[k - free];
    const auto* names = names_of(s, kind);
    const lm::Variables& v = s.simulation.variables();
    const int place = names == nullptr ? static_cast<int>(k) : v.place((*names)[k]);
    return place < 0 ? nullptr : &v.all()[static_cast<std::size_t>(place)];
}

constexpr std::string_view given_speed = "_given_speed";

// The course of a shaft, or nothing and what is wrong.
std::optional<lm::ScenarioSimulation::GivenCourse> read(const lm_motion& motion, const lm::ScenarioSimulation& s,
                                                        std::string& wrong) {
    const std::string name = motion.shaft == nullptr ? "" : motion.shaft;
    const auto given = [](double value) { return std::isnan(value) ? std::nullopt : std::optional(value); };
    const auto shaft = s.given_shaft(name);
    if (!shaft) {
        wrong = "the motion of no shaft '" + name + "' is given; given_motion gives it";
        return {};
    }
    const lm::MotionEnd to{motion.speed, given(motion.position), given(motion.acceleration)};
    if (!std::isfinite(to.speed) || std::isinf(motion.position) || std::isinf(motion.acceleration)) {
        wrong = "the motion of '" + name + "' is not finite, or has no speed";
        return {};
    }
    if (to.angle && shaft->angle < 0) {
        wrong = "the position of '" + name + "' follows from no variable; give its speed and acceleration alone";
        return {};
    }
    return lm::ScenarioSimulation::GivenCourse{*shaft, to};
}
bool is_moved(const lm::ScenarioSimulation& s, const std::string& input,
              const std::vector<lm::ScenarioSimulation::GivenCourse>& courses) {
    return std::ranges::any_of(courses, [&](const auto& c) { return s.names().inputs[c.shaft.speed_input] == input; });
}

// What is wrong with an interval and its inputs, or nothing.
std::string check_interval(const lm::ScenarioSimulation& s, double interval, const double* begin, const double* end) {
    const std::size_t n = s.names().inputs.size();
    if (!(std::isfinite(interval) && interval > 0.0 && s.time() + interval > s.time()))
        return "the interval must be > 0, finite and longer than the rounding of the time";
    return n > 0 && !(finite(begin, n) && finite(end, n)) ? "an input is missing or not finite" : "";
}

bool same_variables(const lm::Variables& a, const lm::Variables& b) {
    return std::equal(a.all().begin(), a.all().end(), b.all().begin(), b.all().end(),
                      [](const lm::Variable& x, const lm::Variable& y) { return x.name == y.name; });
}

}  // namespace

extern "C" {

int lm_train_check(lm_train* train) {
    return train->attempt([&] { return lm::TrainRun(train->description.train).error(); });
}

lm_simulation* lm_simulation_new(lm_train* train, double step) {
    lm_simulation* made = nullptr;
    train->attempt([&]() -> std::string {
        if (!good_step(step)) return "the step must be > 0 and finite";
        std::string wrong = lm::TrainRun(train->description.train).error();
        if (wrong.empty()) made = new lm_simulation(train->description.train, step);
        return wrong;
    });
    return made;
}
lm_simulation* lm_simulation_from(lm_scenario* scenario, double step) {
    lm_simulation* made = nullptr;
    scenario->error = attempted([&]() -> std::string {
        if (!good_step(step)) return "the step must be > 0 and finite";
        made = new lm_simulation(scenario->description.scenario(), step);
        return "";
    });
    return made;
}
int lm_go_on_with(lm_simulation* simulation, lm_scenario* scenario, double step) {
    if (!good_step(step)) return simulation->failed("the step must be > 0 and finite");
    lm_simulation next(scenario->description.scenario(), step);
    const auto &before = simulation->simulation.names(), &after = next.simulation.names();
    if (before.states != after.states || before.inputs != after.inputs)
        return simulation->failed("the scenario has other elements");
    if (!same_variables(simulation->simulation.variables(), next.simulation.variables()))
        return simulation->failed("the scenario has other variables: a dry contact has come or gone");
    next.simulation.go_on_from(simulation->simulation);
    std::swap(simulation->simulation, next.simulation);
    return LM_OK;
}
void lm_simulation_free(lm_simulation* simulation) { delete simulation; }
const char* lm_error(const lm_simulation* simulation) { return simulation->error.c_str(); }

size_t lm_count(const lm_simulation* simulation, lm_kind kind) {
    const auto* names = names_of(*simulation, kind);
    return names != nullptr ? names->size() : simulation->simulation.variables().size();
}
const char* lm_name(const lm_simulation* simulation, lm_kind kind, size_t k) {
    if (k >= lm_count(simulation, kind)) return nullptr;
    const auto* names = names_of(*simulation, kind);
    return names != nullptr ? (*names)[k].c_str() : simulation->simulation.variables().all()[k].name.c_str();
}
const char* lm_unit(const lm_simulation* simulation, lm_kind kind, size_t k) {
    if (k >= lm_count(simulation, kind)) return nullptr;
    if (kind == LM_CAPACITIES) return "N*m";
    const lm::Variable* v = variable_of(*simulation, kind, k);
    return v != nullptr ? v->unit.c_str() : "1";
}
const char* lm_meaning(const lm_simulation* simulation, lm_kind kind, size_t k) {
    if (k >= lm_count(simulation, kind)) return nullptr;
    if (kind == LM_CAPACITIES) return "hysteresis capacity";
    const lm::Variable* v = variable_of(*simulation, kind, k);
    return v != nullptr ? v->meaning.c_str() : "";
}

int lm_reset(lm_simulation* simulation, const double* states, const double* capacities) {
    const auto& names = simulation->simulation.names();
    if (states != nullptr && !finite(states, names.states.size())) return simulation->failed("a state is not finite");
    if (capacities != nullptr && !finite(capacities, names.capacities.size()))
        return simulation->failed("a hysteresis capacity is not finite");
    std::vector<double> x = list(states, names.states.size()), h = list(capacities, names.capacities.size());
    x.resize(names.states.size());
    h.resize(names.capacities.size());
    std::string wrong = simulation->simulation.reset(x, h);
    return wrong.empty() ? int(LM_OK) : simulation->failed(std::move(wrong));
}

int lm_advance(lm_simulation* simulation, double interval, const double* begin, const double* end) {
    return lm_advance_motion(simulation, interval, begin, end, nullptr, 0);
}
int lm_advance_motion(lm_simulation* simulation, double interval, const double* begin, const double* end,
                      const lm_motion* motions, size_t n_motions) {
    lm::ScenarioSimulation& s = simulation->simulation;
    const std::size_t n = s.names().inputs.size();
    if (std::string wrong = check_interval(s, interval, begin, end); !wrong.empty())
        return simulation->failed(std::move(wrong));
    std::vector<lm::ScenarioSimulation::GivenCourse> courses;
    for (std::size_t k = 0; k < n_motions; ++k) {
        std::string wrong;
        if (auto course = read(motions[k], s, wrong))
            courses.push_back(*course);
        else
            return simulation->failed(std::move(wrong));
    }
    if (n_motions > 0)
        for (const std::string& input : s.names().inputs)
            if (input.ends_with(given_speed) && !is_moved(s, input, courses))
                return simulation->failed("the motion of '" + input.substr(0, input.size() - given_speed.size()) +
                                          "' is missing");
    s.motion().set_interrupt(Asked::ask, &simulation->asked);
    const std::span<const double> first(begin, n), last(end, n);
    return simulation->ended(courses.empty() ? s.advance(interval, first, last)
                                             : s.advance(interval, first, last, courses));
}
int lm_advance_answer(lm_simulation* simulation, double interval, const double* begin, const double* end,
                      const char* shaft, lm_answer* answer) {
    lm::ScenarioSimulation& s = simulation->simulation;
    std::string wrong = check_interval(s, interval, begin, end);
    const auto& shafts = s.train().assembly().train().shafts;
    const std::string name = shaft == nullptr ? "" : shaft;
    const auto found = std::ranges::find(shafts, name, &lm::model::Shaft::name);
    const auto load =
        found == shafts.end() ? std::nullopt : s.train().load_shaft(static_cast<int>(found - shafts.begin()));
    if (wrong.empty() && s.follows_signals()) wrong = "an input follows its signal; give all inputs";
    if (wrong.empty() && !load)
        wrong = "the shaft '" + name +
                "' has no load torque of its own: there is none, none acts on it, or a mass matrix joins it to others";
    if (!wrong.empty()) return simulation->failed(std::move(wrong));
    s.motion().set_interrupt(Asked::ask, &simulation->asked);
    const std::size_t n = s.names().inputs.size(), input = s.input_of(load->load);
    lm::LoadAnswer out;
    const int status = simulation->ended(s.answer(interval, {begin, n}, {end, n}, *load, out));
    if (status == LM_OK)
        *answer = {load->inertia * out.acceleration + 0.5 * (begin[input] + end[input]),
                   load->inertia - 1.0 / out.compliance, out.acceleration};
    return status;
}
void lm_set_interrupt(lm_simulation* simulation, int (*interrupted)(void*), void* context) {
    simulation->asked = {interrupted, context};
}
double lm_time(const lm_simulation* simulation) { return simulation->simulation.time(); }

size_t lm_solver_input(const lm_simulation* simulation, size_t input) {
    return input < simulation->simulation.free_inputs() ? simulation->simulation.solver_input(input)
                                                        : static_cast<size_t>(-1);
}
double lm_played_input(const lm_simulation* simulation, size_t input) {
    return simulation->simulation.played_input(input);
}
int lm_hold(lm_simulation* simulation, const double* inputs) {
    const std::size_t n = simulation->simulation.names().inputs.size();
    if (n > 0 && !finite(inputs, n)) return simulation->failed("an input is missing or not finite");
    simulation->simulation.hold({inputs, n});
    return LM_OK;
}
int lm_read(lm_simulation* simulation, double* variables) {
    return simulation->ended(simulation->simulation.read(variables));
}

int lm_place(lm_simulation* simulation, double time, const double* states, const double* inputs) {
    lm::ScenarioSimulation& s = simulation->simulation;
    const std::size_t n = s.names().states.size(), m = s.names().inputs.size();
    if (s.has_windings())
        return simulation->failed("a motor under field-oriented control is solved by this library alone, step by step");
    if (!(std::isfinite(time) && finite(states, n) && (m == 0 || finite(inputs, m))))
        return simulation->failed("the time, a state or an input is missing or not finite");
    s.place(time, {states, n}, {inputs, m});
    return LM_OK;
}
int lm_states(const lm_simulation* simulation, double* states) {
    simulation->simulation.states(states);
    return LM_OK;
}
int lm_rates(lm_simulation* simulation, double* rates) {
    return simulation->ended(simulation->simulation.rates(rates));
}
size_t lm_guard_count(const lm_simulation* simulation) { return simulation->simulation.guard_count(); }
int lm_guards(lm_simulation* simulation, double* guards) {
    return simulation->ended(simulation->simulation.guards(guards));
}
int lm_settle(lm_simulation* simulation) { return simulation->ended(simulation->simulation.settle()); }
double lm_next_event(const lm_simulation* simulation) { return simulation->simulation.next_event(); }
int lm_accept(lm_simulation* simulation) { return simulation->simulation.accept() ? 1 : 0; }

size_t lm_state_size(const lm_simulation* simulation) { return simulation->simulation.state_size(); }
int lm_get_state(const lm_simulation* simulation, double* state) {
    simulation->simulation.get_state(state);
    return LM_OK;
}
int lm_set_state(lm_simulation* simulation, const double* state) {
    if (state == nullptr || !simulation->simulation.set_state(state))
        return simulation->failed("these numbers are not those of a state of this simulation");
    return LM_OK;
}

lm_snapshot* lm_snapshot_new(const lm_simulation* simulation) {
    auto* made = new lm_snapshot;
    lm_snapshot_save(made, simulation);
    return made;
}
void lm_snapshot_save(lm_snapshot* snapshot, const lm_simulation* simulation) {
    simulation->simulation.motion().save(snapshot->of);
}
int lm_snapshot_restore(lm_simulation* simulation, const lm_snapshot* snapshot) {
    return simulation->simulation.restore(snapshot->of) ? int(LM_OK)
                                                        : simulation->failed("the snapshot is of another simulation");
}
void lm_snapshot_free(lm_snapshot* snapshot) { delete snapshot; }

int lm_directional_derivative(lm_simulation* simulation, const double* states, const double* inputs, double* rates,
                              double* variables) {
    return simulation->ended(lm::directional_derivative(simulation->simulation, states, inputs, rates, variables));
}

}  // extern "C"
