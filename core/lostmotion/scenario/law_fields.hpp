// Laws of a few numbers, of which the core makes curves and filters, as scenario files write them. Tables of which
// Python makes what the core takes are described there.
#pragma once

#include "control_fields.hpp"

namespace lostmotion::laws {

using enum Range;
using enum Given;

// Names and units of one kind of motion.
struct Motion {
    const char *load, *curve, *slipping, *at_rest, *forces, *force, *speed, *sliding, *stuck, *law, *error;
};
inline constexpr Motion rotation{
    "DryFriction",
    "FrictionCurve",
    "friction_torque",
    "breakaway_torque",
    "torques",
    "N*m",
    "rad/s",
    "T_C, dry friction while it slips",
    "T_S, dry friction at rest; left out, the same",
    "w_S: the friction falls from T_S to T_C by `T_C + (T_S - T_C) exp(-(w/w_S)^2)`; left out, at once",
    "by which straight lines depart from that curve at most; left out, 0.1 % of T_S - T_C"};
inline constexpr Motion translation{
    "SlideFriction",
    "ForceCurve",
    "friction_force",
    "breakaway_force",
    "forces",
    "N",
    "m/s",
    "dry friction while it slips",
    "dry friction at rest; left out, the same",
    "v_S: the friction falls from breakaway_force to friction_force by ``exp(-(v/v_S)^2)``; left out, at once",
    "by which straight lines depart from that curve at most; left out, 0.1 % of the difference of both forces"};

// Dry friction as files have it.
struct FrictionTable {
    const Motion* of = &rotation;
    double slipping = 0.0, at_rest = 0.0, stribeck_speed = 0.0, error = 0.0;
    std::vector<double> speeds = {}, forces = {};

    template <class F>
    void describe_curve(F& f) {
        f.list({"speeds", "", of->speed, not_negative, needed, "rising from 0"}, speeds, Entries{2});
        f.list({of->forces, "", of->force, not_negative, needed, "dry friction at each speed"}, forces,
               Entries{0, Entries::any});
    }
    template <class F>
    void describe(F& f) {
        f.number({of->slipping, "T_C", of->force, not_negative, has_default, of->sliding}, slipping);
        f.number({of->at_rest, "T_S", of->force, not_negative, may_be_left_out, of->stuck}, at_rest);
        f.number({"stribeck_speed", "w_S", of->speed, positive, may_be_left_out, of->law}, stribeck_speed);
        f.number({"friction_error", "", of->force, positive, may_be_left_out, of->error}, error);
        f.table({"friction_curve", "", "", any, may_be_left_out,
                 "dry friction over speed, in place of the dry friction while it slips and stribeck_speed"},
                of->curve, [&] { describe_curve(f); });
    }

    model::DryFriction law() const {
        if (!speeds.empty()) return {0.0, at_rest, speeds, forces};
        if (stribeck_speed == 0.0) return {slipping, at_rest, {}, {}};
        return made_by(StribeckLaw{slipping, at_rest, stribeck_speed, error});
    }
};

// use(name, describe) for each table, by the name of its part.
template <class Use>
void each_table(Use&& use) {
    use("Sine", [](auto& f) {
        Sine sine;
        lostmotion::describe(f, sine);
    });
    for (const Motion& m : {rotation, translation}) {
        use(m.curve, [&](auto& f) { FrictionTable{&m}.describe_curve(f); });
        use(m.load, [&](auto& f) { FrictionTable{&m}.describe(f); });
    }
    use("QuadraticDrag", [](auto& f) { QuadraticDrag().describe(f); });
    use("Gearbox",
        [](auto& f) { f.need({"rated_input_speed", "rated_output_torque"}, [&] { Gearbox().describe(f); }); });
    use("Harmonic", [](auto& f) { HarmonicLaw().describe_angle(f); });
    const auto harmonic = [&](const char* name, const char* unit, const char* meaning) {
        use(name, [=](auto& f) { HarmonicLaw().describe_size(f, unit, meaning); });
    };
    harmonic("TorqueHarmonic", "N*m", "largest torque");
    harmonic("ErrorHarmonic", "rad", "at the output");
    harmonic("PitchHarmonic", "m", "at the slide");
    use("LowPass", [](auto& f) { control::Filter().describe_low_pass(f); });
    use("Notch", [](auto& f) { control::Filter().describe_notch(f); });
    use("TransferFunction", [](auto& f) { control::Filter().describe_transfer_function(f); });
}

}  // namespace lostmotion::laws
