#include "breakaway.hpp"

namespace lostmotion {

double Breakaway::command(int motor, int s) {
    const model::ShaftMotor& m = train_.motors[static_cast<std::size_t>(motor)];
    left_out_ = motor;
    loop_ = false;
    visited_.assign(train_.shafts.size(), false);
    const double needed = to_turn(m.shaft, s, nullptr);
    // The command of a stepper is an angle.
    return loop_ || m.law.kind == Motor::stepper ? std::numeric_limits<double>::quiet_NaN()
                                                 : needed / m.law.stall_torque();
}

double Breakaway::to_turn(int shaft, int s, const void* from) {
    visited_[static_cast<std::size_t>(shaft)] = true;
    double needed = -acting(shaft);
    for (const model::CapacityShare& c : model::shaft_capacity(assembly_, shaft, 0.0, now_, nullptr))
        needed += s * c.forward;
    for (std::size_t g = 0; g < train_.gears.size(); ++g) {
        const model::Gear& gear = train_.gears[g];
        if (gear.housing != model::nowhere) {
            loop_ = loop_ || gear.input == shaft || gear.output == shaft || gear.housing == shaft;
            continue;
        }
        if (&gear == from || (gear.input != shaft && gear.output != shaft)) continue;
        needed += gear.input == shaft ? to_drive(static_cast<int>(g), s) : to_drive_back(static_cast<int>(g), s);
    }
    for (const auto& c : assembly_.places().couplings)
        if (c->is_dry() && c.get() != from && (c->input == shaft || c->output == shaft))
            needed += to_carry(*c, c->input == shaft, s);
    return needed;
}

bool Breakaway::reaches_a_loop(int shaft) {
    if (!visited_[static_cast<std::size_t>(shaft)]) return false;
    loop_ = true;
    return true;
}

double Breakaway::acting(int shaft) const {
    double sum = 0.0;
    for (std::size_t m = 0; m < train_.motors.size(); ++m)
        if (train_.motors[m].shaft == shaft && static_cast<int>(m) != left_out_) sum += torque_at_rest(m);
    for (const auto& e : assembly_.places().acting)
        if (e->shaft == shaft && e->acts_at_rest())
            sum += model::evaluate(assembly_.layout(), e->torque(assembly_.site(shaft), key_), now_);
    if (ties_.at_rest[static_cast<std::size_t>(shaft)])
        for (const auto& c : assembly_.places().couplings) sum += passed_on(*c, shaft);
    const int load = assembly_.places().shafts[static_cast<std::size_t>(shaft)].load;
    return load == model::nowhere ? sum : sum - input(load);
}

double Breakaway::passed_on(const model::CouplingElement& c, int shaft) const {
    if (c.input != shaft && c.output != shaft) return 0.0;
    const double torque = model::evaluate(assembly_.layout(), c.torque(assembly_.between(c, ties_, key_), key_), now_);
    return c.output == shaft ? torque : -torque;
}

double Breakaway::torque_at_rest(std::size_t m) const {
    const model::ShaftMotor& motor = train_.motors[m];
    const model::MotorPlace& p = assembly_.places().motors[m];
    if (p.controller == model::nowhere) return motor.torque_at_rest(input(p.command));
    const model::Row u = assembly_.controller_command(p.controller, key_);
    return motor.law.stall_torque() * model::evaluate(assembly_.layout(), u, now_);
}

double Breakaway::input_torque(int g, double T, int s) const {
    const model::Gear& gear = train_.gears[static_cast<std::size_t>(g)];
    const double T_1 = assembly_.per_input(g, key_) * T;
    if (!gear.has_dry_losses())
        return gear.law.losses == Gearbox::constant_efficiency ? T_1 / gear.law.efficiency : T_1;
    return T_1 + s * gear.loss(s * gear.sense() * T, 0.0).torque / gear.reduction();
}

std::vector<double> Breakaway::edges(int g) const {
    const model::Gear& gear = train_.gears[static_cast<std::size_t>(g)];
    std::vector<double> out;
    if (gear.has_dry_losses())
        for (int j = 0; j + 1 < gear.load_intervals(); ++j) out.push_back(gear.load_upper(j) * gear.rated_torque());
    return out;
}

double Breakaway::to_drive(int g, int s) {
    const model::Gear& gear = train_.gears[static_cast<std::size_t>(g)];
    if (reaches_a_loop(gear.output)) return 0.0;
    const int turned = gear.law.ratio < 0.0 ? -s : s;  // the output
    const double T_0 = T_2_[static_cast<std::size_t>(g)], T = to_turn(gear.output, turned, &gear);
    if (std::isinf(T)) return s * never;
    double hardest = s * input_torque(g, T, s);
    if (turned * (T - T_0) <= 0.0) return s * hardest;
    hardest = std::fmax(hardest, s * input_torque(g, T_0, s));
    for (const double load : edges(g))
        if (load > turned * T_0 && load < turned * T)
            hardest = std::fmax(hardest, s * input_torque(g, turned * load, s));
    return s * hardest;
}

double Breakaway::to_drive_back(int g, int s) {
    const model::Gear& gear = train_.gears[static_cast<std::size_t>(g)];
    if (reaches_a_loop(gear.input)) return 0.0;
    const int turned = gear.law.ratio < 0.0 ? -s : s;  // the input
    const double wanted = -turned * to_turn(gear.input, turned, &gear);
    if (std::isinf(wanted)) return s * never;
    const auto taken = [&](double load) { return turned * input_torque(g, s * load, turned); };
    double load = s * T_2_[static_cast<std::size_t>(g)];
    const bool falls = taken(load) > wanted;  // else it has been wound up too far, and is relieved
    std::vector<double> stops = edges(g);
    if (falls) std::reverse(stops.begin(), stops.end());
    for (const double stop : stops) {
        if (falls ? stop >= load : stop <= load) continue;
        if (falls == (taken(stop) <= wanted)) return -s * between(load, stop, taken, wanted);
        load = stop;
    }
    const double far = load + (falls ? -1.0 : 1.0) * gear.rated_torque();
    if ((taken(far) < taken(load)) != falls) return s * never;  // self-locking
    return -s * between(load, far, taken, wanted);
}

double Breakaway::to_carry(const model::CouplingElement& c, bool from_input, int s) {
    const int other = from_input ? c.output : c.input;
    if (reaches_a_loop(other)) return 0.0;
    model::CouplingInstant now = assembly_.places().instant_of(c, now_);
    if (c.branch != model::nowhere) now.mode = key_.branch[static_cast<std::size_t>(c.branch)];
    const double way = from_input ? 1.0 : -1.0;
    const double torque = way * to_turn(other, s, &c);  // that it has to pass on
    return way * std::clamp(torque, -c.capacity(-1, now, true), c.capacity(+1, now, true));
}

}  // namespace lostmotion
