// Powers and energies of the elements. Each power is a product of two linear forms, a torque and a speed.
#pragma once

namespace lostmotion {

template <class F>
struct Power {
    F torque, speed;  // [N m], [rad/s]
};

// Viscous friction b [N m s/rad] at this speed.
template <class F>
Power<F> viscous_power(double b, const F& speed) {
    return {b * speed, speed};
}

// Losses of a mesh: (T_1 - T_2 r) w, where w is the speed of the input shaft relative to the housing and r that of the
// twist's rate over w, 1/i but for a transmission error. Negative where a constant efficiency creates energy.
template <class F>
Power<F> mesh_power(const F& T_1, const F& T_2, double per_input, const F& speed) {
    return {T_1 - per_input * T_2, speed};
}

// [J]
inline double kinetic_energy(double inertia, double speed) { return 0.5 * inertia * speed * speed; }
// What it grows by from one speed to another. The difference of two energies would lose the digits of a small change.
inline double kinetic_energy(double inertia, double from, double to) {
    return 0.5 * inertia * (to + from) * (to - from);
}
// Of two speeds that a mass matrix couples: what M_ab w_a w_b grows by.
inline double coupled_kinetic_energy(double inertia, double a_from, double a_to, double b_from, double b_to) {
    return 0.5 * inertia * ((a_to + a_from) * (b_to - b_from) + (a_to - a_from) * (b_to + b_from));
}

}  // namespace lostmotion
