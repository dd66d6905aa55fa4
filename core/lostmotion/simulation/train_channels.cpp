#include "train_channels.hpp"

namespace lostmotion {

std::size_t first_reference(const model::Assembly& a) {
    const auto& all = a.places().controllers;
    return static_cast<std::size_t>(all.empty() ? a.layout().inputs : all[0].reference);
}

void add_controller_channels(const model::Assembly& a, int controller, std::vector<TrainChannel>& out) {
    using C = TrainChannel;
    const auto k = static_cast<std::size_t>(controller);
    const model::LinearController& c = a.train().controllers[k];
    const model::ControllerPlace& p = a.places().controllers[k];
    const model::Train& t = a.train();
    const bool angle = c.compared.kind == model::LinearController::Signal::angle;
    const std::string unit = angle ? model::angle_unit(t, c.compared.shaft) : model::speed_unit(t, c.compared.shaft);
    out.push_back({C::output, controller, c.name + "_command", "", "command that the controller gives"});
    out.push_back({C::input, p.reference, c.name + "_reference", unit, "reference of the controller"});
    out.push_back({C::error, controller, c.name + "_error", unit, "reference less what is measured"});
    if (p.reference_rate != model::nowhere)
        out.push_back({C::input, p.reference_rate, c.name + "_reference_rate", unit + (angle ? "/s" : "^2"),
                       "rate of the reference"});
    for (std::size_t j = 0; j < c.states.size(); ++j)
        out.push_back(
            {C::state, p.first_state + static_cast<int>(j), c.name + "_" + c.states[j], "", "state of the controller"});
}

namespace {

// In the order and the words of the paper.
std::vector<TrainChannel> short_channels(const model::Assembly& a) {
    using C = TrainChannel;
    const model::Places& p = a.places();
    const auto contact = [](int place, C::Kind sign, int index, const char* name, const char* meaning) {
        return place == model::nowhere ? C{sign, index, name, "1", meaning}
                                       : C{C::contact_mode, place, name, "1", meaning};
    };
    return {
        {C::input, p.motors[0].command, "command", "1", "control signal, relative armature voltage", "E_C"},
        {C::input, p.shafts[1].load, "load_torque", "N*m", "disturbance torque on the load", "M_Z"},
        {C::motor_torque, 0, "motor_torque", "N*m", "torque of the motor", "M_D"},
        {C::state, p.shafts[0].speed, "motor_speed", "rad/s", "speed of rotor and input shaft", "w_M"},
        {C::state, p.shafts[1].speed, "load_speed", "rad/s", "speed of the load", "w"},
        {C::state, a.layout().coupled, "load_angle", "rad", "angle of the load", "phi"},
        {C::state, p.gears[0].twist, "twist", "rad", "torsion of the gearbox, input angle / ratio - output angle", "d"},
        {C::output_torque, 0, "output_torque", "N*m", "torque of the gearbox on the load", "T_2"},
        {C::input_torque, 0, "input_torque", "N*m", "torque of the gearbox on the input shaft", "T_1"},
        {C::loss_coefficient, 0, "loss_coefficient", "1",
         "torque lost in the gearbox, at the output, / rated output torque", "m_2B"},
        contact(p.shafts[0].contact, C::shaft_sign, 0, "input_contact", "input shaft: +1 or -1 slipping, 0 stuck"),
        contact(p.gears[0].contact, C::twist_sign, 0, "twist_contact", "twist: +1 or -1 slipping, 0 stuck"),
        contact(p.shafts[1].contact, C::shaft_sign, 1, "load_contact", "load bearing: +1 or -1 slipping, 0 stuck"),
    };
}

bool is_given(const model::Places& p, int input) {
    return std::any_of(p.shafts.begin(), p.shafts.end(), [input](const model::ShaftPlace& s) {
        return input == s.given_speed || input == s.given_acceleration;
    });
}

}  // namespace

std::vector<TrainChannel> train_channels(const model::Assembly& a) {
    using C = TrainChannel;
    const model::Train& t = a.train();
    const model::Places& p = a.places();
    if (t.short_form) return short_channels(a);
    std::vector<C> out;
    const auto inputs = model::input_names(a);
    for (std::size_t k = 0; k < inputs.size(); ++k) {
        if (k >= first_reference(a)) break;
        if (is_given(p, static_cast<int>(k))) continue;  // the speed is a state
        const auto loaded = std::ranges::find(p.shafts, static_cast<int>(k), &model::ShaftPlace::load);
        if (loaded == p.shafts.end()) {
            out.push_back({C::input, static_cast<int>(k), inputs[k], "", "command"});
        } else {
            const int s = static_cast<int>(loaded - p.shafts.begin());
            out.push_back({C::input, static_cast<int>(k), inputs[k], model::torque_unit(t, s),
                           model::is_slide(t, s) ? "force against the slide" : "torque against the shaft"});
        }
    }
    for (std::size_t k = 0; k < t.controllers.size(); ++k) add_controller_channels(a, static_cast<int>(k), out);
    for (std::size_t k = 0; k < t.motors.size(); ++k)
        out.push_back({C::motor_torque, static_cast<int>(k), model::motor_torque_of(t, k),
                       model::torque_unit(t, t.motors[k].shaft),
                       std::string(model::torque_word(t, t.motors[k].shaft)) + " of the motor"});
    for (std::size_t k = 0; k < p.driven.size(); ++k) {
        const model::ShaftPlace& shaft = p.shafts[static_cast<std::size_t>(p.driven[k])];
        const std::string& name = t.shafts[static_cast<std::size_t>(p.driven[k])].name;
        const std::string word = model::torque_word(t, p.driven[k]);
        out.push_back({C::drive_torque, static_cast<int>(k), name + "_drive_" + word,
                       model::torque_unit(t, p.driven[k]), word + " that the given motion takes, in its direction"});
        out.push_back({C::input, shaft.given_acceleration, name + "_acceleration",
                       model::is_slide(t, p.driven[k]) ? "m/s^2" : "rad/s^2", "given acceleration"});
    }
    for (std::size_t k = 0; k < t.shafts.size(); ++k) {
        const int massless = p.shafts[k].massless;
        out.push_back({massless == model::nowhere ? C::state : C::massless_speed,
                       massless == model::nowhere ? p.shafts[k].speed : massless, t.shafts[k].name + "_speed",
                       model::speed_unit(t, static_cast<int>(k)),
                       model::is_slide(t, static_cast<int>(k)) ? "speed of the slide" : "speed of the shaft"});
    }
    const auto add_angle = [&](int state, std::size_t k) {
        const int shaft = static_cast<int>(k);
        out.push_back(
            {C::state, state, model::angle_of(t, k), model::angle_unit(t, shaft), model::angle_meaning(t, shaft)});
    };
    for (std::size_t k = 0; k < t.shafts.size(); ++k)
        if (p.shafts[k].angle != model::nowhere) add_angle(p.shafts[k].angle, k);
    for (int part = 0; part < a.layout().angles; ++part) {
        const auto last = static_cast<std::size_t>(p.last_shaft[static_cast<std::size_t>(part)]);
        if (p.shafts[last].angle == model::nowhere) add_angle(a.layout().coupled + part, last);
    }
    for (std::size_t k = 0; k < t.gears.size(); ++k) {
        const int gear = static_cast<int>(k);
        const int input = t.gears[k].input, output = t.gears[k].output;
        if (!t.gears[k].rigid())
            out.push_back({C::state, p.gears[k].twist, model::twist_of(t, k), model::angle_unit(t, output),
                           model::twist_meaning(t, k)});
        out.push_back({C::output_torque, gear, model::gear_result(t, k, "output_torque"), model::torque_unit(t, output),
                       model::is_slide(t, output) ? "force on the slide" : "torque on the output shaft"});
        out.push_back({C::input_torque, gear, t.gears[k].name + "_input_" + model::torque_word(t, input),
                       model::torque_unit(t, input),
                       model::is_slide(t, input) ? "force taken from the slide" : "torque taken from the input shaft"});
    }
    for (int c = 0; c < a.layout().contacts; ++c) {
        const std::string name = model::contact_name(a, c);
        const int shaft = model::contact_shaft(a, c);
        out.push_back({C::contact_torque, c, name + "_" + model::torque_word(t, shaft), model::torque_unit(t, shaft),
                       "what the dry contact takes"});
        out.push_back({C::contact_mode, c, name, "", "slips forward (+1) or backward (-1), or is stuck (0)"});
    }
    return out;
}

}  // namespace lostmotion
