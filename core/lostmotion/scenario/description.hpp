// A scenario as a row of numbers that a program without Python can read and alter:
//
//   mark, version, checksum of all that follows, count of the numbers of the scenario, these (scenario.hpp), then its
//   parameters
//
// A parameter is a number of the scenario in the words of its file, such as "load.inertia", with the range that it has
// there. How the numbers of the scenario follow from the parameters is a derivation: formulas, each of those before it,
// the comparisons on which it depends, and the places of its results. So a changed scenario has the same bits as one
// that is made anew of its file.
#pragma once

#include <algorithm>
#include <cmath>
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

// How numbers follow from parameters.
struct Derivation {
    struct Formula {
        enum Law {
            parameter,
            constant,
            sum,
            difference,
            product,
            quotient,
            root,
            sine,
            cosine,
            arctangent,
            cube_root,
            worm_driving,
            worm_overrunning
        };
        Law law = constant;
        int one = 0, other = 0;  // formulas before this one, or the number of a parameter
        double value = 0.0;      // of a constant
    };
    // The formulas hold as long as the comparison of two of them turns out so.
    struct Condition {
        enum Comparison { less, at_most, equal } comparison = less;
        int one = 0, other = 0;
        bool holds = true;
    };
    struct Result {
        int place = 0, formula = 0;  // place: among the numbers of the scenario
    };
    static constexpr std::initializer_list<const char*> laws = {
        "parameter", "constant", "sum",        "difference", "product",      "quotient",        "root",
        "sine",      "cosine",   "arctangent", "cube_root",  "worm_driving", "worm_overrunning"};
    static constexpr std::initializer_list<const char*> comparisons = {"less", "at_most", "equal"};

    std::vector<Formula> formulas;
    std::vector<Condition> conditions;
    std::vector<Result> results;

    // The values of all formulas, or nothing where a condition is not met.
    std::optional<std::vector<double>> values(std::span<const double> parameters) const;

    template <class F>
    void describe(F& f, std::size_t parameters, std::size_t places) {
        long before = 0;
        f.each("formulas", formulas, [&](Formula& formula) {
            f.choice("law", formula.law, laws);
            const long most = formula.law == Formula::parameter  ? static_cast<long>(parameters) - 1
                              : formula.law == Formula::constant ? 0
                                                                 : before - 1;
            f.integer("one", formula.one, 0, most);
            f.integer("other", formula.other, 0, most);
            f.number("value", formula.value, Range::bound);
            ++before;
        });
        f.each("conditions", conditions, [&](Condition& c) {
            f.choice("comparison", c.comparison, comparisons);
            f.integer("one", c.one, 0, before - 1);
            f.integer("other", c.other, 0, before - 1);
            f.flag("holds", c.holds);
        });
        f.each("results", results, [&](Result& r) {
            f.integer("place", r.place, 0, static_cast<long>(places) - 1);
            f.integer("formula", r.formula, 0, before - 1);
        });
    }
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
    ParameterRange range = {};

    template <class F>
    void describe(F& f) {
        f.text("key", key);
        f.text("unit", unit);
        f.number("value", value);
        f.number("above", range.above, Range::bound);
        f.number("at_least", range.at_least, Range::bound);
        f.number("at_most", range.at_most, Range::bound);
    }
};

class ScenarioDescription {
 public:
    static constexpr double mark = 19533.0;
    // This version of the numbers changes with every parameter that the core describes, and else by hand, in `layout`.
    static double version();
    static constexpr std::size_t head = 4;

    static std::vector<double> write(Scenario scenario, std::vector<ScenarioParameter> parameters = {},
                                     Derivation derivation = {});
    // The numbers of a scenario with its parameters.
    static std::vector<double> write(const std::vector<double>& body, std::vector<ScenarioParameter> parameters,
                                     Derivation derivation);
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
    static constexpr unsigned char layout = 14;

    template <class F>
    static void describe(F& f, std::vector<ScenarioParameter>& parameters, Derivation& derivation, std::size_t places) {
        f.each("parameters", parameters, [&](ScenarioParameter& p) { p.describe(f); });
        derivation.describe(f, parameters.size(), places);
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
    Derivation derivation_;
    std::optional<std::pair<double, double>> times_;
    std::map<std::size_t, Signal> inputs_;
    std::map<std::size_t, control::Reference> references_;
};

}  // namespace lostmotion
