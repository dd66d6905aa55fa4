// An instance of the FMU, whatever the version of the standard: a scenario from the resources, step by step
// (Co-Simulation), or at the points of the importer's integrator (Model Exchange).
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdio>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "variables.hpp"

namespace lostmotion::fmu {

// How a call has ended: FMI 2 and 3 number them alike.
enum Ended : int { ok = 0, warning = 1, discard = 2, error = 3, fatal = 4 };

enum class Kind { model_exchange, co_simulation };

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

    // Back to the beginning, with the values of the parameters that the file has.
    Ended reset() {
        running_ = false;
        if (std::string wrong = read(); !wrong.empty()) return failed(wrong);
        begin();
        return ok;
    }
    void set_start_time(double t) { start_ = time_ = t; }
    void exit_initialization() { running_ = true; }
    double time() const { return is_exchange() ? time_ : start_ + lm_time(simulation_.get()); }

    // --- values by reference ---

    Ended get(unsigned reference, double& value) {
        if (reference == time_reference) {
            value = time();
        } else if (const std::size_t* k = variables_.input(reference)) {
            value = inputs_[*k];
        } else if (const std::size_t* rate = variables_.input_rate(reference)) {
            value = rates_[*rate];
        } else if (is_parameter(reference)) {
            value = lm_scenario_get(scenario_.get(), reference - first_parameter);
        } else if (const std::size_t* output = variables_.output(reference)) {
            if (const Ended e = refresh(); e != ok) return e;
            value = values_[*output];
        } else {
            return get_of_state(reference, value);
        }
        return ok;
    }
    Ended set(unsigned reference, double value) {
        if (!std::isfinite(value)) return failed("a value is not finite");
        if (const std::size_t* k = variables_.input(reference)) {
            if (inputs_[*k] == value) return ok;
            inputs_[*k] = value;
            read_ = false;
            moved_ = true;
            if (!running_) changed_ = true;
            return ok;
        }
        if (variables_.input_rate(reference) != nullptr)
            return set_input_rate(reference - first_input_rate + first_input, 1, value);
        if (!is_parameter(reference)) return unknown(reference);
        const std::size_t k = reference - first_parameter;
        if (lm_scenario_get(scenario_.get(), k) == value) return ok;
        if (lm_scenario_set(scenario_.get(), k, value) != LM_OK)
            return failed(lm_scenario_error(scenario_.get()), discard);
        changed_ = true;
        read_ = false;
        return ok;
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
        if (const Ended e = refresh(); e != ok) return e;
        std::vector<double> dx(states_.size()), du(inputs_.size()), rates(states_.size()), variables(values_.size());
        for (std::size_t k = 0; k < n_knowns; ++k) {
            if (const std::size_t* input = variables_.input(knowns[k]))
                du[*input] += seed[k];
            else if (const std::size_t* state = variables_.state(knowns[k]))
                dx[*state] += seed[k];
            else if (variables_.input_rate(knowns[k]) == nullptr)
                return unknown(knowns[k]);
        }
        if (lm_directional_derivative(simulation_.get(), dx.data(), du.data(), rates.data(), variables.data()) != LM_OK)
            return failed();
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
        if (is_exchange()) return failed("this instance is for Model Exchange");
        if (!(std::isfinite(interval) && interval >= 1e-12 && interval <= 1e12))
            return failed("the communication step must lie between 1e-12 s and 1e12 s");
        if (!(std::fabs(from - time()) <= 1e-3 * interval + 1e-9 * std::fabs(from)))
            return failed("the communication point is " + std::to_string(from) + " s, but the FMU is at " +
                          std::to_string(time()) + " s");
        if (const Ended e = apply(); e != ok) return e;
        end_ = inputs_;
        for (std::size_t k = 0; k < end_.size(); ++k) end_[k] += rates_[k] * interval;
        if (lm_advance(simulation_.get(), interval, inputs_.data(), end_.data()) != LM_OK) return failed();
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
        double next = 0.0;  // [s], of the next tick of the controllers
    };
    // In event mode; of an instance for Co-Simulation nothing.
    Ended settle(Settled& out) {
        if (!is_exchange()) return ok;
        if (const Ended e = place(); e != ok) return e;
        const std::vector<double> before = states_;
        if (lm_settle(simulation_.get()) != LM_OK) return failed();
        lm_states(simulation_.get(), states_.data());
        const double tick = lm_next_tick(simulation_.get());
        out = {states_ != before, std::isfinite(tick), start_ + tick};
        read_ = false;
        return ok;
    }
    // After a step of the integrator. event: whether event mode has to be entered.
    Ended accept(bool& event) {
        if (const Ended e = place(); e != ok) return e;
        event = lm_accept(simulation_.get()) != 0;
        return ok;
    }

    // --- the whole state: parameters, inputs, their derivatives and the simulation ---

