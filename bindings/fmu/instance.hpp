// An instance of the FMU, whatever the version of the standard: a scenario from the resources, step by step.
//
// Value references: 0 is the time, 1000 + k the k-th input and 3000 + k the k-th output, in the order of the resource
// names.txt, 10000 + k the k-th parameter of the description (src/lostmotion/portable/fmu_model.py has the same).
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdio>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "../c/lostmotion.h"
#include "resources.hpp"

namespace lostmotion::fmu {

enum Reference : unsigned { time_reference = 0, first_input = 1000, first_output = 3000, first_parameter = 10000 };

// How a call has ended: FMI 2 and 3 number them alike.
enum Ended : int { ok = 0, warning = 1, discard = 2, error = 3, fatal = 4 };

struct Free {
    void operator()(lm_scenario* s) const { lm_scenario_free(s); }
    void operator()(lm_simulation* s) const { lm_simulation_free(s); }
};

class Instance {
 public:
    // directory: of the resources. What is wrong with them is in problem().
    explicit Instance(const std::string& directory) : path_(directory + "/scenario.bin") {
        problem_ = read();
        if (problem_.empty()) begin();
        if (problem_.empty()) problem_ = read_names(directory + "/names.txt");
    }
    // By which modelDescription.xml and resources know each other.
    const std::string& identifier() const { return identifier_; }
    const std::string& problem() const { return problem_; }

    // Back to the beginning, with the values of the parameters that the file has.
    Ended reset() {
        running_ = false;
        if (std::string wrong = read(); !wrong.empty()) return failed(wrong);
        begin();
        return ok;
    }
    void set_start_time(double t) { start_ = t; }
    void exit_initialization() { running_ = true; }
    double time() const { return start_ + lm_time(simulation_.get()); }

    // --- values by reference ---

    Ended get(unsigned reference, double& value) {
        if (reference == time_reference) {
            value = time();
            return ok;
        }
        if (const double* input = input_of(reference)) {
            value = *input;
            return ok;
        }
        if (is_parameter(reference)) {
            value = lm_scenario_get(scenario_.get(), reference - first_parameter);
            return ok;
        }
        if (!is_output(reference)) return unknown(reference);
        if (const Ended e = refresh(); e != ok) return e;
        value = variables_[outputs_[reference - first_output]];
        return ok;
    }
    Ended set(unsigned reference, double value) {
        if (!std::isfinite(value)) return failed("a value is not finite");
        if (double* input = input_of(reference)) {
            if (*input != value) read_ = false;
            *input = value;
            return ok;
        }
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
        if (!is_input(reference)) return unknown(reference);
        if (!std::isfinite(rate)) return failed("the derivative of an input is not finite");
        rates_[input_places_[reference - first_input]] = rate;
        return ok;
    }

    // --- steps ---

    // from: communication point; rounding apart it is where the last step has ended.
    Ended step(double from, double interval) {
        if (!(std::isfinite(interval) && interval >= 1e-12 && interval <= 1e12))
            return failed("the communication step must lie between 1e-12 s and 1e12 s");
        if (!(std::fabs(from - time()) <= 1e-3 * interval + 1e-9 * std::fabs(from)))
            return failed("the communication point is " + std::to_string(from) + " s, but the FMU is at " +
                          std::to_string(time()) + " s");
        if (const Ended e = apply(); e != ok) return e;
        std::vector<double> end = inputs_;
        for (std::size_t k = 0; k < end.size(); ++k) end[k] += rates_[k] * interval;
        if (lm_advance(simulation_.get(), interval, inputs_.data(), end.data()) != LM_OK) return failed();
        read_ = false;
        return ok;
    }

    // Of variables in a direction of the inputs.
    Ended directional_derivative(const unsigned* unknowns, std::size_t n_unknowns, const unsigned* knowns,
                                 const double* seed, std::size_t n_knowns, double* out) {
        if (const Ended e = refresh(); e != ok) return e;
        std::vector<double> du(inputs_.size()), rates(variables_.size());
        for (std::size_t k = 0; k < n_knowns; ++k) {
            if (!is_input(knowns[k])) return unknown(knowns[k]);
            du[input_places_[knowns[k] - first_input]] += seed[k];
        }
        if (lm_directional_derivative(simulation_.get(), nullptr, du.data(), nullptr, rates.data()) != LM_OK)
            return failed();
        for (std::size_t k = 0; k < n_unknowns; ++k) {
            if (!is_output(unknowns[k])) return unknown(unknowns[k]);
            out[k] = rates[outputs_[unknowns[k] - first_output]];
        }
        return ok;
    }

