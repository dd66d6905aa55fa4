// An instance of the FMU, whatever the version of the standard: a scenario from the resources, step by step
// (Co-Simulation), or at the points of the importer's integrator (Model Exchange).
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "lostmotion/base/decimal.hpp"
#include "variables.hpp"

namespace lostmotion::fmu {

// How a call has ended: FMI 2 and 3 number them alike.
enum Ended : int { ok = 0, warning = 1, discard = 2, error = 3, fatal = 4 };

enum class Kind { model_exchange, co_simulation };

// What is under way, by which the standards say which functions may be called.
enum Mode : unsigned {
    instantiated = 1,
    initialization = 2,
    event = 4,
    continuous = 8,
    between_steps = 16,
    terminated = 32,
    exchanged = initialization | event | continuous | terminated,
    started = event | continuous | between_steps,
    running = started | terminated,
    readable = initialization | running,
    before_termination = instantiated | initialization | started
};

// Such as "in event mode, between steps".
inline std::string words_of(unsigned modes) {
    const char* const words[] = {"before initialization",   "in initialization mode", "in event mode",
                                 "in continuous-time mode", "between steps",          "after termination"};
    std::string text;
    for (unsigned k = 0; k < 6; ++k)
        if ((modes & 1u << k) != 0) text += (text.empty() ? "" : ", ") + std::string(words[k]);
    return text;
}

struct Free {
    void operator()(lm_scenario* s) const { lm_scenario_free(s); }
    void operator()(lm_simulation* s) const { lm_simulation_free(s); }
};

class Instance {
 public:
    // directory: of the resources. What is wrong with them is in problem().
    Instance(const std::string& directory, Kind kind) : kind_(kind), path_(directory + "/scenario.bin") {
        const std::string names = directory + "/names.txt";
        problem_ = variables_.read(names);
        if (problem_.empty()) problem_ = read();
        if (problem_.empty()) begin();
        if (problem_.empty()) problem_ = variables_.find(simulation_.get(), names);
        if (problem_.empty() && kind_ == Kind::model_exchange && place() != ok) problem_ = sentence_;
    }
    const std::string& identifier() const { return variables_.identifier; }
    const std::string& problem() const { return problem_; }
    Kind kind() const { return kind_; }

    Mode mode() const { return mode_; }
    Ended enter(Mode mode) {
        mode_ = mode;
        return ok;
    }

    // Back to the beginning, with the values of the parameters that the file has.
    Ended reset() {
        if (std::string wrong = read(); !wrong.empty()) return failed(wrong);
        mode_ = instantiated;
        start_ = time_ = 0.0;
        begin();
        return ok;
    }
    Ended set_start_time(double t) {
        if (!std::isfinite(t)) return failed("the start time is not finite");
        start_ = time_ = t;
        return ok;
    }
    Ended exit_initialization() {
        if (const Ended e = place(); e != ok) return e;
        return enter(is_exchange() ? event : between_steps);
    }
    double time() const { return is_exchange() ? time_ : start_ + lm_time(simulation_.get()); }

    // --- values by reference ---

    Ended get(unsigned reference, double& value) {
        if (reference == time_reference) {
            value = time();
        } else if (const std::size_t* k = variables_.input(reference)) {
            if (const Ended e = place(); e != ok) return e;
            if (!given_[*k]) return get_unset(*k, value);
            value = inputs_[*k];
        } else if (const std::size_t* rate = variables_.input_rate(reference)) {
            value = rates_[*rate];
        } else if (is_parameter(reference)) {
            value = lm_scenario_get(scenario_.get(), reference - first_parameter);
        } else if (const std::size_t* output = variables_.output(reference)) {
            if (const Ended e = uncommitted([this] { return refresh(); }); e != ok) return e;
            value = values_[*output];
        } else {
            return get_of_state(reference, value);
        }
        return ok;
    }
    // Parameters are set all at once, or none.
    Ended set(const unsigned* references, std::size_t n, const double* values) {
        std::vector<double> wanted;
        for (std::size_t j = 0; j < n; ++j) {
            const unsigned reference = references[j];
            if (!std::isfinite(values[j])) return failed("a value is not finite");
            if (is_parameter(reference)) {
                if (wanted.empty()) wanted = values_of_parameters();
                wanted[reference - first_parameter] = values[j];
            } else if (const std::size_t* state = variables_.state(reference)) {
                if (const Ended e = set_one_state(*state, values[j]); e != ok) return e;
            } else if (const Ended e = set_input(reference, values[j]); e != ok) {
                return e;
            }
        }
        return wanted.empty() ? ok : set_parameters(wanted);
    }
    // Of an input, by its own reference; only the first derivative is taken.
    Ended set_input_rate(unsigned reference, int order, double rate) {
        if (order != 1) return failed("an input has its first time derivative alone");
        const std::size_t* k = variables_.input(reference);
        if (k == nullptr) return unknown(reference);
        if (!std::isfinite(rate)) return failed("the derivative of an input is not finite");
        rates_[*k] = rate;
        return ok;
    }

