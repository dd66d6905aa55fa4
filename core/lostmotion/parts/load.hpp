// The driven body: eq. (3b), with optional dry friction in its bearing.
#pragma once

namespace lostmotion {

struct Load {
    double inertia = 1.0;           // J_Z [kg m2]
    double viscous_friction = 0.0;  // b_ZR [N m s/rad]
    double friction_torque = 0.0;   // dry friction [N m]; 0: no such contact
};

}  // namespace lostmotion
