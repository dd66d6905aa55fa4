#include "variables.hpp"

namespace lostmotion {

Variables::Variables(const model::Assembly& a) : train_(a.train()) {
    for (const TrainChannel& c : train_channels(a))
        all_.push_back({c.name, c.unit.empty() ? "1" : c.unit, c.meaning, c.symbol});
    channels_ = all_.size();
    add_twists();
    add_angles();
    add_efficiencies();
}

Variables::Variables(const Scenario& s) : Variables(model::Assembly(s.train)) {
    for (std::size_t a = 0; a < s.control.axes.size(); ++a) {
        const control::Axis& law = s.control.axes[a].law;
        const std::string prefix = s.prefix(s.control.axes[a]);
        const bool motor =
                       model::is_slide(train_, train_.motors[static_cast<std::size_t>(s.control.axes[a].motor)].shaft),
                   load = model::is_slide(train_, s.control.axes[a].reference_shaft);
        const auto add = [&](int signal, const control::AxisSignalName& named) {
            shown_.push_back({static_cast<int>(a), signal});
            all_.push_back({prefix + named.name, named.unit, named.meaning});
        };
        for (int k = 0; k < control::n_axis_signals; ++k)
            if (shows(law, k)) add(k, control::axis_signal_name(k, motor, load));
        for (int k = 0; k < control::n_winding_signals && law.field_orientation; ++k)
            add(control::n_axis_signals + k, control::winding_signal_names[static_cast<std::size_t>(k)]);
    }
}

int Variables::place(const std::string& name) const {
    for (std::size_t k = 0; k < all_.size(); ++k)
        if (all_[k].name == name) return static_cast<int>(k);
    return -1;
}

std::string Variables::unit(const std::string& name) const {
    const int k = place(name);
    return k < 0 ? "" : all_[static_cast<std::size_t>(k)].unit;
}

void Variables::derive(double* data, std::size_t stride, std::size_t k) const {
    const auto at = [&](int v) { return data[static_cast<std::size_t>(v) * stride + k]; };
    for (std::size_t d = 0; d < derived_.size(); ++d) data[(channels_ + d) * stride + k] = value(derived_[d], at);
}

bool Variables::shows(const control::Axis& a, int signal) {
    switch (signal) {
        case control::position_reference:
        case control::measured_position: return a.mode == control::Axis::position_mode;
        case control::speed_reference:
        case control::measured_speed: return a.mode != control::Axis::torque_mode && !a.firmware.present;
        case control::torque_reference: return true;
        case control::target_direction:
        case control::target_seen: return a.camera.present;
        case control::load_torque: return a.load_observer.present;
        default: return a.inverse_model.present;
    }
}

void Variables::add(Derived derived, Variable variable) {
    variable.name = model::shown_name(train_, variable.name);
    if (variable.name.empty()) return;
    derived_.push_back(derived);
    all_.push_back(std::move(variable));
}

void Variables::add_efficiencies() {
    for (std::size_t g = 0; g < train_.gears.size(); ++g) {
        const model::Gear& gear = train_.gears[g];
        const std::string name = model::gear_name(train_, g, "efficiency");
        if (!model::has_alias(train_, name)) continue;
        add({Derived::efficiency, place(model::gear_result(train_, g, "output_torque")), place(speed_of(gear.input)),
             place(model::gear_result(train_, g, "input_torque")), static_cast<int>(g)},
            {name, "1",
             "useful torque / torque fed in, by the direction of the load; 0 where both sides feed the losses, "
             "undefined "
             "at standstill",
             "eta"});
    }
    for (std::size_t m = 0; m < train_.motors.size(); ++m) {
        const std::string name = train_.motors[m].name + "_power";
        if (model::has_alias(train_, name))
            add({Derived::product, place(model::motor_torque_of(train_, m)), place(speed_of(train_.motors[m].shaft))},
                {name, "W", "mechanical power of the motor", "p"});
    }
}

void Variables::add_twists() {
    for (std::size_t g = 0; g < train_.gears.size(); ++g)
        if (place(model::twist_of(train_, g)) < 0)
            add({Derived::nothing},
                {model::gear_name(train_, g, "twist"), model::angle_unit(train_, train_.gears[g].output),
                 model::twist_meaning(train_, g), "d"});
}

void Variables::add_angles() {
    std::vector<std::size_t> waiting;
    const auto angle = [&](int shaft) { return model::angle_of(train_, static_cast<std::size_t>(shaft)); };
    for (std::size_t s = 0; s < train_.shafts.size(); ++s)
        if (place(model::angle_of(train_, s)) >= 0) waiting.push_back(s);
    while (!waiting.empty()) {
        const int shaft = static_cast<int>(waiting.back());
        waiting.pop_back();
        for (std::size_t g = 0; g < train_.gears.size(); ++g) {
            const model::Gear& gear = train_.gears[g];
            if (gear.housing >= 0 || (gear.input != shaft && gear.output != shaft)) continue;
            const bool forward = gear.input == shaft;
            const int other = forward ? gear.output : gear.input;
            if (place(angle(other)) >= 0) continue;
            if (model::shown_name(train_, angle(other)).empty()) continue;
            add({forward ? Derived::angle_of_output : Derived::angle_of_input, place(angle(shaft)),
                 place(model::twist_of(train_, g)), -1, static_cast<int>(g)},
                {angle(other), model::angle_unit(train_, other), model::angle_meaning(train_, other), "phi"});
            waiting.push_back(static_cast<std::size_t>(other));
        }
    }
}

double Variables::rate(const Derived& d, const double* x, const double* dx) const {
    switch (d.kind) {
        case Derived::nothing: return 0.0;
        case Derived::product: return dx[d.a] * x[d.b] + x[d.a] * dx[d.b];
        case Derived::efficiency: {
            const double eta = efficiency(x[d.a], x[d.b], x[d.c], ratio(d));
            if (eta == 0.0) return 0.0;
            const double relative = dx[d.a] / x[d.a] - dx[d.c] / x[d.c];
            return x[d.a] * x[d.b] * ratio(d) >= 0.0 ? eta * relative : -eta * relative;
        }
        default: break;
    }
    const model::Gear& gear = train_.gears[static_cast<std::size_t>(d.gear)];
    if (d.kind == Derived::angle_of_input) return gear.law.ratio * (dx[d.a] + dx[d.b]);
    const model::PeriodicCurve& e = gear.transmission_error;
    const double slope = e.present() ? e.slope(e.piece(x[d.a] - e.turn(x[d.a]))) : 0.0;
    return dx[d.a] / gear.law.ratio - dx[d.b] - slope * dx[d.a];
}

double Variables::efficiency(double T_2, double w_M, double T_1, double ratio) {
    if (w_M == 0.0) return std::numeric_limits<double>::quiet_NaN();
    const double s = std::copysign(1.0, w_M), driving = T_2 * s * std::copysign(1.0, ratio),
                 fed_in = std::fabs(ratio) * T_1 * s;
    if (driving >= 0.0) return driving / fed_in;
    return fed_in < 0.0 ? fed_in / driving : 0.0;
}

}  // namespace lostmotion