    // Of variables or derivatives in a direction of inputs and states.
    Ended directional_derivative(const unsigned* unknowns, std::size_t n_unknowns, const unsigned* knowns,
                                 const double* seed, std::size_t n_knowns, double* out) {
        std::vector<double> dx(states_.size()), du(inputs_.size()), rates(states_.size()), variables(values_.size());
        for (std::size_t k = 0; k < n_knowns; ++k) {
            if (const std::size_t* input = variables_.input(knowns[k]))
                du[*input] += seed[k];
            else if (const std::size_t* state = variables_.state(knowns[k]))
                dx[*state] += seed[k];
            else if (is_parameter(knowns[k]))
                return failed(std::string("derivatives are given by inputs and states alone, not by the parameter ") +
                              lm_scenario_parameter_key(scenario_.get(), knowns[k] - first_parameter));
            else if (knowns[k] == time_reference ? !all_given() : variables_.input_rate(knowns[k]) == nullptr)
                return unknown(knowns[k]);
        }
        const Ended found = uncommitted([&] {
            if (const Ended e = hold(); e != ok) return e;
            lm_simulation* simulation = simulation_.get();
            return lm_directional_derivative(simulation, dx.data(), du.data(), rates.data(), variables.data()) == LM_OK
                       ? ok
                       : failed();
        });
        if (found != ok) return found;
        for (std::size_t k = 0; k < n_unknowns; ++k) {
            if (const std::size_t* output = variables_.output(unknowns[k]))
                out[k] = variables[*output];
            else if (const std::size_t* derivative = variables_.derivative(unknowns[k]))
                out[k] = rates[*derivative];
            else
                return unknown(unknowns[k]);
        }
        return ok;
    }

    // --- Co-Simulation ---

    // from: communication point; rounding apart it is where the last step has ended.
    Ended step(double from, double interval) {
        if (!(std::isfinite(interval) && interval >= 1e-12 && interval <= 1e12))
            return failed("the communication step must lie between 1e-12 s and 1e12 s");
        if (!(std::isfinite(from) && std::fabs(from - time()) <= 1e-3 * interval + 1e-9 * std::fabs(from)))
            return failed("the communication point is " + general_text(from, 9) + " s, but the FMU is at " +
                          general_text(time(), 9) + " s");
        if (const Ended e = apply(); e != ok) return e;
        end_ = inputs_;
        for (std::size_t k = 0; k < end_.size(); ++k) end_[k] += rates_[k] * interval;
        const std::vector<lm_motion> motions = motions_over(interval);
        // The first step begins with the acceleration of its inputs.
        if (!motions.empty()) lm_hold(simulation_.get(), inputs_.data());
        if (lm_advance_motion(simulation_.get(), interval, inputs_.data(), end_.data(), motions.data(),
                              motions.size()) != LM_OK)
            return failed();
        committed_ = true;
        read_ = false;
        return ok;
    }

    // --- Model Exchange ---

