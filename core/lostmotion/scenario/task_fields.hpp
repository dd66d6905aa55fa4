// Tasks of drives and the parts of linear axes as scenario files write them.
#pragma once

#include "machine_fields.hpp"

namespace lostmotion::tables {

template <class Use>
void each_duty(Use&& use) {
    use("ArmGravity", [](auto& f) {
        f.number({"mass", "", "kg", positive, needed, "of the body"});
        f.number({"radius", "", "m", positive, needed, "distance of its centre of gravity from the axis"});
        f.number({"hanging", "", "rad", any, has_default,
                  "position at which it hangs straight down; a quarter of a turn on, the arm is level"});
    });
    use("Payload", [](auto& f) {
        f.number({"begin", "", "s", not_negative, needed, "instant from which it is carried"});
        f.number({"end", "", "s", positive, needed, "instant at which it is set down"});
        f.number({"mass", "", "kg", not_negative, has_default, "of the body"});
        f.number(above_zero("radius", "m", "distance of its centre of gravity from the axis of a rotary load"));
        f.number(
            {"inertia", "", "kg*m^2", not_negative, has_default, "about its own centre of gravity, of a rotary load"});
    });
    use("Process", [](auto& f) {
        f.list({"times", "", "s", not_negative, may_be_left_out, "instants, rising"}, {}, {2, Entries::any});
        f.list({"positions", "", "rad", any, may_be_left_out, "positions of the load, in place of times"}, {},
               {2, Entries::any});
        f.list({"torques", "", "N*m", any, may_be_left_out, "on a rotary load"}, {}, {0, Entries::any});
        f.list({"forces", "", "N", any, may_be_left_out, "on a slide"}, {}, {0, Entries::any});
    });
    use("HoldingBrake", [](auto& f) {
        f.number(above_zero("torque", "N*m", "static, that it holds"));
        f.number({"inertia", "", "kg*m^2", not_negative, has_default, "of the brake, on the shaft of the motor"});
        f.number(above_zero("force", "N", "static, of a brake on the slide of a linear axis, in place of torque"));
        f.flag({"of_the_motor", "", "", any, has_default, "the brake that is built into the record of the motor"},
               false);
    });
    use("Amplifier", [](auto& f) {
        f.number(
            {"continuous_current", "", "A", positive, needed, "rms over the cycle, of a synchronous motor in a phase"});
        f.number(above_zero("peak_current", "A", "largest current, of a synchronous motor as effective value"));
        f.number(above_zero("peak_time", "s", "longest time above the continuous current"));
        f.number(above_zero("max_dc_voltage", "V", "largest voltage of the DC bus"));
    });
    use("Bus", [](auto& f) {
        f.number(above_zero("max_voltage", "V", "largest voltage of the bus before energy returns to it"));
        f.number(above_zero(
            "voltage_limit", "V",
            "largest voltage that the bus may reach; with a brake resistor the voltage at which it is switched on"));
        f.number(above_zero("capacitance", "A*s/V", "capacitance of the bus"));
        f.number(above_zero("brake_resistance", "ohm",
                            "resistance of the brake resistor, which is switched on at voltage_limit"));
        f.number(above_zero("brake_power", "W", "continuous power of the brake resistor"));
        f.flag({"returns_to_mains", "", "", any, has_default,
                "the energy goes back to the mains, or a battery takes it: neither capacitors nor resistor are judged"},
               false);
    });
    use("Supply", [](auto& f) {
        f.number(above_zero("min_voltage", "V",
                            "least voltage of the bus, at which the motor must reach its torque and speed"));
        f.number(above_zero("continuous_current", "A", "continuous current of the amplifier, rms over the cycle"));
    });
    use("TrainTask", [](auto& f) {
        f.number(above_zero(
            "cycle", "s",
            "period after which the motion of the run repeats, pause included; left out, it repeats without a pause"));
        f.number({"ambient_temperature", "", "degC", any, has_default, "temperature of the surroundings"}, 25.0,
                 absolute_zero, inf);
    });
    use("Task", [](auto& f) {
        f.number(above_zero("max_lost_motion", "rad",
                            "largest permissible lost motion at 3 % of the rated torque, total at the output"));
        f.flag({"hold_without_power", "", "", any, has_default,
                "whether the load must stay at rest against its torque with command 0; false where a brake or a "
                "controller holds it"},
               true);
    });
    use("CommandDelays", [](auto& f) {
        f.number(
            {"engagement_delay", "", "s", not_negative, has_default, "from a step up of the command until it acts"});
        f.number(
            {"release_delay", "", "s", not_negative, has_default, "from a step down of the command until it acts"});
    });
}

template <class Use>
void each_linear_part(Use&& use) {
    use("LinearMotorData", [](auto& f) {
        f.number({"mass", "", "kg", not_negative, has_default, "mass of the part that moves"});
        f.number(above_zero("rated_force", "N", "force at command 1"));
        f.number(above_zero("peak_force", "N", "at which the force ends; left out, without limit"));
        f.number(above_zero("force_constant", "N/A", "force to the current in the unit of the currents"));
        f.number(above_zero("rated_current", "A", "with force_constant, in place of rated_force"));
        f.number(above_zero("peak_current", "A", "with force_constant, in place of peak_force"));
        f.number({"friction_force", "", "N", not_negative, has_default, "dry friction"});
        f.number(above_zero("cogging_force", "N", "amplitude, over the position with the period pole_pitch"));
        f.number(
            above_zero("cogging_error", "N",
                       "by which the straight lines depart from the sine of the cogging at most; left out, 0.1 % of "
                       "cogging_force"));
        f.number(
            above_zero("pole_pitch", "m", "tau, from a north pole to the next south pole: half a magnetic period"));
    });
    use("StiffnessCurve", [](auto& f) {
        f.list({"slopes", "", "N/m", not_negative, needed, "slopes of the segments, from deflection 0 outwards"}, {},
               {1});
        f.list(
            {"breaks", "", "m", positive, has_default, "deflections at which the slope changes; one fewer than slopes"},
            {}, {0, Entries::any});
    });
    use("LinearDrive", [](auto& f) {
        f.number({"efficiency", "", "", up_to_one, may_be_left_out, "while the input drives; left out, none is lost"});
        f.number({"backdriving_efficiency", "", "", any, may_be_left_out,
                  "while the slide drives; 0 or less: self-locking; left out, 2 - 1/efficiency, which loses the same "
                  "share of the force"},
                 0.0, -inf, 1.0);
        f.number(above_zero("stiffness", "N/m", "axial, at the slide, of all that is in series; left out, rigid"));
        f.number({"backlash", "", "m", not_negative, has_default, "whole axial play at the slide"});
        f.number(
            {"restitution", "", "", share, may_be_left_out,
             "speed at which rigid flanks part over that at which they strike; needed with backlash and no stiffness"});
        f.number({"preload", "", "N", not_negative, has_default, "removes the segments of stiffness_curve below it"});
        f.number({"damping", "", "N*s/m", not_negative, has_default, "at the slide, while the flanks touch"});
        f.number(
            {"inertia", "", "kg*m^2", not_negative, has_default, "inertia of all that turns with the input shaft"});
        f.number({"viscous_friction", "", "N*m*s/rad", not_negative, has_default, "on the input shaft"});
        f.number({"drag_torque", "", "N*m", not_negative, has_default,
                  "dry friction on the input shaft, for example by the preload"});
    });
    use("ScrewData", [](auto& f) {
        f.number(above_zero("lead", "m", "travel to one turn"));
        f.number(above_zero("pitch", "m",
                            "distance of neighbouring threads, which with the number of starts says the lead"));
        f.integer({"starts", "", "", any, may_be_left_out, "threads of the screw"}, 0, 1, 20);
        f.number(above_zero("mean_diameter", "m", "d, of the pitch circle; tan(lead angle) = lead/(pi d)"));
        f.number({"friction_coefficient", "", "", not_negative, may_be_left_out,
                  "in the thread: with mean_diameter, in place of efficiency"});
        f.number({"friction_angle", "", "rad", not_negative, may_be_left_out, "in place of friction_coefficient"});
        f.number(above_zero("nut_stiffness", "N/m", "in series with the next ones, in place of stiffness"));
        f.number(above_zero("bearing_stiffness", "N/m", "axial stiffness of its bearings"));
        f.number(above_zero("supported_length", "m",
                            "length of the screw between bearing and nut; with both ends fixed, between both bearings, "
                            "the nut in the middle"));
        f.number(above_zero("core_diameter", "m", "core diameter of the screw's thread root"));
        f.number(above_zero("elastic_modulus", "Pa", "default: steel, 206 GPa"));
        f.choice({"support", "", "", any, may_be_left_out,
                  "at which the screw is fixed axially: stiffness E A/L (left out, this), or 4 E A/L"},
                 "one end|both ends");
        f.number(above_zero("diameter", "m", "diameter of the screw: with length, in place of inertia"));
        f.number(above_zero("length", "m", "of the shaft of the screw"));
        f.number(above_zero("density", "kg/m^3", "default: steel, 7850 kg/m^3"));
    });
    use("RatedScrew", [](auto& f) {
        f.number(above_zero("dynamic_capacity", "N", "C: axial load for a million turns of nominal life"));
        f.number(above_zero("static_capacity", "N", "C_0"));
        f.number({"load_factor", "", "", positive, has_default,
                  "f_w of the life: 1.2 to 1.5 for normal motion, more with shocks"},
                 1.0);
        f.choice({"mounting", "", "", any, has_default,
                  "mounting of the ends of the screw, for buckling and bending along supported_length"},
                 "fixed-supported|fixed-free|supported-supported|fixed-fixed");
        f.number(above_zero("ball_circle_diameter", "m", "diameter of the circle of the centres of its balls"));
        f.number(above_zero("max_input_speed", "rad/s", "left out, 70 m rpm/ball_circle_diameter"));
    });
    use("RackData", [](auto& f) {
        f.number(above_zero("module", "m", "normal module"));
        f.integer({"teeth", "", "", any, may_be_left_out, "teeth of the pinion"}, 0, 4, 1000);
        f.number({"helix_angle", "", "rad", any, may_be_left_out, "left out, 0: straight teeth"}, 0.0, 0.0,
                 0.25 * std::numbers::pi);
        f.number(above_zero("travel_per_turn", "m", "in place of module and teeth"));
    });
    use("BeltData", [](auto& f) {
        f.number(above_zero("pulley_diameter", "m", "at the belt's pitch line"));
        f.integer({"teeth", "", "", any, may_be_left_out, "teeth of the pulley"}, 0, 4, 1000);
        f.number(above_zero("pitch", "m", "pitch of the belt"));
        f.number(above_zero("travel_per_turn", "m", "in place of both"));
        f.number(above_zero("specific_stiffness", "N",
                            "c_sp, force to unit strain: with free_lengths, in place of stiffness"));
        f.list({"free_lengths", "", "m", positive, may_be_left_out,
                "lengths of the strands between pulley and slide that carry together: stiffness = c_sp (1/L_1 + 1/L_2 "
                "...)"},
               {}, {1, 10});
    });
}

template <class Use>
void each_task(Use&& use) {
    each_duty(use);
    each_linear_part(use);
}

}  // namespace lostmotion::tables
