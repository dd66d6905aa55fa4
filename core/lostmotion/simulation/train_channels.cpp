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
    std::vector<C> out;
    const auto add = [&](C channel) {
        channel.name = model::shown_name(t, channel.name);
        if (!channel.name.empty()) out.push_back(std::move(channel));
    };
    const auto inputs = model::input_names(a);
    for (std::size_t k = 0; k < inputs.size(); ++k) {
        if (k >= first_reference(a)) break;
        if (is_given(p, static_cast<int>(k))) continue;  // the speed is a state
        const auto loaded = std::ranges::find(p.shafts, static_cast<int>(k), &model::ShaftPlace::load);
        const auto motor = std::ranges::find(p.motors, static_cast<int>(k), &model::MotorPlace::command);
        if (motor != p.motors.end() &&
            t.motors[static_cast<std::size_t>(motor - p.motors.begin())].law.kind == Motor::stepper) {
            out.push_back({C::input, static_cast<int>(k), inputs[k], "rad", "angle of the field", "phi*"});
        } else if (loaded == p.shafts.end()) {
            out.push_back({C::input, static_cast<int>(k), inputs[k], "1", "command: 1 is the rated value", "E_C"});
        } else {
            const int s = static_cast<int>(loaded - p.shafts.begin());
            out.push_back({C::input, static_cast<int>(k), inputs[k], model::torque_unit(t, s),
                           model::is_slide(t, s) ? "force against the slide" : "torque against the shaft", "M_Z"});
        }
    }
    for (std::size_t k = 0; k < t.controllers.size(); ++k) add_controller_channels(a, static_cast<int>(k), out);
    for (std::size_t k = 0; k < t.motors.size(); ++k)
        out.push_back({C::motor_torque, static_cast<int>(k), model::motor_torque_of(t, k),
                       model::torque_unit(t, t.motors[k].shaft),
                       std::string(model::torque_word(t, t.motors[k].shaft)) + " of the motor", "M_D"});
    for (std::size_t k = 0; k < t.motors.size(); ++k)
        if (t.motors[k].law.kind == Motor::stepper)
            out.push_back({C::field_lead, static_cast<int>(k), t.motors[k].name + "_electrical_angle", "rad",
                           "electrical angle of the field before the rotor; from pi on the rotor slips", "delta"});
    for (std::size_t k = 0; k < t.motors.size(); ++k)
        for (int phase = 0; p.motors[k].current != model::nowhere && phase < 2; ++phase)
            out.push_back({C::state, p.motors[k].current + phase, model::phase_current_of(t, k, phase), "A",
                           "current of a phase", phase == 0 ? "i_a" : "i_b"});
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
        const int massless = p.shafts[k].massless, shaft = static_cast<int>(k);
        const bool motor = std::ranges::find(t.motors, shaft, &model::ShaftMotor::shaft) != t.motors.end();
        out.push_back({massless == model::nowhere ? C::state : C::massless_speed,
                       massless == model::nowhere ? p.shafts[k].speed : massless, t.shafts[k].name + "_speed",
                       model::speed_unit(t, shaft),
                       model::is_slide(t, shaft) ? "speed of the slide" : "speed of the shaft", motor ? "w_M" : "w"});
    }
    const auto add_angle = [&](int state, std::size_t k) {
        const int shaft = static_cast<int>(k);
        add({C::state, state, model::angle_of(t, k), model::angle_unit(t, shaft), model::angle_meaning(t, shaft),
             "phi"});
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
        if (!t.gears[k].rigid() || model::has_alias(t, model::gear_name(t, k, "twist")))
            out.push_back({C::state, p.gears[k].twist, model::twist_of(t, k), model::angle_unit(t, output),
                           model::twist_meaning(t, k), "d"});
        out.push_back({C::output_torque, gear, model::gear_result(t, k, "output_torque"), model::torque_unit(t, output),
                       model::is_slide(t, output) ? "force on the slide" : "torque on the output shaft", "T_2"});
        add({C::input_torque, gear, model::result_name(t.gears[k].name, "input_torque", model::is_slide(t, input)),
             model::torque_unit(t, input),
             model::is_slide(t, input) ? "force taken from the slide" : "torque taken from the input shaft", "T_1"});
        if (const std::string loss = model::gear_name(t, k, "loss_coefficient"); model::has_alias(t, loss))
            add({C::loss_coefficient, gear, loss, "1", "torque lost in the gear, at the output, / rated output torque",
                 "m_2B"});
    }
    constexpr const char* slips = "slips forward (+1) or backward (-1), or is stuck (0)";
    constexpr const char* parts = "touches (0), or is apart (-1)";
    for (const model::ShownContact& c : model::shown_contacts(a)) {
        const bool gear = c.kind == model::ContactPlace::gear;
        if (c.contact == model::nowhere) {
            out.push_back({gear ? C::twist_sign : C::shaft_sign, c.element, c.name, "1", slips});
            continue;
        }
        const int shaft = model::contact_shaft(a, c.contact);
        if (c.kind != model::ContactPlace::stop)
            add({C::contact_torque, c.contact, c.name + "_" + model::torque_word(t, shaft),
                 model::torque_unit(t, shaft), "what the dry contact takes"});
        out.push_back({C::contact_mode, c.contact, c.name, "1",
                       p.contacts[static_cast<std::size_t>(c.contact)].gap.present() ? parts : slips});
    }
    for (std::size_t k = 0; k < p.acting.size(); ++k) {
        const model::ShaftElement& e = *p.acting[k];
        if (!e.is_pressed()) continue;
        const bool rigid = e.contact != model::nowhere;
        const std::string word = model::torque_word(t, e.shaft);
        out.push_back({rigid ? C::contact_torque : C::pressing_torque, rigid ? e.contact : static_cast<int>(k),
                       e.name + '_' + word, model::torque_unit(t, e.shaft),
                       word + " on the end stop, positive on the upper one"});
    }
    model::as_in_tables(t, out, &TrainChannel::name);
    return out;
}

}  // namespace lostmotion