    std::size_t state_count() const { return variables_.states.size(); }
    // As many as are declared, which may be more than the simulation has guards.
    std::size_t indicator_count() const { return variables_.indicators; }
    const std::vector<double>& nominals() const { return variables_.nominals; }
    Ended set_time(double t) {
        if (!std::isfinite(t)) return failed("the time is not finite");
        time_ = t;
        moved_ = true;
        read_ = false;
        return ok;
    }
    Ended set_states(const double* x, std::size_t n) {
        if (n != state_count()) return failed("the FMU has " + std::to_string(state_count()) + " continuous states");
        for (std::size_t k = 0; k < n; ++k) {
            if (!std::isfinite(x[k])) return failed("a continuous state is not finite", discard);
            states_[variables_.states[k]] = x[k];
        }
        at_points_ = false;
        moved_ = true;
        read_ = false;
        return ok;
    }
    Ended get_states(double* x, std::size_t n) {
        if (n != state_count()) return failed("the FMU has " + std::to_string(state_count()) + " continuous states");
        if (const Ended e = place(); e != ok) return e;
        for (std::size_t k = 0; k < n; ++k) x[k] = states_[variables_.states[k]];
        return ok;
    }
    Ended get_derivatives(double* out, std::size_t n) {
        if (n != state_count()) return failed("the FMU has " + std::to_string(state_count()) + " continuous states");
        if (const Ended e = place(); e != ok) return e;
        scratch_.resize(states_.size());
        if (lm_rates(simulation_.get(), scratch_.data()) != LM_OK) return failed();
        for (std::size_t k = 0; k < n; ++k) out[k] = scratch_[variables_.states[k]];
        return ok;
    }
    Ended get_guards(double* out, std::size_t n) {
        if (n != indicator_count() || n < lm_guard_count(simulation_.get()))
            return failed("the FMU has " + std::to_string(indicator_count()) + " event indicators");
        if (const Ended e = place(); e != ok) return e;
        std::fill_n(out, n, 1.0);
        return lm_guards(simulation_.get(), out) == LM_OK ? ok : failed();
    }
    struct Settled {
        bool states_changed = false, has_next = false;
        double next = 0.0;  // [s], of the next tick of the controllers or breakpoint of a signal
    };
    Ended settle(Settled& out) {
        if (const Ended e = place(); e != ok) return e;
        at_points_ = false;
        const std::vector<double> before = states_;
        if (lm_settle(simulation_.get()) != LM_OK) return failed();
        lm_states(simulation_.get(), states_.data());
        next_event_ = lm_next_event(simulation_.get());
        out = {states_ != before, std::isfinite(next_event_), start_ + next_event_};
        read_ = false;
        return ok;
    }
    // After a step of the integrator. event: whether event mode has to be entered.
    Ended accept(bool& event) {
        if (const Ended e = place(); e != ok) return e;
        event = lm_accept(simulation_.get()) != 0;
        return ok;
    }

    // --- the whole state: mode, parameters, inputs, their derivatives, whether they are given, and the simulation ---

    std::size_t state_size() const {
        return head + parameters() + 3 * inputs_.size() + lm_state_size(simulation_.get());
    }
    Ended get_state(std::vector<double>& to) {
        if (const Ended e = is_exchange() ? place() : apply(); e != ok) return e;
        to = {mark, static_cast<double>(state_size()), start_, static_cast<double>(mode_)};
        for (std::size_t k = 0; k < parameters(); ++k) to.push_back(lm_scenario_get(scenario_.get(), k));
        to.insert(to.end(), inputs_.begin(), inputs_.end());
        to.insert(to.end(), rates_.begin(), rates_.end());
        to.insert(to.end(), given_.begin(), given_.end());
        const std::size_t n = to.size();
        to.resize(state_size());
        lm_get_state(simulation_.get(), to.data() + n);
        return ok;
    }
    // If it is refused, all stays as it was.
    Ended set_state(const double* from, std::size_t n) {
        const std::size_t numbers = head + parameters() + 3 * inputs_.size();
        if (n <= numbers || from[0] != mark || from[1] != static_cast<double>(n) ||
            !std::all_of(from, from + numbers, [](double number) { return std::isfinite(number); }) ||
            !mode_of(from[3]))
            return failed("these bytes are no state of this FMU");
        const std::vector<double> before = values_of_parameters();
        const std::vector<int> given_before = given_;
        const double* inputs = from + head + parameters();
        const double* rates = inputs + inputs_.size();
        const double* given = rates + inputs_.size();
        if (lm_scenario_set_all(scenario_.get(), from + head) != LM_OK)
            return failed(lm_scenario_error(scenario_.get()));
        given_.assign(given, given + inputs_.size());
        std::unique_ptr<lm_simulation, Free> other;
        if (changed_ || values_of_parameters() != before || given_ != given_before) other = simulation_now();
        lm_simulation* to = other ? other.get() : simulation_.get();
        if (numbers + lm_state_size(to) != n || lm_set_state(to, given + inputs_.size()) != LM_OK) {
            lm_scenario_set_all(scenario_.get(), before.data());
            given_ = given_before;
            return failed("these bytes are no state of this FMU");
        }
        if (other) use(std::move(other));
        start_ = from[2];
        mode_ = static_cast<Mode>(mode_of(from[3]));
        inputs_.assign(inputs, rates);
        rates_.assign(rates, rates + inputs_.size());
        time_ = start_ + lm_time(simulation_.get());
        lm_states(simulation_.get(), states_.data());
        next_event_ = lm_next_event(simulation_.get());
        start_states_.clear();
        unmoved_.clear();
        changed_ = read_ = moved_ = committed_ = at_points_ = false;
        return ok;
    }

