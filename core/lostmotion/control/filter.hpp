// Linear discrete-time system that filters a reference or a torque: y = C z + D u, then z <- A z + B u.
#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "../parts/field.hpp"
#include "../parts/origin.hpp"
#include "slots.hpp"

namespace lostmotion::control {

struct DiscreteSystem {
    std::vector<double> A, B, C;  // row by row
    double D = 1.0;
    Origin origin = {};

    static constexpr int max_order = 16;
    int order() const { return static_cast<int>(B.size()); }
    void place(Slots& slots) { first_ = slots.take(order()); }
    double operator()(double u, double* slot) const;

 private:
    int first_ = 0;
};

// A filter as scenario files write it: a low pass or a notch of continuous time, or a transfer function in z.
struct Filter {
    enum Kind { low_pass, notch, transfer_function } kind = low_pass;
    double frequency = 0.0, damping = 0.0;
    double depth = 0.0, width = 0.5, pole_frequency = 0.0;
    std::vector<double> numerator, denominator;  // the highest power first
    double sample_time = 0.0;

    template <class Fields>
    void describe_low_pass(Fields& f) {
        f.number({"frequency", "f", "Hz", Range::positive, Given::needed, "corner frequency"}, frequency);
        f.number({"damping", "", "", Range::positive, Given::may_be_left_out,
                  "damping of a filter of second order; left out, the filter is of first order"},
                 damping);
    }
    template <class Fields>
    void describe_notch(Fields& f) {
        f.number({"frequency", "", "Hz", Range::positive, Given::needed, "frequency of the zeros"}, frequency);
        f.number({"depth", "D_z", "", Range::not_negative, Given::has_default, "D_z, damping of the zeros"}, depth);
        f.number({"width", "D_n", "", Range::positive, Given::has_default, "D_n, damping of the poles"}, width);
        f.number(
            {"pole_frequency", "", "Hz", Range::positive, Given::may_be_left_out, "default: the value of the zeros"},
            pole_frequency);
    }
    template <class Fields>
    void describe_transfer_function(Fields& f) {
        constexpr const char* meaning = "coefficients of z, the highest power first";
        f.list({"numerator", "", "", Range::any, Given::needed, meaning}, numerator, {1, Entries::any});
        f.list({"denominator", "", "", Range::any, Given::needed, meaning}, denominator,
               {1, DiscreteSystem::max_order + 1});
        f.number({"sample_time", "", "s", Range::positive, Given::may_be_left_out,
                  "sample time for which it was made; default: the sample time of its loop"},
                 sample_time);
    }
    template <class Fields>
    void describe(Fields& f) {
        f.choice("kind", kind, {"low_pass", "notch", "transfer_function"});
        if (kind == low_pass) describe_low_pass(f);
        if (kind == notch) describe_notch(f);
        if (kind == transfer_function) describe_transfer_function(f);
    }

    // A low pass is 1/(1 + s/w) or 1/((s/w)^2 + 2 D s/w + 1), a notch
    // ((s/w_z)^2 + 2 D_z s/w_z + 1)/((s/w_n)^2 + 2 D_n s/w_n + 1). By Tustin's rule s/w = (z - 1)/(z + 1)/tan(w T/2),
    // under which both have the same value at w, the corner or w_z; below half the sampling frequency.
    void discretise(double loop_time);
    // System of a transfer function in z, in controllable form.
    DiscreteSystem system() const;
};

}  // namespace lostmotion::control
