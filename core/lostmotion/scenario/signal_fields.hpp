// Signals, references, winds, targets, curves over speed and initial states as scenario files write them. Python makes
// of them what the core takes: breakpoints, sines, curves and states.
#pragma once

#include "part_fields.hpp"

namespace lostmotion {

namespace signals {

using enum Range;
using enum Given;

// use(name, describe) for each table, by the name of its part.
template <class Use>
void each_signal(Use&& use) {
    const Field begin{"begin", "t_0", "s", not_negative, has_default, "instant at which it begins"};
    use("Sine", [](auto& f) {
        Sine sine;
        lostmotion::describe(f, sine);
    });
    use("Step", [](auto& f) {
        f.number({"height", "h", of_value, any, needed, "what it adds"});
        f.number({"time", "t_0", "s", not_negative, has_default, "instant from which it adds its height"});
    });
    use("Ramp", [=](auto& f) {
        f.number({"rise", "h", of_value, any, needed, "what it adds from its end on"});
        f.number({"duration", "T", "s", positive, needed, "time that it takes"});
        f.number(begin);
    });
    use("Chirp", [=](auto& f) {
        f.number({"amplitude", "A", of_value, any, needed, "amplitude of the sine"});
        f.number({"begin_frequency", "f_0", "Hz", positive, needed, "frequency at its begin"});
        f.number({"end_frequency", "f_1", "Hz", positive, needed, "frequency at its end"});
        f.number({"duration", "T", "s", positive, needed, "time from its begin to its end"});
        f.number(begin);
        f.integer({"points_per_period", "n", "", any, has_default, "straight lines in the shortest period"}, 64, 8,
                  1000);
    });
    use("Samples", [](auto& f) {
        f.list({"times", "t", "s", any, needed, "instants, rising from 0 or later"}, {}, {0, Entries::any});
        f.list({"values", "", of_value, any, needed, "value at each instant"}, {}, {0, Entries::any});
    });
    use("TimeFunction", [](auto& f) {
        f.number({"mean", "", of_value, any, has_default, "constant part"});
        f.number({"amplitude", "A", of_value, any, may_be_left_out, "amplitude of one sine, with frequency and phase"});
        f.number({"frequency", "f", "Hz", positive, may_be_left_out, "frequency of that sine"});
        f.number({"phase", "", "rad", any, has_default, "phase of that sine at t = 0"});
        f.tables({"sines", "", "", any, has_default, "more sines"}, "Sine");
        f.tables({"steps", "", "", any, has_default, "steps, each from an instant on"}, "Step");
        f.tables({"ramps", "", "", any, has_default, "straight lines in time, each with a begin and an end"}, "Ramp");
    });
    use("Signal", [](auto& f) {
        f.table({"chirp", "", "", any, may_be_left_out, "sine whose frequency runs from one value to another"},
                "Chirp");
        f.table({"samples", "", "", any, may_be_left_out, "straight lines through points"}, "Samples");
    });
    use("TorqueSignal", [](auto& f) {
        f.table({"wind", "", "", any, may_be_left_out, "random torque with the spectrum of gusts"},
                "WindOfTable|Davenport|VonKarman|Kaimal");
    });
}

template <class Use>
void each_reference(Use&& use) {
    use("Series", [](auto& f) {
        f.choice({"interpolation", "", "", any, has_default,
                  "straight lines, or a cubic spline: first and second derivative are continuous between the first and "
                  "the last point"},
                 "linear|cubic");
    });
    use("Reference",
        [](auto& f) { f.table({"samples", "", "", any, may_be_left_out, "curve through points"}, "Series"); });
    use("LimitedMove", [](auto& f) {
        f.number({"to", "", of_value, any, needed, "position at its end"});
        f.number({"speed", "v", "value/s", positive, may_be_left_out, "limit; default: the value for all moves"});
        f.number({"acceleration", "a", "value/s^2", positive, may_be_left_out,
                  "limit, also while it slows down; default: the value for all moves"});
        f.number({"jerk", "j", "value/s^3", positive, may_be_left_out, "limit; default: the value for all moves"});
        f.number(
            {"dwell", "", "s", not_negative, may_be_left_out, "rest after the move; default: the value for all moves"});
    });
    use("MovesReference", [](auto& f) {
        constexpr const char* limit = "limit of all moves that have none of their own";
        f.number({"start", "", of_value, any, has_default, "position before the first move"});
        f.number({"begin", "t_0", "s", not_negative, has_default, "instant at which the first move begins"});
        f.number({"speed", "v", "value/s", positive, may_be_left_out, limit});
        f.number({"acceleration", "a", "value/s^2", positive, may_be_left_out, limit});
        f.number({"jerk", "j", "value/s^3", positive, may_be_left_out,
                  "limit of all moves that have none of their own; without any, their speed is trapezoidal"});
        f.number({"dwell", "", "s", not_negative, has_default, "rest after each move that has none of its own"});
        f.tables({"moves", "", "", any, has_default, "moves, each from rest to rest"}, "M");
    });
    use("PositionReference", [](auto& f) {
        f.table({"target", "", "", any, may_be_left_out, "the angle under which a target in space is seen"},
                "FlyBy|Weave|Circle|Track|Star|Satellite");
    });
}

template <class Use>
void each_target(Use&& use) {
    const Field height{"height", "h", "m", any, has_default, "above the station"};
    use("TargetPath", [](auto& f) {
        f.choice({"axis", "", "", any, needed, "axis that follows the target"}, "traverse|elevation");
        f.number({"bearing", "", "rad", any, has_default,
                  "bearing of the direction y, in which the path is given; it adds to the traverse"});
        f.number({"duration", "T", "s", positive, has_default,
                  "time for which the axis follows; after it the reference stays"},
                 60.0);
    });
    use("Crossing", [=](auto& f) {
        f.number({"distance", "R_0", "m", positive, needed, "R_0, horizontal, of the point next to the station"});
        f.number(height);
        f.number({"speed", "V", "m/s", positive, needed, "speed along the path"});
        f.number({"crossing_time", "", "s", not_negative, needed, "instant at which it is next to the station"});
        f.choice({"heading", "", "", any, has_default, "side to which it flies, as seen from the station"},
                 "right|left");
    });
    use("Weave", [](auto& f) {
        f.number({"width", "", "m", positive, needed, "amplitude of the swing"});
        f.number({"frequency", "f", "Hz", positive, needed, "swings in a second"});
    });
    use("Circle", [=](auto& f) {
        f.number({"distance", "", "m", not_negative, needed, "distance of its centre, horizontal, along the bearing"});
        f.number({"radius", "R", "m", positive, needed});
        f.number(height);
        f.number({"speed", "V", "m/s", positive, needed, "speed along the circle"});
        f.number({"start", "", "rad", any, has_default,
                  "starting point on the circle, as an angle from the point farthest along the bearing, to the right"});
    });
    use("Track", [](auto& f) {
        f.list({"times", "t", "s", not_negative, needed, "instants, rising, from 0 to the duration at least"}, {},
               {4, Entries::any});
        f.list({"x", "x", "m", any, needed, "to the right of the bearing, at each instant"}, {}, {0, Entries::any});
        f.list({"y", "y", "m", any, needed, "along the bearing, at each instant"}, {}, {0, Entries::any});
        f.list({"z", "z", "m", any, needed, "up, at each instant"}, {}, {0, Entries::any});
    });
    use("Star", [](auto& f) {
        f.number({"declination", "", "rad", any, needed, "angle above the plane of the equator"});
        f.number({"hour_angle", "", "rad", any, needed, "at the start, west of the meridian"});
        f.number({"latitude", "", "rad", any, needed, "of the station, north of the equator"});
        // Turn of the earth against the stars (IERS Conventions 2010, table 1.2).
        f.number(
            {"rate", "", "rad/s", any, has_default, "rate at which the hour angle grows; for the sun 7.2722e-5 rad/s"},
            7.292115e-5);
    });
}

template <class Use>
void each_wind(Use&& use) {
    use("Wind", [](auto& f) {
        f.number(
            {"duration", "D", "s", positive, needed, "D, after which it is constant; its lowest frequency is 1/D"});
        f.number({"max_frequency", "", "Hz", positive, needed, "highest frequency of its lines"});
        f.integer({"points_per_period", "n", "", any, has_default, "straight lines in the shortest period"}, 16, 4,
                  100);
        f.integer({"seed", "", "", any, has_default, "number of the realisation"}, 0, 0, 1LL << 53);
    });
    use("WindOfTable", [](auto& f) {
        f.list({"frequencies", "f", "Hz", positive, needed, "rising"}, {}, {2, Entries::any});
        f.list({"densities", "S", "N^2*m^2/Hz", positive, needed, "one-sided [(N·m)²/Hz], at each frequency"}, {},
               {0, Entries::any});
    });
    use("WindOnArea", [](auto& f) {
        f.number({"speed", "V", "m/s", positive, needed, "V, mean over ten minutes, at the height of the load"});
        f.number({"drag_coefficient", "c", "", positive, needed, "c of the area"});
        f.number({"area", "A", "m^2", positive, needed, "A on which the wind presses"});
        f.number(
            {"lever", "r", "m", any, needed, "r of the centre of pressure from the axis, against the motion forward"});
        f.number({"density", "rho", "kg/m^3", positive, has_default, "rho of the air"}, 1.225);
    });
    use("Davenport", [](auto& f) {
        f.number({"surface_drag", "K", "", positive, has_default,
                  "K = u*^2/V_10^2; 0.005 open country, 0.015 suburbs, 0.05 cities"},
                 0.005, 0.0, 0.1);
        f.number({"speed_at_10_m", "V_10", "m/s", positive, may_be_left_out, "V_10; default: the value at the load"});
    });
    use("VonKarman", [](auto& f) {
        f.number({"turbulence", "sigma/V", "", up_to_one, needed, "sigma/V"});
        f.number({"length_scale", "L", "m", positive, needed, "L, along the wind"});
    });
    use("Kaimal", [](auto& f) {
        f.number({"height", "z", "m", positive, needed, "z above ground"});
        f.number({"roughness_length", "z_0", "m", not_negative, has_default, "z_0; 0.03 m open country"}, 0.03);
    });
}

template <class Use>
void each_table(Use&& use) {
    each_signal(use);
    each_reference(use);
    each_target(use);
    each_wind(use);
}

}  // namespace signals
}  // namespace lostmotion
