#include "names.hpp"

#include <algorithm>
#include <string_view>
#include <utility>

namespace lostmotion::model {

bool is_slide(const Train& t, int shaft) {
    return t.shafts[static_cast<std::size_t>(shaft)].domain == Domain::translation;
}
const char* angle_unit(const Train& t, int shaft) { return is_slide(t, shaft) ? "m" : "rad"; }
const char* speed_unit(const Train& t, int shaft) { return is_slide(t, shaft) ? "m/s" : "rad/s"; }
const char* angle_meaning(const Train& t, int shaft) {
    return is_slide(t, shaft) ? "position of the slide" : "angle of the shaft";
}
const char* torque_unit(const Train& t, int shaft) { return is_slide(t, shaft) ? "N" : "N*m"; }
const char* torque_word(const Train& t, int shaft) { return is_slide(t, shaft) ? "force" : "torque"; }
std::string law_text(const Train& t, int shaft, std::string law) {
    const std::string rotary = "torque over angle";
    const std::size_t at = law.find(rotary);
    return is_slide(t, shaft) && at != std::string::npos ? law.replace(at, rotary.size(), "force over position") : law;
}
std::string result_name(const std::string& element, std::string what, bool slide) {
    for (const auto& [rotary, linear] :
         {std::pair{"angle", "position"}, std::pair{"twist", "deflection"}, std::pair{"torque", "force"}})
        if (const std::size_t at = what.find(rotary); slide && at != std::string::npos)
            what.replace(at, std::string_view(rotary).size(), linear);
    return element + "_" + what;
}
std::string angle_of(const Train& t, std::size_t shaft) {
    return result_name(t.shafts[shaft].name, "angle", is_slide(t, static_cast<int>(shaft)));
}
std::string motor_torque_of(const Train& t, std::size_t motor) {
    return result_name(t.motors[motor].name, "torque", is_slide(t, t.motors[motor].shaft));
}
std::string phase_current_of(const Train& t, std::size_t motor, int phase) {
    return t.motors[motor].name + (phase == 0 ? "_phase_a_current" : "_phase_b_current");
}
std::string twist_of(const Train& t, std::size_t gear) { return gear_result(t, gear, "twist"); }
const char* twist_meaning(const Train& t, std::size_t gear) {
    return is_slide(t, t.gears[gear].output) ? "angle of input/ratio less position of output"
                                             : "angle of input/ratio less that of output";
}

std::string shown_name(const Train& t, const std::string& name) {
    const auto alias = std::ranges::find(t.aliases, name, &Alias::name);
    return alias == t.aliases.end() ? name : alias->shown;
}
bool has_alias(const Train& t, const std::string& name) {
    return std::ranges::find(t.aliases, name, &Alias::name) != t.aliases.end();
}
std::size_t place_in_tables(const Train& t, const std::string& shown) {
    return static_cast<std::size_t>(std::ranges::find(t.aliases, shown, &Alias::shown) - t.aliases.begin());
}

std::string gear_name(const Train& t, std::size_t gear, const char* what) {
    return result_name(t.gears[gear].name, what, is_slide(t, t.gears[gear].output));
}
std::string gear_result(const Train& t, std::size_t gear, const char* what) {
    return shown_name(t, gear_name(t, gear, what));
}
std::string command_of(const Train& t, std::size_t motor) { return shown_name(t, t.motors[motor].name + "_command"); }
std::string load_torque_of(const Train& t, std::size_t shaft) {
    return shown_name(t, result_name(t.shafts[shaft].name, "load_torque", is_slide(t, static_cast<int>(shaft))));
}

std::vector<std::string> state_names(const Assembly& a) {
    const Train& t = a.train();
    const Places& p = a.places();
    std::vector<std::string> names(static_cast<std::size_t>(a.layout().states));
    const auto set = [&names](int state, const std::string& name) {
        if (state != nowhere) names[static_cast<std::size_t>(state)] = name;
    };
    for (std::size_t k = 0; k < t.motors.size(); ++k) {
        set(p.motors[k].torque, motor_torque_of(t, k));
        if (const int i = p.motors[k].current; i != nowhere)
            for (const int phase : {0, 1}) set(i + phase, phase_current_of(t, k, phase));
    }
    for (std::size_t k = 0; k < t.shafts.size(); ++k) {
        set(p.shafts[k].speed, t.shafts[k].name + "_speed");
        set(p.shafts[k].angle, angle_of(t, k));
    }
    for (std::size_t k = 0; k < t.gears.size(); ++k) set(p.gears[k].twist, gear_result(t, k, "twist"));
    for (const auto& c : p.couplings) set(c->twist, c->name + "_twist");
    p.each_striking([&](const ContactPlace& c, int) {
        set(c.gap.clock, c.kind == ContactPlace::gear
                             ? gear_result(t, static_cast<std::size_t>(c.element), "impacts_left")
                             : p.name_of(c) + "_impacts_left");
    });
    for (std::size_t k = 0; k < t.controllers.size(); ++k)
        for (std::size_t j = 0; j < t.controllers[k].states.size(); ++j)
            set(p.controllers[k].first_state + static_cast<int>(j),
                t.controllers[k].name + "_" + t.controllers[k].states[j]);
    for (int part = 0; part < a.layout().angles; ++part) {
        const auto last = static_cast<std::size_t>(p.last_shaft[static_cast<std::size_t>(part)]);
        set(a.layout().coupled + part, angle_of(t, last));
    }
    return names;
}

std::vector<bool> moved_states(const Assembly& a) {
    std::vector<bool> moves(static_cast<std::size_t>(a.layout().states), true);
    for (std::size_t m = 0; m < a.train().motors.size(); ++m)
        if (const int k = a.places().motors[m].torque; k != nowhere)
            moves[static_cast<std::size_t>(k)] = a.train().motors[m].law.has_torque_state();
    for (const int s : a.places().massless) moves[static_cast<std::size_t>(a.places().shafts[s].speed)] = false;
    for (std::size_t g = 0; g < a.train().gears.size(); ++g)
        if (const int k = a.places().gears[g].twist; k != nowhere)
            moves[static_cast<std::size_t>(k)] = !a.train().gears[g].rigid();
    for (std::size_t part = 0; part < a.places().last_shaft.size(); ++part)
        moves[static_cast<std::size_t>(a.layout().coupled) + part] =
            a.places().shafts[static_cast<std::size_t>(a.places().last_shaft[part])].angle == nowhere;
    return moves;
}

std::vector<std::string> input_names(const Assembly& a) {
    const Train& t = a.train();
    const Places& p = a.places();
    std::vector<std::string> names(static_cast<std::size_t>(a.layout().inputs));
    const auto set = [&names](int input, const std::string& name) {
        if (input != nowhere) names[static_cast<std::size_t>(input)] = name;
    };
    for (std::size_t k = 0; k < t.motors.size(); ++k) set(p.motors[k].command, command_of(t, k));
    for (std::size_t k = 0; k < t.shafts.size(); ++k) set(p.shafts[k].load, load_torque_of(t, k));
    for (const int s : p.driven) {
        const auto k = static_cast<std::size_t>(s);
        set(p.shafts[k].given_speed, t.shafts[k].name + "_given_speed");
        set(p.shafts[k].given_acceleration, t.shafts[k].name + "_given_acceleration");
    }
    for (const auto& e : p.acting) set(e->command, e->name + "_command");
    for (std::size_t k = 0; k < t.motors.size(); ++k) set(p.motors[k].level, t.motors[k].name + "_current_command");
    for (const auto& c : p.couplings) set(c->command, c->name + "_command");
    for (std::size_t k = 0; k < t.controllers.size(); ++k) {
        set(p.controllers[k].reference, t.controllers[k].name + "_reference");
        set(p.controllers[k].reference_rate, t.controllers[k].name + "_reference_rate");
    }
    return names;
}

std::string contact_name(const Assembly& a, int contact) {
    const ContactPlace& c = a.places().contacts[static_cast<std::size_t>(contact)];
    const auto k = static_cast<std::size_t>(c.element);
    switch (c.kind) {
        case ContactPlace::shaft: return shown_name(a.train(), a.train().shafts[k].name + "_contact");
        case ContactPlace::gear: return gear_result(a.train(), k, "twist_contact");
        default: return a.places().name_of(c) + "_contact";
    }
}

int contact_shaft(const Assembly& a, int contact) {
    const ContactPlace& c = a.places().contacts[static_cast<std::size_t>(contact)];
    const auto k = static_cast<std::size_t>(c.element);
    switch (c.kind) {
        case ContactPlace::shaft: return c.element;
        case ContactPlace::gear: return a.train().gears[k].output;
        case ContactPlace::stop: return c.a;
        default: return a.places().couplings[k]->input;
    }
}

std::vector<ShownContact> shown_contacts(const Assembly& a) {
    const Train& t = a.train();
    const Places& p = a.places();
    std::vector<ShownContact> all;
    for (int c = 0; c < a.layout().contacts; ++c) {
        const ContactPlace& at = p.contacts[static_cast<std::size_t>(c)];
        all.push_back({c, at.kind, at.element, contact_name(a, c)});
    }
    const auto add = [&](int contact, ContactPlace::Kind kind, std::size_t element, const std::string& name) {
        if (contact == nowhere && has_alias(t, name))
            all.push_back({nowhere, kind, static_cast<int>(element), shown_name(t, name)});
    };
    for (std::size_t k = 0; k < t.shafts.size(); ++k)
        add(p.shafts[k].contact, ContactPlace::shaft, k, t.shafts[k].name + "_contact");
    for (std::size_t k = 0; k < t.gears.size(); ++k)
        add(p.gears[k].contact, ContactPlace::gear, k, gear_name(t, k, "twist_contact"));
    as_in_tables(t, all, &ShownContact::name);
    return all;
}

std::vector<std::string> branch_names(const Assembly& a) {
    const Train& t = a.train();
    const Places& p = a.places();
    std::vector<std::string> names(static_cast<std::size_t>(a.layout().branches));
    const auto set = [&names](int branch, const std::string& name) {
        if (branch != nowhere) names[static_cast<std::size_t>(branch)] = name;
    };
    for (std::size_t k = 0; k < t.motors.size(); ++k)
        set(p.motors[k].branch, t.motors[k].name + ": limit of the command");
    for (std::size_t k = 0; k < t.shafts.size(); ++k)
        set(p.shafts[k].friction_piece, t.shafts[k].name + ": piece of the friction curve");
    for (std::size_t k = 0; k < t.gears.size(); ++k) {
        const std::string& name = t.gears[k].name;
        set(p.gears[k].piece, name + (is_slide(t, t.gears[k].output) ? ": piece of the stiffness curve"
                                                                     : ": piece of the torsion curve"));
        set(p.gears[k].cell, name + ": cell of the losses");
        set(p.gears[k].cell_back, name + ": cell of the losses backward");
        set(p.gears[k].flanks, name + ": flanks parted, or their damping at its limit");
        set(p.gears[k].error.piece, name + ": piece of the transmission error");
        set(p.gears[k].error.corner, name + ": rest on a corner of the transmission error");
        set(p.gears[k].mesh.piece, name + ": piece of the mesh stiffness");
        set(p.gears[k].mesh.corner, name + ": rest on a step of the mesh stiffness");
    }
    for (const auto& c : p.couplings)
        if (c->branch != nowhere) set(c->branch, c->name + ": " + c->piecewise_law());
    for (const auto& e : p.acting)
        if (e->branch != nowhere) set(e->branch, e->name + ": " + law_text(t, e->shaft, e->piecewise_law()));
    for (std::size_t k = 0; k < t.controllers.size(); ++k) {
        set(p.controllers[k].branch, t.controllers[k].name + ": limit of the controller");
        set(p.controllers[k].piece, t.controllers[k].name + ": duty cycle of the controller");
    }
    return names;
}

}  // namespace lostmotion::model
