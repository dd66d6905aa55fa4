// Motors and gears as scenario files write them, where the core takes other numbers, or none.
#pragma once

#include <limits>
#include <numbers>

#include "shaft_fields.hpp"

namespace lostmotion::tables {

using enum Range;
using enum Given;

inline constexpr double inf = std::numeric_limits<double>::infinity();
inline constexpr double absolute_zero = -273.15;  // [degC]

// A number > 0 that may be left out.
constexpr Field above_zero(const char* key, const char* unit, const char* meaning, const char* symbol = "") {
    return {key, symbol, unit, positive, may_be_left_out, meaning};
}

template <class Use>
void each_motor(Use&& use) {
    use("MotorHeat", [](auto& f) {
        f.number(above_zero("thermal_resistance", "K/W", "winding to ambient, in place of its two parts"));
        f.number(above_zero("thermal_resistance_winding_case", "K/W", "winding to case"));
        f.number(above_zero("thermal_resistance_case_ambient", "K/W", "case to ambient"));
        f.number(
            above_zero("thermal_time_constant_winding", "s", "of the winding against a case of constant temperature"));
        f.number(above_zero("thermal_time_constant_motor", "s", "of the case against the ambient"));
        f.number({"max_winding_temperature", "", "degC", any, may_be_left_out, "largest temperature of the winding"},
                 0.0, absolute_zero, inf);
    });
    use("MotorLimits", [](auto& f) {
        f.number(above_zero("continuous_torque", "N*m", "that it may give at all times"));
        f.number(above_zero("peak_torque", "N*m", "for seconds, as in acceleration"));
        f.number(above_zero("max_speed", "rad/s", "largest speed"));
        f.number(above_zero("resistance", "ohm", "resistance of the winding, at 25 °C"));
        f.number(above_zero("torque_constant", "N*m/A", "torque to one ampere of the armature, or to one ampere rms"));
        f.number(above_zero("max_voltage", "V",
                            "voltage limit of the amplifier of a torque source; a DC motor has `voltage_limit`"));
        f.number(
            above_zero("max_current", "A", "smaller limit of motor and amplifier, in the amperes of torque_constant"));
    });
    use("MotorData", [](auto& f) {
        f.number(above_zero("rated_voltage", "V",
                            "u_ZR, that of command 1. A change over a record or a base, by `--set` or in a study is "
                            "the same motor at another voltage: rated_speed and armature_voltage_constant follow so "
                            "that stall torque and no-load speed go with the voltage, unless they are given too",
                            "u_ZR"));
        f.number(above_zero("stall_torque", "N*m",
                            "at rated voltage, with no_load_speed in place of rated_speed and "
                            "armature_voltage_constant; what the shaft gives, if the currents are stated"));
        f.number(above_zero("no_load_speed", "rad/s",
                            "at rated voltage without load; without friction too, unless the currents are stated"));
        f.number(above_zero("stall_current", "A", "at rated voltage, with no_load_current", "I_S"));
        f.number(above_zero(
            "no_load_current", "A",
            "I_0: the friction of the motor is stall_torque I_0/(I_S - I_0), in place of friction_torque", "I_0"));
        f.number(above_zero("voltage_limit", "V", "largest voltage of the amplifier"));
        f.number(above_zero("dc_voltage", "V", "dc voltage of the amplifier that feeds a synchronous motor"));
    });
    use("Winding", [](auto& f) {
        f.integer({"pole_pairs", "p", "", any, may_be_left_out, "p"}, 0, 1, Entries::any);
        f.integer({"poles", "", "", any, may_be_left_out, "2 p, in place of pole_pairs"}, 0, 1, Entries::any);
        f.number(above_zero("resistance_phase", "ohm", "R", "R"));
        f.number(above_zero("resistance_line_to_line", "ohm", "between two terminals, 2 R"));
        f.number({"resistance_temperature", "", "degC", any, has_default, "at which the resistance holds"}, 25.0,
                 absolute_zero, inf);
        f.number(above_zero("inductance_phase", "H", "L_d = L_q; also called rotating field inductance"));
        f.number(above_zero("inductance_line_to_line", "H", "between two terminals, 2 L_d = 2 L_q"));
        f.number(above_zero("inductance_line_to_line_min", "H",
                            "least inductance of a salient rotor over its angle, 2 L_d"));
        f.number(above_zero("inductance_line_to_line_max", "H",
                            "largest inductance of a salient rotor over its angle, 2 L_q"));
        f.number(above_zero("inductance_d", "H", "L_d", "L_d"));
        f.number(above_zero("inductance_q", "H", "L_q", "L_q"));
        f.number(above_zero("flux_linkage", "V*s", "psi, amplitude of a phase", "psi"));
        f.number(above_zero("voltage_constant_line_to_line_rms", "V*s/rad",
                            "k_E, sqrt(3/2) p psi; as \"87 V/krpm\" too", "k_E"));
        f.number(above_zero("voltage_constant_line_to_line_peak", "V*s/rad", "sqrt(3) p psi"));
        f.number(above_zero("voltage_constant_phase_rms", "V*s/rad", "p psi/sqrt(2)"));
        f.number(above_zero("voltage_constant_phase_peak", "V*s/rad", "p psi"));
        f.number(above_zero("torque_constant_rms", "N*m/A", "k_T to one ampere rms, (3/sqrt(2)) p psi", "k_T"));
        f.number(above_zero("torque_constant_peak", "N*m/A", "to one ampere peak, 1.5 p psi"));
        f.number(above_zero("torque_constant_block", "N*m/A",
                            "to one ampere of the supply with block commutation, (3 sqrt(3)/pi) p psi"));
        f.number(above_zero("continuous_current_rms", "A", "current that the motor withstands permanently, at rest"));
        f.number(above_zero("continuous_current_peak", "A", "the same as amplitude"));
        f.number(
            above_zero("max_current_rms", "A", "smaller limit of motor and amplifier, effective value of a phase"));
        f.number(above_zero("max_current_peak", "A", "the same as amplitude"));
    });
}

template <class Use>
void each_gear(Use&& use) {
    use("LinearStiffness",
        [](auto& f) { f.number({"stiffness", "", "N*m/rad", positive, needed, "torque to the twist"}); });
    use("Rigid", [](auto& f) {
        f.number({"backlash", "", "rad", not_negative, has_default, "total gap at the output"});
        f.number({"restitution", "", "", share, may_be_left_out,
                  "speed at which the flanks part over that at which they strike; needed with backlash"});
    });
    use("Hysteresis", [](auto& f) {
        f.number({"efficiency", "eta_H", "", up_to_one, needed,
                  "eta_H, average efficiency of the hysteresis process; 1: none"});
    });
    use("ConstantEfficiency", [](auto& f) {
        f.number(
            {"efficiency", "eta_C", "", up_to_one, needed, "output power over input power, whichever side drives"});
    });
    use("LossMap", [](auto& f) {
        f.list({"speeds", "v", "", not_negative, needed, "v = |w_M|/n_1R, rising from 0"}, {}, {2, Entries::any});
        f.list({"loads", "mu", "", any, needed, "mu = T_2 sign(w_M)/T_2R, rising; positive where the motor drives"}, {},
               {2, Entries::any});
        f.matrix({"values", "m_2B", "", not_negative, needed, "m_2B, one row for each load, one entry for each speed"});
        f.flag({"mirrored", "", "", any, has_default, "loads begin at 0 and hold for both directions of power flow"},
               false);
    });
    use("MeshEfficiency", [](auto& f) {
        f.number({"drive_efficiency", "eta_f", "", up_to_one, needed, "eta_f, while the input drives"});
        f.number({"backdrive_efficiency", "eta_b", "", any, needed,
                  "eta_b, while the output drives; 0 or less: self-locking"},
                 0.0, -inf, 1.0);
    });
    use("WormMesh", [](auto& f) {
        f.number(above_zero("lead_angle", "rad", "g, at the reference diameter", "g"));
        f.number(above_zero("module", "m", "axial module m", "m"));
        f.integer({"starts", "z", "", any, may_be_left_out, "threads z of the worm"}, 0, 1, 20);
        f.number(above_zero("diameter", "m", "reference diameter d of the worm; tan g = m z/d", "d"));
        f.number({"friction_angle", "r", "rad", not_negative, may_be_left_out, "r"});
        f.number({"friction_coefficient", "", "", not_negative, may_be_left_out, "in the mesh; r is its arc tangent"});
    });
    use("MeshStiffness", [](auto& f) {
        f.number(
            {"teeth", "", "", positive, needed,
             "teeth of the wheel on the input shaft; for other gears, mesh periods in one turn of the input shaft"});
        f.number({"contact_ratio", "", "", any, may_be_left_out,
                  "mean number of pairs of teeth in mesh; its fraction is the share of the period in which one pair "
                  "more meshes, with the factor 1"},
                 0.0, 1.0, inf);
        f.number({"fewer_pairs", "", "", up_to_one, may_be_left_out,
                  "factor on the stiffness while the fewer pairs mesh, below 1; with contact_ratio"});
        f.number(
            {"phase", "", "rad", any, has_default,
             "angle of the input shaft at which a period begins: with contact_ratio, at the middle of the more pairs"});
        f.pairs({"pairs", "", "", not_negative, has_default,
                 "in place of contact_ratio and fewer_pairs: from which share of a mesh period on, and the factor on "
                 "the stiffness"},
                positive, 1000);
    });
    use("GearboxLoads", [](auto& f) {
        f.number(above_zero("average_output_torque", "N*m", "for the mean over a duty cycle"));
        f.number(above_zero("peak_output_torque", "N*m", "repeated, as in acceleration"));
        f.number(above_zero("momentary_output_torque", "N*m", "in an emergency stop"));
        f.number(
            above_zero("average_input_speed", "rad/s",
                       "for the mean over a duty cycle; the drive check takes the rated speed where it is left out"));
        f.number(above_zero("max_input_speed", "rad/s", "largest speed of the input shaft"));
    });
    use("GearboxLimits", [](auto& f) {
        f.number(above_zero("rated_life", "s", "L10h at rated torque and rated speed"));
        f.number({"life_exponent", "p", "", positive, has_default,
                  "p of the life over the torque; 10/3 where roller bearings decide"},
                 3.0);
        f.number(above_zero("max_radial_force", "N", "on the output bearing"));
        f.number(above_zero("max_axial_force", "N", "on the output bearing"));
    });
    use("TransmissionData", [](auto& f) {
        f.pair({"loss_range", "", "", positive, may_be_left_out,
                "range of estimated losses: the multiples between which those of such gearboxes lie. No run depends on "
                "it; the drive check says which of its verdicts hold at both ends"},
               {});
    });
    use("Gearbox",
        [](auto& f) { f.need({"rated_input_speed", "rated_output_torque"}, [&] { Gearbox().describe(f); }); });
    use("Harmonic", [](auto& f) { HarmonicLaw().describe_angle(f); });
    use("AngleCurve", [](auto& f) {
        f.number({"period", "", "rad", positive, has_default, "left out, one turn of the shaft"},
                 2.0 * std::numbers::pi);
        f.list({"angles", "", "rad", not_negative, needed, "rising from 0, below the period"}, {}, {2, 1000});
    });
    use("Gravity", [](auto& f) {
        f.number({"mass", "m", "kg", positive, needed, "mass off the axis"});
        f.number({"radius", "r", "m", positive, needed, "distance of the centre of mass from the axis"});
        f.number({"angle", "", "rad", any, has_default,
                  "angle of the mass when the shaft's angle is 0; 0: it hangs straight down, positive in the direction "
                  "of the shaft's angle"});
        f.number(above_zero("error", "N*m",
                            "by which the straight lines depart from the sine at most; left out, 0.1 % of m g r"));
    });
}

template <class Use>
void each_law_over_angle(Use&& use) {
    const auto harmonic = [&](const char* name, const char* unit, const char* meaning) {
        use(name, [=](auto& f) { HarmonicLaw().describe_size(f, unit, meaning); });
    };
    const auto curve = [&](const char* name, const char* key, const char* unit, const char* meaning) {
        use(name, [=](auto& f) { f.list({key, "", unit, any, needed, meaning}, {}, {0, Entries::any}); });
    };
    harmonic("TorqueHarmonic", "N*m", "largest torque");
    harmonic("ErrorHarmonic", "rad", "at the output");
    harmonic("PitchHarmonic", "m", "at the slide");
    curve("TorqueCurve", "torques", "N*m", "torque at each angle");
    curve("ErrorCurve", "errors", "rad", "at the output");
    curve("PitchCurve", "errors", "m", "at the slide");
}

template <class Use>
void each_machine(Use&& use) {
    each_motor(use);
    each_gear(use);
    each_law_over_angle(use);
}

}  // namespace lostmotion::tables
