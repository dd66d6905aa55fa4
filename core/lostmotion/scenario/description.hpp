// A scenario as a row of numbers that a program without Python can read and alter:
//
//   mark, version, checksum of all that follows, count of the numbers of the scenario, these (scenario.hpp), then its
//   parameters
//
// A parameter is a number of the scenario in the words of its file, such as "load.inertia", with the range that it has
// there, and says which numbers follow from it: each is offset + slope v, or offset + slope/v. A number that follows
// from several is their product, in terms of its present value, if that is not 0 and all of them are without an offset,
// else the sum of their changes.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "checksum.hpp"
#include "scenario.hpp"

namespace lostmotion {

struct Effect {
    int place = 0;  // among the numbers of the scenario
    enum Law { proportional, reciprocal } law = proportional;
    double offset = 0.0, slope = 0.0;

    double operator()(double v) const { return offset + (law == proportional ? slope * v : slope / v); }
};

// What a value may be; infinite where there is no limit.
struct ParameterRange {
    double above = -std::numeric_limits<double>::infinity(), at_least = above, at_most = -above;

    // What is wrong with a value, or nothing.
    std::string refuses(double v) const;
};

struct ScenarioParameter {
    std::string key, unit;
    double value = 0.0;  // SI
    std::vector<Effect> effects;
    ParameterRange range = {};

    template <class F>
    void describe(F& f, long last_place = 1L << 30) {
        f.text("key", key);
        f.text("unit", unit);
        f.number("value", value);
        f.number("above", range.above, Range::bound);
        f.number("at_least", range.at_least, Range::bound);
        f.number("at_most", range.at_most, Range::bound);
        f.each("effects", effects, [&](Effect& e) {
            f.integer("place", e.place, 0, last_place);
            f.choice("law", e.law, {"proportional", "reciprocal"});
            f.number("offset", e.offset);
            f.number("slope", e.slope);
        });
    }
};

class ScenarioDescription {
 public:
    static constexpr double mark = 19533.0;
    // This version of the numbers changes with every parameter that the core describes, and else by hand, in `layout`.
    static double version();
    static constexpr std::size_t head = 4;

    static std::vector<double> write(Scenario scenario, std::vector<ScenarioParameter> parameters = {});
    // The numbers of a scenario with its parameters.
    static std::vector<double> write(const std::vector<double>& body, std::vector<ScenarioParameter> parameters);
    // Of a description, of at least its head.
    static double checksum(std::span<const double> numbers);

    // error(): what is wrong with the numbers, or empty. Then nothing else may be asked for.
    explicit ScenarioDescription(std::span<const double> numbers) { error_ = read(numbers); }

    const std::string& error() const { return error_; }
    const Scenario& scenario() const { return scenario_; }
    const std::vector<ScenarioParameter>& parameters() const { return parameters_; }
    // What these return is wrong with a value, or nothing; then the scenario has changed.
    std::string set(std::size_t k, double value);
    // All at once: what does not fit beside old values may fit beside new ones.
    std::string set_all(std::span<const double> values);
    std::vector<double> values_of_parameters() const;

    std::string set_times(double duration, double interval);
    std::string set_input(std::size_t k, Signal signal);
    // Of a sampled controller, counted as the axes of the scenario.
    std::string set_reference(std::size_t axis, control::Reference reference);
    std::string give_references(bool given);
    // Of the inputs of a simulation.
    void play(std::vector<bool> played);

 private:
    static constexpr unsigned char layout = 13;

    template <class F>
    static void describe(F& f, std::vector<ScenarioParameter>& parameters, std::size_t places) {
        f.each("parameters", parameters, [&](ScenarioParameter& p) { p.describe(f, static_cast<long>(places) - 1); });
    }
    template <class F>
    static void describe(F& f, Scenario& s) {
        lostmotion::describe(f, s);
    }

    std::string read(std::span<const double> numbers);
    std::string read_scenario(std::span<const double> body);
    void use_given();

    // The scenario with the parameters as they are.
    std::string apply();

    std::string error_;
    Scenario scenario_;
    bool references_given_ = false;
    std::vector<bool> played_;
    std::vector<double> body_;  // as it was given
    std::vector<ScenarioParameter> parameters_;
    std::vector<double> initial_;  // values of the parameters that belong to it
    std::map<int, std::vector<std::pair<std::size_t, Effect>>> effects_;
    std::optional<std::pair<double, double>> times_;
    std::map<std::size_t, Signal> inputs_;
    std::map<std::size_t, control::Reference> references_;
};

}  // namespace lostmotion