    std::size_t state_size() const {
        return head + parameters() + 2 * inputs_.size() + lm_state_size(simulation_.get());
    }
    Ended get_state(std::vector<double>& to) {
        if (const Ended e = is_exchange() ? place() : apply(); e != ok) return e;
        to = {mark, static_cast<double>(state_size()), start_, running_ ? 1.0 : 0.0};
        for (std::size_t k = 0; k < parameters(); ++k) to.push_back(lm_scenario_get(scenario_.get(), k));
        to.insert(to.end(), inputs_.begin(), inputs_.end());
        to.insert(to.end(), rates_.begin(), rates_.end());
        const std::size_t n = to.size();
        to.resize(state_size());
        lm_get_state(simulation_.get(), to.data() + n);
        return ok;
    }
    Ended set_state(const double* from, std::size_t n) {
        if (n != state_size() || from[0] != mark || from[1] != static_cast<double>(n))
            return failed("these bytes are no state of this FMU");
        for (std::size_t k = 0; k < parameters(); ++k) {
            if (lm_scenario_get(scenario_.get(), k) == from[head + k]) continue;
            if (lm_scenario_set(scenario_.get(), k, from[head + k]) != LM_OK)
                return failed(lm_scenario_error(scenario_.get()));
            changed_ = true;
        }
        running_ = false;
        if (const Ended e = apply(); e != ok) return e;
        const double* inputs = from + head + parameters();
        const double* rates = inputs + inputs_.size();
        if (lm_set_state(simulation_.get(), rates + inputs_.size()) != LM_OK) return failed();
        start_ = from[2];
        running_ = from[3] != 0.0;
        inputs_.assign(inputs, rates);
        rates_.assign(rates, rates + inputs_.size());
        time_ = start_ + lm_time(simulation_.get());
        lm_states(simulation_.get(), states_.data());
        read_ = moved_ = false;
        return ok;
    }

    // What the last call that did not end well found wrong.
    const std::string& sentence() const { return sentence_; }
    Ended failed(std::string sentence, Ended how = error) {
        sentence_ = std::move(sentence);
        return how;
    }

 private:
    static constexpr double mark = 19534.0;
    static constexpr std::size_t head = 4;

    bool is_exchange() const { return kind_ == Kind::model_exchange; }
    std::string read() {
        std::vector<double> numbers;
        std::FILE* file = std::fopen(path_.c_str(), "rb");
        if (file == nullptr) return path_ + " cannot be read";
        double buffer[512];
        while (const std::size_t n = std::fread(buffer, sizeof(double), 512, file))
            numbers.insert(numbers.end(), buffer, buffer + n);
        std::fclose(file);
        char wrong[500];
        scenario_.reset(lm_scenario_read(numbers.data(), numbers.size(), wrong, sizeof wrong));
        if (!scenario_) return path_ + ": " + wrong;
        if (!variables_.references_given || lm_scenario_give_references(scenario_.get(), 1) == LM_OK) return {};
        return lm_scenario_error(scenario_.get());
    }
    void begin() {
        make_simulation();
        lm_simulation* s = simulation_.get();
        inputs_.assign(lm_count(s, LM_INPUTS), 0.0);
        rates_.assign(inputs_.size(), 0.0);
        values_.assign(lm_count(s, LM_VARIABLES), 0.0);
        for (std::size_t k = 0; k < inputs_.size(); ++k) inputs_[k] = lm_input_at_start(s, k);
    }
    double usual_step() const { return lm_scenario_interval(scenario_.get()); }
    void make_simulation() {
        simulation_.reset(lm_simulation_from(scenario_.get(), usual_step()));
        states_.assign(lm_count(simulation_.get(), LM_STATES), 0.0);
        lm_states(simulation_.get(), states_.data());
        changed_ = read_ = false;
        moved_ = true;
    }
    // The parameters as they are set into the simulation.
    Ended apply() {
        if (!changed_) return ok;
        if (running_) {
            if (lm_go_on_with(simulation_.get(), scenario_.get(), usual_step()) != LM_OK) return failed();
            changed_ = false;
        } else {
            make_simulation();
        }
        return ok;
    }
    // In Model Exchange: where the importer's integrator is.
    Ended place() {
        if (const Ended e = apply(); e != ok) return e;
        if (!moved_ || !is_exchange()) return ok;
        if (lm_place(simulation_.get(), time_ - start_, states_.data(), inputs_.data()) != LM_OK) return failed();
        moved_ = false;
        return ok;
    }
    // The variables of this instant.
    Ended refresh() {
        if (const Ended e = place(); e != ok) return e;
        if (read_) return ok;
        if (!is_exchange() && lm_hold(simulation_.get(), inputs_.data()) != LM_OK) return failed();
        if (lm_read(simulation_.get(), values_.data()) != LM_OK) return failed();
        read_ = true;
        return ok;
    }
    // A state, its derivative, or an event indicator.
    Ended get_of_state(unsigned reference, double& value) {
        const bool guard = reference >= first_guard && reference - first_guard < indicator_count();
        const std::size_t *state = variables_.state(reference), *derivative = variables_.derivative(reference);
        if (!guard && state == nullptr && derivative == nullptr) return unknown(reference);
        if (const Ended e = refresh(); e != ok) return e;
        scratch_.assign(guard ? std::max(indicator_count(), lm_guard_count(simulation_.get())) : states_.size(), 1.0);
        if (state != nullptr) {
            lm_states(simulation_.get(), scratch_.data());
            value = scratch_[*state];
            return ok;
        }
        if ((guard ? lm_guards : lm_rates)(simulation_.get(), scratch_.data()) != LM_OK) return failed();
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
    double start_ = 0.0, time_ = 0.0;  // [s]; time_: of the importer's integrator
    bool running_ = false;
    bool changed_ = false;  // parameters, since the simulation was made, or inputs before it runs
    bool moved_ = true;     // the importer's integrator, or an input, since it was placed
    bool read_ = false;     // the variables are those of this instant
};

}  // namespace lostmotion::fmu
