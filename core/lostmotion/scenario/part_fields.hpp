// The parts of drives and trains, field by field, in the order of a description.
#pragma once

#include "../base/signal.hpp"
#include "../model/train.hpp"
#include "curve_laws.hpp"

namespace lostmotion {

using model::max_pieces;

bool rising(const std::vector<double>& v);

template <class F>
void describe_sides(F& f, TorsionCurve& curve) {
    TorsionCurve::Side forward = curve.forward(), backward = curve.backward();
    for (TorsionCurve::Side* side : {&forward, &backward}) {
        f.list("breaks", side->breaks, Range::positive);
        f.list("slopes", side->slopes);
        if constexpr (F::reads) {
            if (f.well() && side->slopes.size() != side->breaks.size() + 1)
                f.wrong("slopes", "must be one more than breaks");
            if (f.well() && !rising(side->breaks)) f.wrong("breaks", "must rise");
            if (f.well() && side->breaks.size() > max_pieces) f.wrong("breaks", "are too many");
        }
    }
    if constexpr (F::reads)
        if (f.well()) curve = TorsionCurve(forward, backward);
}

template <class F>
void describe(F& f, TorsionCurve& curve) {
    describe_curve<StiffnessCurve, QuadraticDrag>(f, curve, [&] { describe_sides(f, curve); });
    if constexpr (F::reads)
        if (f.well() && curve.pieces() > 2 * max_pieces + 1) f.wrong("breaks", "are too many");
}

// As it was given, without what extends it.
template <class F>
void describe(F& f, LossMap& map) {
    std::vector<double> speeds, loads, values;
    if (!map.empty()) {
        const std::size_t n = map.speeds().size(), m = map.loads().size();
        speeds.assign(map.speeds().begin(), map.speeds().end() - 1);
        loads.assign(map.loads().begin() + 1, map.loads().end() - 1);
        for (std::size_t j = 1; j + 1 < m; ++j)
            for (std::size_t i = 0; i + 1 < n; ++i) values.push_back(map.values()[j * n + i]);
    }
    f.list("speeds", speeds, Range::not_negative);
    f.list("loads", loads);
    f.list("values", values, Range::not_negative);
    if constexpr (F::reads) {
        if (!f.well()) return;
        if (speeds.size() < 2 || loads.size() < 2) return f.wrong("speeds", "and loads must be two at least");
        if (speeds[0] != 0.0 || !rising(speeds)) return f.wrong("speeds", "must rise from 0");
        if (!rising(loads)) return f.wrong("loads", "must rise");
        if (values.size() != speeds.size() * loads.size()) return f.wrong("values", "must be one for each node");
        map = LossMap(std::move(speeds), std::move(loads), std::move(values));
    }
}

namespace model {

template <class F>
void describe_points(F& f, PeriodicCurve& curve) {
    double period = curve.period();
    std::vector<double> angles, values;
    for (int k = 0; k < curve.pieces(); ++k) {
        angles.push_back(curve.lower(k));
        values.push_back(curve.value(k));
    }
    SineOfAngle sine = curve.sine_of();
    f.number("period", period, Range::positive);
    f.list("angles", angles, Range::not_negative);
    f.list("values", values);
    f.number("amplitude", sine.amplitude);
    f.number("order", sine.order, Range::positive);
    f.number("phase", sine.phase);
    if constexpr (F::reads) {
        if (!f.well()) return;
        if (angles.empty() || angles.size() != values.size() || angles.size() > max_pieces)
            return f.wrong("angles", "must be as many as values, from 1 to " + std::to_string(max_pieces));
        if (!rising(angles) || !(angles.back() < period))
            return f.wrong("angles", "must rise and lie below the period");
        curve = PeriodicCurve(period, std::move(angles), std::move(values), sine);
    }
}

template <class F>
void describe(F& f, PeriodicCurve& curve) {
    describe_curve<HarmonicLaw>(f, curve, [&] { describe_points(f, curve); });
    if constexpr (F::reads)
        if (f.well() && curve.pieces() > max_pieces) f.wrong("angles", "are too many");
}

}  // namespace model

// Unit of the value of a signal, which its use states.
inline constexpr const char* of_value = "value";

template <class F>
void describe(F& f, Sine& s) {
    f.number({"amplitude", "A", of_value, Range::any, Given::needed, "largest value"}, s.amplitude);
    f.number({"frequency", "f", "Hz", Range::positive, Given::needed, "periods in a second"}, s.frequency);
    f.number({"phase", "", "rad", Range::any, Given::has_default, "phase at t = 0"}, s.phase);
}

template <class F>
void describe(F& f, Signal& s) {
    f.each("breakpoints", s.breakpoints, [&](Breakpoint& b) {
        f.number("time", b.time, Range::not_negative);
        f.number("value", b.value);
        f.number("slope", b.slope);
    });
    f.each("sines", s.sines, [&](Sine& sine) { describe(f, sine); });
    if constexpr (F::reads) {
        if (!f.well()) return;
        if (s.breakpoints.empty() || s.breakpoints[0].time != 0.0) return f.wrong("breakpoints", "must begin at 0 s");
        for (std::size_t k = 1; k < s.breakpoints.size(); ++k)
            if (!(s.breakpoints[k].time > s.breakpoints[k - 1].time))
                return f.wrong("breakpoints", "must rise in time");
    }
}

namespace model {

// What a check of the train finds, such as shafts that it does not have, is left to it.
inline constexpr long max_number = 1000;  // of a shaft or motor

template <class F>
void describe_points(F& f, DryFriction& d) {
    f.number("torque", d.torque, Range::not_negative);
    f.number("breakaway_torque", d.breakaway_torque, Range::not_negative);
    f.list("speeds", d.speeds, Range::not_negative);
    f.list("torques", d.torques, Range::not_negative);
}

template <class F>
void describe(F& f, DryFriction& d) {
    describe_made<StribeckLaw>(f, d, "stribeck", [&] { describe_points(f, d); });
    if constexpr (F::reads) {
        if (f.well() && d.speeds.size() > max_pieces) f.wrong("speeds", "are too many");
    }
}

template <class F>
void describe(F& f, Shaft& s) {
    f.text("name", s.name);
    f.choice("domain", s.domain, {"rotation", "translation"});
    s.describe(f);
    f.part("friction", [&] { describe(f, s.friction); });
    f.curve("drag", s.drag);
    f.flag("loaded", s.loaded);
    f.flag("given_motion", s.given_motion);
}

template <class F>
void describe(F& f, MassMatrix& m) {
    f.text("name", m.name);
    f.each("shafts", m.shafts, [&](int& s) { f.integer("shaft", s, 0, max_number); });
    f.matrix("matrix", m.matrix);
}

template <class F>
void describe(F& f, ShaftMotor& m) {
    f.text("name", m.name);
    f.integer("shaft", m.shaft, 0, max_number);
    m.law.describe(f);
    m.describe(f);
}

template <class F>
void describe(F& f, Gear& g) {
    f.text("name", g.name);
    f.integer("input", g.input, 0, max_number);
    f.integer("output", g.output, 0, max_number);
    f.integer("housing", g.housing, -1, max_number);
    g.law.describe(f);
    g.describe(f);
}

template <class F>
void describe(F& f, LinearController& c) {
    const auto signal = [&](LinearController::Signal& s) {
        f.choice("kind", s.kind, {"reference", "reference_rate", "angle", "speed"});
        f.integer("shaft", s.shaft, 0, max_number);
    };
    f.text("name", c.name);
    f.integer("motor", c.motor, 0, max_number);
    f.each("signals", c.signals, signal);
    f.part("compared", [&] { signal(c.compared); });
    f.texts("states", c.states);
    f.matrix("A", c.A);
    f.matrix("B", c.B);
    f.list("C", c.C);
    f.list("D", c.D);
    f.list("back_calculation", c.back_calculation);
    f.number("limit", c.limit, Range::limit);
    f.curve_if("curve", c.curved, c.curve);
    f.number("droop", c.droop, Range::not_negative);
}

template <class F>
void describe(F& f, Train& t) {
    const auto element = [&](auto& e) { describe(f, e); };
    f.each("aliases", t.aliases, [&](Alias& a) {
        f.text("name", a.name);
        f.text("shown", a.shown);
    });
    f.each("shafts", t.shafts, element);
    f.each("mass_matrices", t.mass_matrices, element);
    f.each("motors", t.motors, element);
    f.each("gears", t.gears, element);
    Train::each_coupling_kind(t, [&](const char* table, const char*, auto& elements) {
        f.each(table, elements, [&](auto& e) {
            f.text("name", e.name);
            f.integer("input", e.input, 0, max_number);
            f.integer("output", e.output, 0, max_number);
            e.describe(f);
        });
    });
    f.each("controllers", t.controllers, element);
    Train::each_kind(t, [&](const char* table, const char*, auto& elements) {
        f.each(table, elements, [&](auto& e) {
            f.text("name", e.name);
            f.integer("shaft", e.shaft, 0, max_number);
            e.describe(f);
        });
    });
}

// The parts of trains whose numbers scenario files have, by the names of these parts: use(name, describe).
template <class Use>
void each_table(Use&& use) {
    use("Shaft", [](auto& f) { Shaft().describe(f); });
    use("Motor", [](auto& f) { Motor().describe(f); });
    use("ShaftMotor", [](auto& f) { ShaftMotor().describe(f); });
    use("Transmission", [](auto& f) {
        Gear g;
        g.law.describe(f);
        g.describe(f);
    });
    use("Commanded", [](auto& f) { Brake().describe(f); });
    use("TorsionCurve", [](auto& f) { StiffnessCurve().describe(f); });
    const auto add = [&](const char*, const char*, const auto& elements) {
        using Element = std::decay_t<decltype(elements)>::value_type;
        if constexpr (requires { Element::part; }) use(Element::part, [](auto& f) { Element().describe(f); });
    };
    const Train none;
    Train::each_coupling_kind(none, add);
    Train::each_kind(none, add);
    use("ShaftEndStops", [](auto& f) { EndStops().describe(f); });
    use("EndStops", [](auto& f) { EndStops().describe(f, "m", "N/m", "N*s/m"); });
}

}  // namespace model
}  // namespace lostmotion
