// The gearbox: a compliance and a loss law, chosen independently.
#pragma once

#include "field.hpp"
#include "loss_map.hpp"
#include "torsion_curve.hpp"

namespace lostmotion {

struct Gearbox {
    enum Compliance { rigid, torsion_curve };
    enum Losses { constant_efficiency, loss_map };

    double ratio = 1.0;             // i_C [-], input speed / output speed
    double inertia = 0.0;           // J_R [kg m2], on the input shaft
    double viscous_friction = 0.0;  // b_MR [N m s/rad], on the input shaft

    Compliance compliance = rigid;
    TorsionCurve curve;
    double hysteresis_efficiency = 1.0;  // eta_H [-]; 1: no hysteresis

    Losses losses = constant_efficiency;
    double efficiency = 1.0;           // eta_C [-], for constant_efficiency (5b), in both directions of power flow
    LossMap map;                       // m_2B(mu, v), for loss_map (12)
    double rated_input_speed = 1.0;    // n_1R [rad/s], scales v
    double rated_output_torque = 1.0;  // T_2R [N m], scales mu and m_2B

    template <class Fields>
    void describe(Fields& f) {
        f.number({"ratio", "i_C", "", Range::any, Given::needed,
                  "i_C, input speed / output speed; below 0, the output turns against the input"},
                 ratio);
        f.number({"inertia", "J_R", "kg*m^2", Range::not_negative, Given::has_default, "J_R, on the input shaft"},
                 inertia);
        f.number({"viscous_friction", "b_MR", "N*m*s/rad", Range::not_negative, Given::has_default,
                  "b_MR, on the input shaft"},
                 viscous_friction);
        bool compliant = compliance == torsion_curve;
        f.curve_if("stiffness", compliant, curve);
        compliance = compliant ? torsion_curve : rigid;
        f.number({"hysteresis.efficiency", "eta_H", "", Range::up_to_one, Given::none}, hysteresis_efficiency);
        f.choice("losses", losses, {"constant_efficiency", "loss_map"});
        f.number({"losses.efficiency", "eta_C", "", Range::positive, Given::none}, efficiency);
        if (losses == loss_map) f.curve("loss_map", map);
        f.number({"rated_input_speed", "n_1R", "rad/s", Range::positive, Given::may_be_left_out, "n_1R"},
                 rated_input_speed);
        f.number({"rated_output_torque", "T_2R", "N*m", Range::positive, Given::may_be_left_out, "T_2R"},
                 rated_output_torque);
        if constexpr (Fields::reads) {
            if (f.well() && ratio == 0.0) f.wrong("ratio", "must not be 0");
            if (f.well() && compliant && !(curve.max_slope() > 0.0)) f.wrong("stiffness", "must be > 0 somewhere");
            if (f.well() && curve.min_slope() < 0.0) f.wrong("stiffness", "must not fall");
        }
    }

    bool has_hysteresis() const { return compliance == torsion_curve && hysteresis_efficiency < 1.0; }

    // Capacity h [N m] that eq. (16b) sets at a turning point with twist d.
    double hysteresis_capacity(double d) const {
        return 0.5 * (1.0 - hysteresis_efficiency) * std::fabs(curve.torque(d));
    }
    // dh/dd of the same [N m/rad].
    double hysteresis_capacity_slope(double d) const {
        const double P = curve.torque(d);
        return P == 0.0 ? 0.0 : hysteresis_capacity(d) / P * curve.slope(curve.locate(d));
    }

    // Torque M_2B [N m at the output] of (12) that a loss map holds at most at rest before the input shaft turns;
    // driven: T_2 [N m] in that direction.
    double loss_at_rest(double driven) const {
        return losses == loss_map ? rated_output_torque * map(driven / rated_output_torque, 0.0) : 0.0;
    }
    // The same as forms.
    template <class F>
    LossTerms<F> loss_terms(int one, int speed, const F& T_2) const {
        return {rated_output_torque, rated_input_speed, ratio, one, speed, T_2};
    }
};

}  // namespace lostmotion