    // What the last call that did not end well found wrong.
    const std::string& sentence() const { return sentence_; }
    Ended failed(std::string sentence, Ended how = error) {
        sentence_ = std::move(sentence);
        return how;
    }

 private:
    static constexpr double mark = 19535.0;
    static constexpr std::size_t head = 4;

    bool is_exchange() const { return kind_ == Kind::model_exchange; }
    bool is_running() const { return (mode_ & running) != 0; }
    // The mode of this number, or 0 if an instance of this kind has none such.
    unsigned mode_of(double number) const {
        for (const Mode m : {instantiated, initialization, event, continuous, between_steps, terminated})
            if (number == static_cast<double>(m) && (m & (is_exchange() ? between_steps : event | continuous)) == 0)
                return m;
        return 0;
    }
    std::string read() {
        const std::vector<double> numbers = numbers_of_file(path_);
        if (numbers.empty()) return path_ + " cannot be read";
        char wrong[500];
        std::unique_ptr<lm_scenario, Free> found(lm_scenario_read(numbers.data(), numbers.size(), wrong, sizeof wrong));
        if (!found) return path_ + ": " + wrong;
        if (variables_.references_given && lm_scenario_give_references(found.get(), 1) != LM_OK)
            return lm_scenario_error(found.get());
        scenario_ = std::move(found);
        return {};
    }
    void begin() {
        given_.assign(variables_.input_names.size() + variables_.motions.size(), 0);
        start_states_.clear();
        make_simulation();
        inputs_.assign(given_.size(), 0.0);
        rates_.assign(inputs_.size(), 0.0);
    }
    double usual_step() const { return lm_scenario_interval(scenario_.get()); }
    bool all_given() const {
        return std::all_of(given_.begin(), given_.end(), [](int given) { return given != 0; });
    }
    // The scenario with the parameters as they are; inputs that the importer has not set follow its signals.
    lm_scenario* scenario_now() const {
        std::vector<int> played;
        for (const int given : given_) played.push_back(given == 0);
        lm_scenario_play(scenario_.get(), played.data(), played.size());
        return scenario_.get();
    }
    // From its start.
    std::unique_ptr<lm_simulation, Free> simulation_now() const {
        return std::unique_ptr<lm_simulation, Free>(lm_simulation_from(scenario_now(), usual_step()));
    }
    void make_simulation() {
        use(simulation_now());
        for (const auto& [state, value] : start_states_) states_[state] = value;
        changed_ = false;
    }
    static std::vector<double> numbers_of(const lm_simulation* simulation) {
        std::vector<double> numbers(lm_state_size(simulation));
        lm_get_state(simulation, numbers.data());
        return numbers;
    }
    // Its variables may lie in other places than those of the one before: a dry contact has some.
    void use(std::unique_ptr<lm_simulation, Free> simulation) {
        simulation_ = std::move(simulation);
        unmoved_.clear();
        variables_.find(simulation_.get(), "");
        values_.assign(lm_count(simulation_.get(), LM_VARIABLES), 0.0);
        states_.assign(lm_count(simulation_.get(), LM_STATES), 0.0);
        lm_states(simulation_.get(), states_.data());
        read_ = committed_ = false;
        moved_ = true;
    }

