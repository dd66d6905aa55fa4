#include "train_explain.hpp"

namespace lostmotion {

std::vector<ContactReport> explain_contacts(const model::Assembly& a, const TrainPoint& p) {
    const model::Regime r = a.build(p.key);
    std::vector<double> T_2;
    for (const model::Row& T : r.output_torque) T_2.push_back(model::evaluate(a.layout(), T, p.now));
    std::vector<ContactReport> all;
    for (int c = 0; c < a.layout().contacts; ++c) {
        ContactReport report;
        report.name = model::contact_name(a, c);
        report.mode = r.at_rest[c] ? 0 : r.key.modes[c];
        report.speed = r.at_rest[c] ? 0.0 : model::evaluate(a.layout(), a.contact_speed(c), p.now);
        report.torque = model::evaluate(a.layout(), r.contact_torque[c], p.now);
        for (const auto& l : r.locked) {
            const model::ContactPlace& open = a.places().contacts[static_cast<std::size_t>(l.contact)];
            const bool springs = open.kind == model::ContactPlace::gear && !open.bilateral && !open.gap.present();
            if (!springs && std::as_const(r.contact_torque[c].c)[a.layout().first_memory + l.memory] != 0.0)
                report.determined = false;
        }
        report.shares = model::contact_capacity(a, c, r, p.now, T_2.data());
        for (const model::CapacityShare& s : report.shares) {
            report.capacity_forward += s.forward;
            report.capacity_backward += s.backward;
        }
        all.push_back(std::move(report));
    }
    return all;
}

std::vector<MotorReport> explain_motors(const model::Assembly& a, const TrainPoint& p) {
    Breakaway breakaway(a, a.build(p.key), p.now);
    std::vector<MotorReport> all;
    for (std::size_t m = 0; m < a.train().motors.size(); ++m)
        all.push_back({a.train().motors[m].name, breakaway.command(static_cast<int>(m), +1),
                       breakaway.command(static_cast<int>(m), -1)});
    return all;
}

}  // namespace lostmotion
