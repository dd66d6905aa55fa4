// A shaft, or a slide in its place: a speed with inertia, viscous friction, dry friction, drag over speed and an
// external torque.
#pragma once

#include <string>

#include "dry_friction.hpp"
#include "field.hpp"
#include "torsion_curve.hpp"

namespace lostmotion::model {

// Of a slide angles are positions [m], torques forces [N], the inertia is a mass [kg]. No equation depends on it, only
// names and units.
enum class Domain { rotation, translation };

struct Shaft {
    std::string name;
    Domain domain = Domain::rotation;
    double inertia = 0.0;           // [kg m2], without the rotors and gear inertias on it
    double viscous_friction = 0.0;  // [N m s/rad]
    DryFriction friction;
    bool loaded = false;  // has an input: the load torque M_Z [N m] that acts against it
    // Its motion is given: it has two inputs, its speed [rad/s] and the rate of that [rad/s^2], and no equation of
    // motion.
    bool given_motion = false;
    // Torque [N m] against the motion over speed [rad/s]: odd, piecewise linear; present if it has a slope.
    TorsionCurve drag{{}, {0.0}};

    // Its own numbers; friction and drag are parts of it.
    template <class Fields>
    void describe(Fields& f) {
        f.number({"inertia", "J", "kg*m^2", Range::not_negative, Given::has_default,
                  "of the shaft and what is fixed to it, without rotors and inertias of gears"},
                 inertia);
        f.number({"viscous_friction", "b", "N*m*s/rad", Range::not_negative, Given::has_default, "against the frame"},
                 viscous_friction);
    }

    bool has_drag() const { return drag.max_slope() > 0.0; }
    // A quadratic drag c w |w| up to `top` [rad/s], by chords that depart from it by at most `error` [N m]; beyond, it
    // goes on in a straight line.
    static TorsionCurve quadratic_drag(double c, double top, double error) {
        const int n = std::max(1, static_cast<int>(std::ceil(top / std::sqrt(4.0 * error / c))));  // c h^2/4
        std::vector<double> breaks, slopes;
        for (int k = 0; k < n; ++k) {
            slopes.push_back(c * top * (2 * k + 1) / n);
            if (k + 1 < n) breaks.push_back(top * (k + 1) / n);
        }
        return TorsionCurve(std::move(breaks), std::move(slopes));
    }
};

}  // namespace lostmotion::model
