#include "field_orientation.hpp"

#include "../base/powers.hpp"

namespace lostmotion::control {

void FieldOrientation::place(Slots& slots) {
    first_ = slots.take(n_own);
    steepest_ = circle_i_d();
    const double R = winding.resistance;
    K_d_ = -gain * R / exponential_minus_one(-R * sample_time / winding.inductance_d);
    K_q_ = -gain * R / exponential_minus_one(-R * sample_time / winding.inductance_q);
    K_i_ = gain * R;
    for (SampleDelay* d : {&delay_d_, &delay_q_, &delay_angle_}) {
        *d = delay;
        d->place(slots);
    }
}

void FieldOrientation::start(double angle, double speed, double* slot) const {
    const double w_e = winding.pole_pairs * speed;
    slot[first_ + u_q] = std::clamp(w_e * winding.flux_linkage, -voltage_limit, voltage_limit);
    slot[first_ + stator_angle] = winding.pole_pairs * (angle + 0.5 * speed * delay_time);
    delay_d_.fill(0.0, slot);
    delay_q_.fill(slot[first_ + u_q], slot);
    delay_angle_.fill(slot[first_ + stator_angle], slot);
    slot[first_ + available] = largest_torque(0.0, w_e);
}

void FieldOrientation::follow(DirectQuadrature wanted, DirectQuadrature i, const Reading& y, double* slot) const {
    double* own = slot + first_;
    const double w_e = winding.pole_pairs * y.speed;
    const double e_d = wanted.d - i.d, e_q = wanted.q - i.q;
    const double v_d = K_d_ * e_d + own[integral_d] - decoupling * w_e * winding.inductance_q * i.q;
    const double v_q = K_q_ * e_q + own[integral_q] + decoupling * w_e * winding.inductance_d * i.d +
                       back_emf * w_e * winding.flux_linkage;
    own[wanted_square] = v_d * v_d + v_q * v_q;
    const double share = within_circle(own[wanted_square]);
    own[beyond] = share < 1.0 ? sign_of(e_q) : 0.0;
    own[integral_d] += K_i_ * (e_d + (share - 1.0) * v_d / K_d_);
    own[integral_q] += K_i_ * (e_q + (share - 1.0) * v_q / K_q_);
    command({share * v_d, share * v_q}, y, slot);
}

void FieldOrientation::settle(double torque, double weakened, DirectQuadrature voltage, const Reading& y,
                              double* slot) const {
    double* own = slot + first_;
    own[integral_d] = own[integral_q] = 0.0;
    for (int round = 0; round < 2; ++round) {  // the first finds what the integrators have to give
        own[weakening] = weakened;
        own[wanted_square] = voltage.d * voltage.d + voltage.q * voltage.q;
        const DirectQuadrature held{own[integral_d], own[integral_q]};
        control(torque, y, slot);
        own[integral_d] = held.d + voltage.d - own[u_d];
        own[integral_q] = held.q + voltage.q - own[u_q];
    }
}

auto FieldOrientation::within_limits(DirectQuadrature voltage) const -> DirectQuadrature {
    const double share = within_circle(voltage.d * voltage.d + voltage.q * voltage.q);
    return {share * voltage.d, share * voltage.q};
}

void FieldOrientation::command(DirectQuadrature voltage, const Reading& y, double* slot) const {
    double* own = slot + first_;
    own[u_d] = voltage.d;
    own[u_q] = voltage.q;
    own[stator_angle] = winding.pole_pairs * (y.angle + y.speed * (delay_time + 0.5 * sample_time));
}

bool FieldOrientation::finite(const double* slot) const {
    return std::isfinite(slot[first_ + u_d]) && std::isfinite(slot[first_ + u_q]) &&
           std::isfinite(slot[first_ + stator_angle]);
}

void FieldOrientation::act(double* slot) const {
    double* own = slot + first_;
    own[acting_d] = delay_d_(own[u_d], slot);
    own[acting_q] = delay_q_(own[u_q], slot);
    own[acting_angle] = delay_angle_(own[stator_angle], slot);
}

auto FieldOrientation::voltage(double angle, const double* slot) const -> DirectQuadrature {
    const double* own = slot + first_;
    return turned({own[acting_d], own[acting_q]}, own[acting_angle] - winding.pole_pairs * angle);
}

auto FieldOrientation::least_current(double torque) const -> DirectQuadrature {
    const double linear = 1.5 * winding.pole_pairs * winding.flux_linkage, most = std::fabs(torque) / linear;
    if (winding.saliency() == 0.0 || torque == 0.0) return {0.0, torque / linear};
    const double D = -winding.flux_linkage / (2.0 * winding.saliency());
    double i_q = most, i_d = 0.0;
    for (int round = 0; round < 50; ++round) {
        const double root = std::copysign(std::sqrt(D * D + i_q * i_q), D);
        i_d = -i_q * i_q / (D + root);
        const double slope =
            1.5 * winding.pole_pairs * (winding.flux_linkage + winding.saliency() * (i_d - i_q * i_q / root));
        const double step = (winding.torque(i_d, i_q) - std::fabs(torque)) / slope;
        i_q -= step;
        if (!(step > 1e-15 * most)) break;
    }
    return {i_d, std::copysign(i_q, torque)};
}

auto FieldOrientation::turned(DirectQuadrature v, double angle) -> DirectQuadrature {
    const auto [sine, cosine] = sine_cosine(angle);
    return {cosine * v.d - sine * v.q, sine * v.d + cosine * v.q};
}

double FieldOrientation::circle_i_d() const {
    const double S = winding.saliency(), psi = winding.flux_linkage;
    if (S == 0.0) return 0.0;
    return 2.0 * S * current_limit * current_limit /
           (psi + std::sqrt(psi * psi + 8.0 * S * S * current_limit * current_limit));
}

double FieldOrientation::most_i_q(double i_d, double w_e) const {
    const double most = std::sqrt(current_limit * current_limit - i_d * i_d);
    if (i_d > least_i_d() || i_d <= -current_limit) return most;
    return std::fmin(most, voltage_limit / (std::fabs(w_e) * winding.inductance_q));
}

double FieldOrientation::largest_torque(double weakened, double w_e) const {
    const double i_d = std::clamp(steepest_ + weakened, least_i_d(), current_limit);
    return std::fabs(winding.torque(i_d, most_i_q(i_d, w_e)));
}

auto FieldOrientation::wanted(double torque, double speed, double* slot) const -> DirectQuadrature {
    double* own = slot + first_;
    const double psi = winding.flux_linkage, w_e = winding.pole_pairs * speed;
    const double w_b = std::fmax(std::fabs(w_e), voltage_limit / psi);
    const double u_f = weakening_voltage * voltage_limit, spare = u_f * u_f - own[wanted_square];
    own[weakening] += field_weakening * spare / (2.0 * w_b * w_b * winding.inductance_d * psi);
    double M = torque;
    if (limited) {
        own[weakening] = std::clamp(own[weakening], -current_limit, 0.0);
        own[available] = largest_torque(own[weakening], w_e);
        M = std::clamp(torque, -own[available], own[available]);
    }
    const double i_d = std::clamp(least_current(M).d + own[weakening], least_i_d(), current_limit);
    const double i_q = M / (1.5 * winding.pole_pairs * (psi + winding.saliency() * i_d)), most = most_i_q(i_d, w_e);
    return {i_d, limited ? std::clamp(i_q, -most, most) : i_q};
}

}  // namespace lostmotion::control
