// Friction, drag, torques over the angle, and initial states of shafts and slides, as scenario files write them.
#pragma once

#include <numbers>

#include "signal_fields.hpp"

namespace lostmotion::signals {

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

template <class Use>
void each_friction(Use&& use, const Motion& m) {
    use(m.curve, [&](auto& f) { FrictionTable{&m}.describe_curve(f); });
    use(m.load, [&](auto& f) { FrictionTable{&m}.describe(f); });
}

template <class Use>
void each_drag(Use&& use) {
    use("DragCurve", [](auto& f) {
        f.list({"speeds", "", "rad/s", not_negative, needed, "rising from 0"}, {}, {2});
        f.list({"torques", "", "N*m", not_negative, needed, "the first is 0: what holds at rest is friction"}, {},
               {0, Entries::any});
        f.choice({"beyond", "", "", any, has_default,
                  "beyond the last point: the last line goes on, or the last torque stays"},
                 "extend|hold");
    });
    use("QuadraticDrag", [](auto& f) { QuadraticDrag().describe(f); });
    use("EddyCurrentDrag", [](auto& f) {
        f.number({"peak_torque", "", "N*m", positive, needed, "at the critical speed"});
        f.number({"critical_speed", "", "rad/s", positive, needed, "speed of the largest torque"});
        f.number({"max_speed", "", "rad/s", positive, needed, "up to which the straight lines follow the law"});
        f.number({"error", "", "N*m", positive, may_be_left_out,
                  "by which they depart from it at most; left out, 0.1 % of the peak torque"});
    });
    use("Drag", [](auto& f) {
        f.table(
            {"drag", "", "", any, may_be_left_out, "torque over speed against the motion, of dampers over the slip"},
            "DragCurve|QuadraticDrag|EddyCurrentDrag");
    });
}

template <class Use>
void each_slide(Use&& use) {
    use("Stopped", [](auto& f) {
        f.table({"end_stops", "", "", any, may_be_left_out, "stops at both ends of the travel"}, "ShaftEndStops");
    });
    use("Slide", [](auto& f) {
        constexpr double upright = 0.5 * std::numbers::pi;
        f.number({"mass", "m", "kg", not_negative, has_default, "of what moves, without masses of linear motors"});
        f.number({"viscous_friction", "b", "N*s/m", not_negative, has_default, "against the frame"});
        f.number({"inclination", "", "rad", any, has_default,
                  "inclination of the positive direction above the horizontal; 90 deg: vertical, positive upwards. The "
                  "weight's share along the slide acts against it"},
                 0.0, -upright, upright);
        f.table({"end_stops", "", "", any, may_be_left_out, "stops at both ends of the travel"}, "EndStops");
    });
    use("Load", [](auto& f) {
        f.number({"inertia", "J_Z", "kg*m^2", positive, needed, "J_Z"});
        f.number({"viscous_friction", "b_ZR", "N*m*s/rad", not_negative, has_default, "b_ZR"});
        f.number({"friction_torque", "", "N*m", not_negative, has_default, "dry friction of the bearing"});
    });
    use("LoadTable", [](auto& f) { f.table({"torque", "M_Z", "", any, has_default, "M_Z"}, "TorqueSignal"); });
    use("ShaftTable", [](auto& f) {
        f.table({"torque", "M_Z", "", any, may_be_left_out, "M_Z, against its motion; left out, none can act on it"},
                "TorqueSignal");
        f.table({"speed", "", "", any, may_be_left_out,
                 "speed that it has whatever acts on it; the torque that this takes is the variable "
                 "``NAME_drive_torque``; left out, it moves as the torques let it"},
                "SpeedSignal");
        f.table({"motion", "", "", any, may_be_left_out,
                 "angle that it has whatever acts on it, such as moves, in place of speed"},
                "PositionReference");
    });
    use("SlideTable", [](auto& f) {
        f.table({"force", "", "", any, may_be_left_out,
                 "against its motion, beside its weight; left out, none can act on it unless it is inclined"},
                "ForceSignal");
        f.table({"speed", "", "", any, may_be_left_out,
                 "speed that it has whatever acts on it; the force that this takes is the variable "
                 "``NAME_drive_force``; left out, it moves as the forces let it"},
                "SlideSpeedSignal");
        f.table({"motion", "", "", any, may_be_left_out,
                 "position that it has whatever acts on it, such as moves, in place of speed"},
                "SlideReference");
    });
}

template <class Use>
void each_initial(Use&& use) {
    constexpr const char* on_reference = "on_reference";
    use("Initial", [](auto& f) {
        f.number({"motor_torque", "M_D", "N*m"});
        f.number({"motor_speed", "w_M", "rad/s"});
        f.number({"load_speed", "w", "rad/s"});
        f.number({"twist", "d", "rad"});
        f.number({"load_angle", "phi", "rad"});
        f.number({"hysteresis_capacity", "h", "N*m", not_negative, has_default,
                  "h, which the last turning point before t = 0 left behind"});
        f.flag({on_reference, "", "", any, has_default,
                "angle and speeds are those of the controller's reference at t = 0"},
               false);
    });
    use("TrainInitial", [](auto& f) {
        f.named({"speeds", "", "rad/s", any, has_default, "speeds of shafts"});
        f.named({"angles", "", "rad", any, has_default, "angles of shafts; those of others follow through the gears"});
        f.named({"twists", "", "rad", any, has_default, "twists of gears with a stiffness"});
        f.named({"positions", "", "m", any, has_default, "positions of slides"});
        f.named({"slide_speeds", "", "m/s", any, has_default, "slide speeds of slides"});
        f.named({"deflections", "", "m", any, has_default, "deflections of screws, racks and belts with a stiffness"});
        f.named({"motor_torques", "", "N*m", any, has_default, "motor torques of DC motors"});
        f.named({"controller_states", "", "", any, has_default,
                 "states of continuous controllers, by their result variables (SI), such as ``MOTOR_integral``; the "
                 "filter of a derivative that is left out has settled"});
        f.named({"hysteresis_capacities", "", "N*m", not_negative, has_default,
                 "capacities of gears with hysteresis after the last turning point before t = 0"});
        f.named({"hysteresis_forces", "", "N", not_negative, has_default, "the same of screws, racks and belts"});
        f.flag({on_reference, "", "", any, has_default,
                "angles of the shafts of controllers, and the speeds of all that turns with them, are those of their "
                "references at t = 0"},
               false);
    });
}

template <class Use>
void each_shaft_table(Use&& use) {
    each_friction(use, rotation);
    each_friction(use, translation);
    each_drag(use);
    each_slide(use);
    each_initial(use);
}

}  // namespace lostmotion::signals
