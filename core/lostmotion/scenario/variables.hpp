// The result variables of a scenario: what the solver reads, what follows from it, and what the controllers show.
#pragma once

#include <algorithm>
#include <limits>
#include <string>
#include <vector>

#include "description.hpp"

namespace lostmotion {

struct Variable {
    std::string name, unit, meaning, symbol = {};
};

class Variables {
 public:
    // The scenario has passed its check.
    explicit Variables(const Scenario& s);
    // Those of a train alone.
    explicit Variables(const model::Assembly& a);

    const std::vector<Variable>& all() const { return all_; }
    std::size_t size() const { return all_.size(); }
    // How many the solver reads: the first ones.
    std::size_t channels() const { return channels_; }
    // -1: there is none of this name.
    int place(const std::string& name) const;
    std::string unit(const std::string& name) const;

    // Variable v of instant k stands at data[v * stride + k]: those that follow, from those that the solver has read.
    void derive(double* data, std::size_t stride, std::size_t k) const;
    // The same of a change of the variables: rates[v], from the values at which it begins.
    void derive_rates(const double* values, double* rates) const {
        for (std::size_t d = 0; d < derived_.size(); ++d) rates[channels_ + d] = rate(derived_[d], values, rates);
    }
    // Signals of the controllers, which follow those that are derived: axis and number of each.
    struct Shown {
        int axis, signal;
    };
    const std::vector<Shown>& shown() const { return shown_; }
    std::size_t first_shown() const { return channels_ + derived_.size(); }

 private:
    struct Derived {
        enum Kind { nothing, product, efficiency, angle_of_output, angle_of_input } kind;
        int a = -1, b = -1, c = -1;  // variables
        int gear = -1;
    };

    static bool shows(const control::Axis& a, int signal);

    void add(Derived derived, Variable variable);
    void add_efficiencies();
    void add_twists();
    // Angles that the solver does not integrate follow through gears whose housing stands.
    void add_angles();

    template <class At>
    double value(const Derived& d, At&& at) const {
        switch (d.kind) {
            case Derived::nothing: return 0.0;
            case Derived::product: return at(d.a) * at(d.b);
            case Derived::efficiency: return efficiency(at(d.a), at(d.b), at(d.c), ratio(d));
            default: break;
        }
        const model::Gear& gear = train_.gears[static_cast<std::size_t>(d.gear)];
        if (d.kind == Derived::angle_of_input) return gear.law.ratio * (at(d.a) + at(d.b));
        const double error = gear.transmission_error.present() ? gear.transmission_error(at(d.a)) : 0.0;
        return at(d.a) / gear.law.ratio - at(d.b) - error;
    }
    double rate(const Derived& d, const double* x, const double* dx) const;
    // Driving (T_2 has the sign of w_M) it is T_2/(i T_1), overrunning i T_1/T_2; 0 where both sides feed the losses.
    static double efficiency(double T_2, double w_M, double T_1, double ratio);
    double ratio(const Derived& d) const { return train_.gears[static_cast<std::size_t>(d.gear)].law.ratio; }
    std::string speed_of(int shaft) const { return train_.shafts[static_cast<std::size_t>(shaft)].name + "_speed"; }

    std::vector<Variable> all_;
    std::size_t channels_ = 0;
    std::vector<Derived> derived_;
    std::vector<Shown> shown_;
    model::Train train_;
};

}  // namespace lostmotion