    Ended set_input(unsigned reference, double value) {
        const std::size_t* k = variables_.input(reference);
        if (k == nullptr)
            return variables_.input_rate(reference) != nullptr
                       ? set_input_rate(reference - first_input_rate + first_input, 1, value)
                       : unknown(reference);
        if (given_[*k] && inputs_[*k] == value) return ok;
        if (const Ended e = give(*k); e != ok) return e;
        inputs_[*k] = value;
        read_ = false;
        moved_ = true;
        if (!is_running()) changed_ = true;
        return ok;
    }
    // An input that the importer has not set: of its signal, or the position that a shaft has.
    Ended get_unset(std::size_t input, double& value) {
        const Variables::Motion* motion = variables_.motion_of(input);
        if (motion == nullptr || input != motion->position) {
            value = lm_played_input(simulation_.get(), input);
            return ok;
        }
        if (const Ended e = uncommitted([this] { return refresh(); }); e != ok) return e;
        value = values_[motion->variable];
        return ok;
    }
    // What is given for the end of a step, of the shafts whose position is an input: by the time derivatives of their
    // inputs, or without these by speed and acceleration.
    std::vector<lm_motion> motions_over(double interval) const {
        std::vector<lm_motion> out;
        for (const Variables::Motion& m : variables_.motions) {
            if (!given_[m.position]) continue;
            const double p = inputs_[m.position], v = inputs_[m.speed], a = inputs_[m.acceleration];
            if (rates_[m.position] != 0.0 || rates_[m.speed] != 0.0 || rates_[m.acceleration] != 0.0)
                out.push_back({m.shaft.c_str(), end_[m.position], end_[m.speed], end_[m.acceleration]});
            else
                out.push_back({m.shaft.c_str(), p + interval * (v + 0.5 * interval * a), v + interval * a, a});
        }
        return out;
    }
    // From now on an input is what the importer sets: the simulation goes on where it is, without the signal. Position,
    // speed and acceleration of a shaft belong together: those that are not set yet stay what they are.
    Ended give(std::size_t input) {
        if (given_[input]) return ok;
        if (const Ended e = apply(); e != ok) return e;
        if (const Variables::Motion* m = variables_.motion_of(input); m != nullptr) {
            for (const std::size_t k : {m->position, m->speed, m->acceleration})
                if (const Ended e = get_unset(k, inputs_[k]); e != ok) return e;
            for (const std::size_t k : {m->position, m->speed, m->acceleration}) given_[k] = 1;
        }
        given_[input] = 1;
        const std::vector<double> kept = numbers_of(simulation_.get());
        simulation_ = simulation_now();
        lm_set_state(simulation_.get(), kept.data());
        return ok;
    }
    // In continuous-time mode: the importer asks for points of its choice, each of which has the regime that a start
    // there has. Before: a value of the start.
    Ended set_one_state(std::size_t state, double value) {
        if (!is_exchange() && is_running())
            return failed("states of an FMU for Co-Simulation are set before the first step alone");
        if (!is_running()) start_states_[state] = value;
        at_points_ = mode_ == continuous;
        states_[state] = value;
        moved_ = true;
        read_ = false;
        return ok;
    }
    std::vector<double> values_of_parameters() const {
        std::vector<double> values(parameters());
        for (std::size_t k = 0; k < values.size(); ++k) values[k] = lm_scenario_get(scenario_.get(), k);
        return values;
    }
    Ended set_parameters(const std::vector<double>& wanted) {
        const std::vector<double> before = values_of_parameters();
        if (wanted == before) return ok;
        for (std::size_t k = 0; k < wanted.size() && is_running(); ++k) {
            const std::string key = lm_scenario_parameter_key(scenario_.get(), k);
            if (wanted[k] != before[k] && key.starts_with("initial."))
                return failed("parameter " + key + " is of the start; set it before the first step", discard);
        }
        if (lm_scenario_set_all(scenario_.get(), wanted.data()) != LM_OK)
            return failed(lm_scenario_error(scenario_.get()), discard);
        auto next = simulation_now();
        if (std::string wrong = lost_variable(next.get()); !wrong.empty()) {
            lm_scenario_set_all(scenario_.get(), before.data());
            return failed(wrong, discard);
        }
        changed_ = true;
        read_ = false;
        return ok;
    }
    // An output that there would no longer be in another simulation, or a variable that one which runs has not.
    std::string lost_variable(const lm_simulation* next) const {
        Variables found = variables_;
        const std::string wrong = found.find(next, "with these values of the parameters");
        if (!wrong.empty()) return wrong + ", which this FMU has; take a small friction in place of 0";
        if (is_running() && lm_count(next, LM_VARIABLES) != values_.size())
            return "with these values of the parameters there is a dry contact more; set them before the first step";
        return {};
    }
    // The parameters as they are set into the simulation.
    Ended apply() {
        if (!changed_) return ok;
        if (is_running()) {
            if (lm_go_on_with(simulation_.get(), scenario_now(), usual_step()) != LM_OK) return failed();
            unmoved_.clear();
            changed_ = committed_ = false;
            moved_ = true;
        } else {
            make_simulation();
        }
        return ok;
    }
    // In Model Exchange: where the importer's integrator is. In Co-Simulation: at a start that the importer has set.
    Ended place() {
        if (const Ended e = apply(); e != ok) return e;
        if (!moved_ || !(is_exchange() || (!is_running() && !start_states_.empty()))) return ok;
        if (at_points_) {
            if (unmoved_.empty()) unmoved_ = numbers_of(simulation_now().get());
            lm_set_state(simulation_.get(), unmoved_.data());
        }
        const double time = time_ == start_ + next_event_ ? next_event_ : time_ - start_;
        if (lm_place(simulation_.get(), time, states_.data(), inputs_.data()) != LM_OK) return failed();
        moved_ = false;
        return ok;
    }
    // What is read before the first step, or after a change of parameters before the next, commits nothing: neither the
    // modes of the contacts nor a tick of the controllers, since inputs may still change at this instant.
    template <class Read>
    Ended uncommitted(Read&& reads) {
        if (const Ended e = place(); e != ok) return e;
        if (is_exchange() ? is_running() : committed_) return reads();
        const std::vector<double> kept = numbers_of(simulation_.get());
        const Ended e = reads();
        lm_set_state(simulation_.get(), kept.data());
        moved_ = true;
        return e;
    }
    // The inputs of this instant.
    Ended hold() {
        if (const Ended e = place(); e != ok) return e;
        return is_exchange() || lm_hold(simulation_.get(), inputs_.data()) == LM_OK ? ok : failed();
    }
    // The variables of this instant.
    Ended refresh() {
        if (read_) return ok;
        if (const Ended e = hold(); e != ok) return e;
        if (lm_read(simulation_.get(), values_.data()) != LM_OK) return failed();
        read_ = true;
        return ok;
    }
    // A state, its derivative, or an event indicator.
    Ended get_of_state(unsigned reference, double& value) {
        const bool guard = reference >= first_guard && reference - first_guard < indicator_count();
        const std::size_t *state = variables_.state(reference), *derivative = variables_.derivative(reference);
        if (!guard && state == nullptr && derivative == nullptr) return unknown(reference);
        scratch_.assign(guard ? std::max(indicator_count(), lm_guard_count(simulation_.get())) : states_.size(), 1.0);
        if (state != nullptr) {
            if (const Ended e = place(); e != ok) return e;
            lm_states(simulation_.get(), scratch_.data());
            value = scratch_[*state];
            return ok;
        }
        const Ended found = uncommitted([&] {
            if (const Ended e = hold(); e != ok) return e;
            return (guard ? lm_guards : lm_rates)(simulation_.get(), scratch_.data()) == LM_OK ? ok : failed();
        });
        if (found != ok) return found;
        value = scratch_[guard ? reference - first_guard : *derivative];
        return ok;
    }
    std::size_t parameters() const { return lm_scenario_parameter_count(scenario_.get()); }
    bool is_parameter(unsigned r) const { return r >= first_parameter && r - first_parameter < parameters(); }
    Ended failed() { return failed(lm_error(simulation_.get())); }
    Ended unknown(unsigned reference) {
        return failed("there is no variable with the value reference " + std::to_string(reference) +
                      ", or not for this use");
    }

    Kind kind_;
    std::string path_, problem_, sentence_;
    Variables variables_;
    std::unique_ptr<lm_scenario, Free> scenario_;
    std::unique_ptr<lm_simulation, Free> simulation_;
    std::vector<double> inputs_, rates_, end_, values_, states_;  // by their numbers in the simulation
    std::vector<double> scratch_;
    std::vector<int> given_;                      // whether the importer has set an input
    std::map<std::size_t, double> start_states_;  // that the importer has set
    std::vector<double> unmoved_;                 // the simulation at its start, if it has been asked for
    double start_ = 0.0, time_ = 0.0;             // [s]; time_: of the importer's integrator
    double next_event_ = 0.0;                     // [s] since the start
    Mode mode_ = instantiated;
    bool at_points_ = false;  // states are set one by one, not by an integrator
    bool changed_ = false;    // parameters, since the simulation was made, or inputs before it runs
    bool moved_ = true;       // the importer's integrator, or an input, since it was placed
    bool read_ = false;       // the variables are those of this instant
    bool committed_ = false;  // the simulation has begun to move with these parameters
};

}  // namespace lostmotion::fmu
