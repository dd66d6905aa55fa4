// Laws that make curves of a few numbers. Each has the number by which a description names it, describe(), curve(), and
// what is wrong with numbers that make no curve, or nothing.
#pragma once

#include <cmath>
#include <numbers>
#include <string>

#include "../model/train.hpp"
#include "../parts/stiffness_curve.hpp"
#include "fields.hpp"

namespace lostmotion {

// Straight lines depart from a smooth law by this share of its largest value at most, where no error is given.
inline constexpr double usual_error = 1e-3;
inline constexpr const char* too_many_pieces = "take too many straight lines; the error is too small";

// Stribeck's curve of a dry friction.
struct StribeckLaw {
    static constexpr int number = 1;
    double slipping = 0.0, at_rest = 0.0, speed = 0.0, error = 0.0;

    template <class F>
    void describe(F& f) {
        f.number("slipping", slipping, Range::not_negative);
        f.number("at_rest", at_rest, Range::not_negative);
        f.number("speed", speed, Range::positive);
        f.number("error", error, Range::not_negative);
    }
    double departure() const { return error > 0.0 ? error : usual_error * (at_rest - slipping); }
    std::string wrong() const {
        return at_rest - slipping > 4.0 * model::max_pieces * model::max_pieces * departure() ? too_many_pieces : "";
    }
    model::DryFriction curve() const { return model::DryFriction::stribeck(slipping, at_rest, speed, departure()); }
};

struct QuadraticDrag {
    static constexpr int number = 2;
    double coefficient = 0.0, max_speed = 0.0, error = 0.0;

    template <class F>
    void describe(F& f) {
        f.number({"coefficient", "c", "N*m*s^2/rad^2", Range::positive, Given::needed, "c of the torque c w |w|"},
                 coefficient);
        f.number(
            {"max_speed", "", "rad/s", Range::positive, Given::needed, "up to which the straight lines follow the law"},
            max_speed);
        f.number({"error", "", "N*m", Range::positive, Given::may_be_left_out,
                  "by which the straight lines depart from the parabola at most; left out, 0.1 % of the torque at "
                  "max_speed"},
                 error);
    }
    double departure() const { return error > 0.0 ? error : usual_error * (coefficient * max_speed * max_speed); }
    std::string wrong() const {
        const double most = 2.0 * model::max_pieces;
        return coefficient * max_speed * max_speed > most * most * departure() ? too_many_pieces : "";
    }
    TorsionCurve curve() const { return model::Shaft::quadratic_drag(coefficient, max_speed, departure()); }
};

// amplitude * sin(order * phi + phase) over the angle phi of a shaft.
struct HarmonicLaw {
    static constexpr int number = 1;
    double amplitude = 0.0, phase = 0.0, error = 0.0, period = 0.0;  // period: in place of order
    int order = 1;

    template <class F>
    void describe_angle(F& f) {
        f.integer({"order", "n", "", Range::any, Given::has_default, "periods in one turn of the shaft"}, order, 1,
                  10000);
        f.number({"phase", "", "rad", Range::any, Given::has_default, "phase at angle 0"}, phase);
    }
    template <class F>
    void describe_size(F& f, const char* unit, const char* meaning) {
        f.number({"amplitude", "", unit, Range::positive, Given::needed, meaning}, amplitude);
        f.number({"error", "", unit, Range::positive, Given::may_be_left_out,
                  "by which the straight lines depart from the sine at most; left out, 0.1 % of the amplitude"},
                 error);
    }
    template <class F>
    void describe(F& f) {
        describe_angle(f);
        f.number("amplitude", amplitude);
        f.number("error", error, Range::not_negative);
        f.number("period", period, Range::not_negative);
    }
    double departure() const { return error > 0.0 ? error : usual_error * std::fabs(amplitude); }
    std::string wrong() const {
        if (amplitude == 0.0) return "has no amplitude";
        return std::fabs(amplitude) > model::max_pieces * model::max_pieces * departure() ? too_many_pieces : "";
    }
    model::PeriodicCurve curve() const {
        const double n = period > 0.0 ? 2.0 * std::numbers::pi / period : order;
        return model::PeriodicCurve::sine(amplitude, n, phase, departure());
    }
};

// Its curve, which knows its origin.
template <class Law>
auto made_by(Law law) {
    auto curve = law.curve();
    FieldWriter f;
    law.describe(f);
    curve.origin = {Law::number, std::move(f.numbers)};
    return curve;
}

// A curve by the numbers of the law that made it, of several that there are, or by its points.
template <class... Laws, class F, class Curve, class Points>
void describe_curve(F& f, Curve& curve, Points&& points) {
    int number = curve.origin.law;
    f.integer("law", number, 0, static_cast<long>(sizeof...(Laws)));
    if (!f.well()) return;
    const auto by = [&]<class Law>(Law law) {
        if (Law::number != number) return;
        if constexpr (!F::reads) {
            FieldReader of(curve.origin.numbers);
            law.describe(of);
        }
        law.describe(f);
        if constexpr (F::reads) {
            if (const std::string wrong = f.well() ? law.wrong() : ""; !wrong.empty()) f.wrong("", wrong);
            if (f.well()) curve = made_by(law);
        }
    };
    if (number == 0) points();
    (by(Laws{}), ...);
}

// What Python makes by a law, with the numbers of that under a key.
template <class Law, class F, class Made, class Points>
void describe_made(F& f, Made& made, const char* key, Points&& points) {
    if constexpr (requires { F::by_name; }) {
        points();
        f.list(key, made.origin.numbers);
        made.origin.law = made.origin.numbers.empty() ? 0 : Law::number;
    } else {
        describe_curve<Law>(f, made, points);
    }
}

}  // namespace lostmotion