    // --- the whole state: parameters, inputs, their derivatives and the simulation ---

    std::size_t state_size() const {
        return head + parameters() + 2 * inputs_.size() + lm_state_size(simulation_.get());
    }
    Ended get_state(std::vector<double>& to) {
        if (const Ended e = apply(); e != ok) return e;
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
        read_ = false;
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
        return scenario_ ? "" : path_ + ": " + wrong;
    }
    // Lines: the identifier, then "input" or "output" and a name each.
    std::string read_names(const std::string& path) {
        const std::string text = text_of_file(path);
        std::size_t at = 0;
        const auto line = [&] {
            const std::size_t end = std::min(text.find('\n', at), text.size());
            const std::string found = text.substr(at, end - at);
            at = end + 1;
            return found;
        };
        identifier_ = line();
        if (identifier_.empty()) return path + " cannot be read";
        while (at < text.size()) {
            const std::string here = line(), kind = here.substr(0, here.find(' '));
            const std::string name = here.substr(std::min(here.size(), kind.size() + 1));
            const bool input = kind == "input";
            const lm_kind of = input ? LM_INPUTS : LM_VARIABLES;
            const std::size_t n = lm_count(simulation_.get(), of);
            std::size_t k = 0;
            while (k < n && name != lm_name(simulation_.get(), of, k)) ++k;
            if (k == n) return path + ": there is no " + kind + " '" + name + "'";
            (input ? input_places_ : outputs_).push_back(k);
        }
        return {};
    }
    void begin() {
        make_simulation();
        lm_simulation* s = simulation_.get();
        inputs_.assign(lm_count(s, LM_INPUTS), 0.0);
        rates_.assign(inputs_.size(), 0.0);
        variables_.assign(lm_count(s, LM_VARIABLES), 0.0);
        for (std::size_t k = 0; k < inputs_.size(); ++k)
            inputs_[k] = lm_scenario_input_at_start(scenario_.get(), lm_solver_input(s, k));
        changed_ = read_ = false;
    }
    double usual_step() const { return lm_scenario_interval(scenario_.get()); }
    void make_simulation() { simulation_.reset(lm_simulation_from(scenario_.get(), usual_step())); }
    // The parameters as they are set into the simulation.
    Ended apply() {
        if (!changed_) return ok;
        if (running_) {
            if (lm_go_on_with(simulation_.get(), scenario_.get(), usual_step()) != LM_OK) return failed();
        } else {
            make_simulation();
        }
        changed_ = false;
        return ok;
    }
    // The variables of this instant.
    Ended refresh() {
        if (read_) return ok;
        if (const Ended e = apply(); e != ok) return e;
        if (lm_hold(simulation_.get(), inputs_.data()) != LM_OK) return failed();
        if (lm_read(simulation_.get(), variables_.data()) != LM_OK) return failed();
        read_ = true;
        return ok;
    }
    std::size_t parameters() const { return lm_scenario_parameter_count(scenario_.get()); }
    bool is_parameter(unsigned r) const { return r >= first_parameter && r - first_parameter < parameters(); }
    bool is_input(unsigned r) const { return r >= first_input && r - first_input < input_places_.size(); }
    bool is_output(unsigned r) const { return r >= first_output && r - first_output < outputs_.size(); }
    double* input_of(unsigned r) { return is_input(r) ? &inputs_[input_places_[r - first_input]] : nullptr; }
    Ended failed() { return failed(lm_error(simulation_.get())); }
    Ended unknown(unsigned reference) {
        return failed("there is no variable with the value reference " + std::to_string(reference) +
                      ", or not for this use");
    }

    std::string path_, problem_, identifier_, sentence_;
    std::unique_ptr<lm_scenario, Free> scenario_;
    std::unique_ptr<lm_simulation, Free> simulation_;
    std::vector<double> inputs_, rates_, variables_;   // by their numbers in the simulation
    std::vector<std::size_t> input_places_, outputs_;  // of those that are declared
    double start_ = 0.0;
    bool running_ = false;
    bool changed_ = false;  // parameters, since the simulation was made
    bool read_ = false;     // the variables are those of this instant
};

}  // namespace lostmotion::fmu
