#include "explain.hpp"

namespace lostmotion {

ContactReport explain_contact(const Drive& drive, const Regime& r, Contact c, const State& x, const Memory& m,
                              const std::array<double, n_inputs>& u) {
    ContactReport report;
    report.present = drive.has(c);
    if (!report.present) return report;
    report.mode = r.key.modes[c];
    report.speed = r.at_rest[c] ? 0.0 : evaluate(drive.contact_speed(c), x, m, u);
    const double T_2 = evaluate(r.output_torque, x, m, u);
    switch (c) {
        case input_contact: {
            report.torque = evaluate(r.input_friction, x, m, u);
            report.capacity_forward = drive.input_capacity(T_2, x[motor_speed], +1);
            report.capacity_backward = drive.input_capacity(T_2, x[motor_speed], -1);
            break;
        }
        case twist_contact:
            report.torque = evaluate(r.hysteresis_torque, x, m, u);
            report.capacity_forward = report.capacity_backward =
                drive.rigid() ? std::numeric_limits<double>::infinity() : m.hysteresis_capacity;
            break;
        default:
            report.torque = evaluate(r.load_friction, x, m, u);
            report.capacity_forward = report.capacity_backward = drive.load.friction_torque;
    }
    return report;
}

double breakaway_motor_torque(const Drive& drive, double T_2, int s) {
    const Gearbox& g = drive.gearbox;
    const double efficiency = g.losses == Gearbox::constant_efficiency ? g.efficiency : 1.0;
    return T_2 / (g.ratio * efficiency) + s * drive.input_capacity(T_2, 0.0, s);
}

double smallest_command(const Drive& drive, double T_2, double M_Z, int s) {
    const double freed = M_Z + s * drive.load.friction_torque;
    double needed = s * breakaway_motor_torque(drive, freed, s);
    const auto consider = [&](double T) {
        if ((T - T_2) * (T - freed) < 0.0) needed = std::fmax(needed, s * breakaway_motor_torque(drive, T, s));
    };
    if (s * (freed - T_2) > 0.0) {
        needed = std::fmax(needed, s * breakaway_motor_torque(drive, T_2, s));
        if (drive.gearbox.losses == Gearbox::loss_map)
            for (int j = 0; j + 1 < drive.gearbox.map.load_intervals(); ++j)
                consider(s * drive.gearbox.map.load_interval_upper(j) * drive.gearbox.rated_output_torque);
    }
    return s * needed / drive.motor.stall_torque();
}

}  // namespace lostmotion
