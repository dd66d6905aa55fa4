// The C interface: trains, element by element.
#include "train.hpp"

#include <cmath>
#include <new>
#include <string>
#include <utility>
#include <vector>

#include "lostmotion/model/drive_train.hpp"

namespace lm = lostmotion;

namespace {

std::string name_error(const lm_train& train, const char* name) {
    if (name == nullptr || *name == '\0') return "an element has no name";
    const auto taken = [&](const auto& elements) {
        for (const auto& e : elements)
            if (e.name == name) return true;
        return false;
    };
    const auto& t = train.description.train;
    bool used = taken(t.shafts) || taken(t.motors) || taken(t.gears);
    const auto any = [&](const char*, const char*, const auto& elements) { used = used || taken(elements); };
    lm::model::Train::each_kind(t, any);
    lm::model::Train::each_coupling_kind(t, any);
    if (used) return "the name '" + text(name) + "' is taken; use another one";
    return {};
}

NumberLists numbers_of(const lm_loss_map& m) {
    NumberLists axes;
    return axes.list(m.speeds, m.n_speeds).list(m.loads, m.n_loads).list(m.values, m.n_speeds * m.n_loads);
}

// use(element): of this name, which returns what is wrong.
template <class Element, class Use>
int with_named(lm_train& train, std::vector<Element>& elements, const char* kind, const char* name, Use&& use) {
    return train.attempt([&]() -> std::string {
        for (Element& e : elements)
            if (e.name == text(name)) return use(e);
        return "there is no " + std::string(kind) + " '" + text(name) + "'";
    });
}

// A train with these parameters, of which a motor or gear is taken.
std::string read(const lm_parameter* parameters, std::size_t n, const std::string& what, lm::model::Train& to) {
    for (std::size_t k = 0; k < n; ++k) {
        double* value = lm::model::find_parameter(to, text(parameters[k].key));
        if (value == nullptr) return what + ": there is no parameter '" + text(parameters[k].key) + "'";
        if (!std::isfinite(parameters[k].value)) return what + ": " + text(parameters[k].key) + " must be finite";
        *value = parameters[k].value;
    }
    return {};
}

// An element with the numbers of its description, on a shaft or between two.
template <class Element, class... Shafts>
int add(lm_train* train, const char* kind, const char* name, const NumberLists& numbers, Shafts... shafts) {
    return train->attempt([&] {
        Element element;
        std::string wrong = name_error(*train, name);
        if (wrong.empty()) wrong = numbers.read(element, kind + (" '" + text(name) + "'"));
        if (!wrong.empty()) return wrong;
        element.name = name;
        train->description.add(std::move(element), text(shafts)...);
        return wrong;
    });
}

int add_clutch(lm_train* train, const char* name, const char* input, const char* output, double torque,
               double breakaway_torque, bool safety) {
    const NumberLists numbers = NumberLists().number(torque).number(breakaway_torque).number(safety);
    return add<lm::model::Clutch>(train, safety ? "safety clutch" : "clutch", name, numbers, input, output);
}

}  // namespace

extern "C" {

int lm_interface_version(void) { return LM_INTERFACE_VERSION; }

size_t lm_parameter_count(void) { return lm::model::parameters().size(); }
const char* lm_parameter_key(size_t k) {
    return k < lm_parameter_count() ? lm::model::parameters()[k].key.c_str() : nullptr;
}
const char* lm_parameter_unit(size_t k) {
    return k < lm_parameter_count() ? lm::model::parameters()[k].unit.c_str() : nullptr;
}

lm_train* lm_train_new(void) { return new (std::nothrow) lm_train; }
void lm_train_free(lm_train* train) { delete train; }
const char* lm_train_error(const lm_train* train) { return train->error.c_str(); }

int lm_add_shaft(lm_train* train, const char* name, double inertia, double viscous_friction, double friction_torque,
                 double breakaway_torque, const lm_curve* drag, int loaded) {
    return train->attempt([&] {
        std::string wrong = name_error(*train, name);
        lm::model::Shaft s;
        const std::string what = "shaft '" + text(name) + "'";
        const NumberLists own = NumberLists().number(inertia).number(viscous_friction);
        const NumberLists friction = NumberLists()
                                         .number(0.0)
                                         .number(friction_torque)
                                         .number(breakaway_torque)
                                         .list(nullptr, 0)
                                         .list(nullptr, 0);
        if (wrong.empty()) wrong = own.read(s, what);
        if (wrong.empty()) wrong = friction.read(s.friction, what + ": friction");
        if (wrong.empty() && drag != nullptr) wrong = NumberLists().curve(drag).read(s.drag, what + ": drag");
        if (!wrong.empty()) return wrong;
        s.name = name;
        s.loaded = loaded != 0;
        train->description.add_shaft(std::move(s));
        return wrong;
    });
}

int lm_add_motor(lm_train* train, const char* name, const char* shaft, const lm_parameter* parameters, size_t n,
                 int torque_source, double torque_limit) {
    return train->attempt([&] {
        std::string wrong = name_error(*train, name);
        lm::model::Train drive = lm::model::drive_train();
        if (wrong.empty()) wrong = read(parameters, n, "motor '" + text(name) + "'", drive);
        if (!wrong.empty()) return wrong;
        drive.motors[0].law.kind = torque_source != 0 ? lm::Motor::torque_source : lm::Motor::dc;
        drive.motors[0].name = name;
        drive.motors[0].torque_limit = torque_limit;
        train->description.add(std::move(drive.motors[0]), text(shaft));
        return wrong;
    });
}

int lm_add_gear(lm_train* train, const char* name, const char* input, const char* output,
                const lm_parameter* parameters, size_t n, const lm_curve* stiffness, const lm_loss_map* losses,
                const double* efficiencies, const lm_periodic_curve* transmission_error) {
    return train->attempt([&] {
        const std::string what = "gear '" + text(name) + "'";
        std::string wrong = name_error(*train, name);
        lm::model::Train drive = lm::model::drive_train();
        lm::model::Gear& gear = drive.gears[0];
        lm::Gearbox& law = gear.law;
        if (wrong.empty()) wrong = read(parameters, n, what, drive);
        if (wrong.empty() && stiffness != nullptr) {
            law.compliance = lm::Gearbox::torsion_curve;
            wrong = NumberLists().curve(stiffness).read(law.curve, what + ": stiffness");
        }
        if (wrong.empty() && losses != nullptr) {
            law.losses = lm::Gearbox::loss_map;
            wrong = numbers_of(*losses).read(law.map, what + ": losses");
        }
        if (wrong.empty() && transmission_error != nullptr)
            wrong =
                NumberLists().curve(transmission_error).read(gear.transmission_error, what + ": transmission error");
        if (!wrong.empty()) return wrong;
        if (efficiencies != nullptr) gear.efficiencies.emplace(efficiencies[0], efficiencies[1]);
        gear.name = name;
        train->description.add(std::move(gear), text(input), text(output));
        return wrong;
    });
}

int lm_limit_mesh_damping(lm_train* train, const char* gear) {
    return with_named(*train, train->description.train.gears, "gear", gear, [](lm::model::Gear& g) {
        g.damping_limited = true;
        return std::string{};
    });
}

int lm_set_mesh_stiffness(lm_train* train, const char* gear, const lm_periodic_curve* factors) {
    return with_named(*train, train->description.train.gears, "gear", gear, [&](lm::model::Gear& g) {
        return NumberLists().curve(factors).read(g.mesh_stiffness, "gear '" + g.name + "': mesh stiffness");
    });
}

int lm_set_slide(lm_train* train, const char* shaft) {
    return with_named(*train, train->description.train.shafts, "shaft", shaft, [](lm::model::Shaft& s) {
        s.domain = lm::model::Domain::translation;
        return std::string{};
    });
}

int lm_give_motion(lm_train* train, const char* shaft) {
    return with_named(*train, train->description.train.shafts, "shaft", shaft, [](lm::model::Shaft& s) {
        s.given_motion = true;
        return std::string{};
    });
}

int lm_add_mass_matrix(lm_train* train, const char* name, const char* const* shafts, size_t n, const double* matrix) {
    return train->attempt([&] {
        std::string wrong = name_error(*train, name);
        if (wrong.empty() && (shafts == nullptr || matrix == nullptr || n == 0))
            wrong = "mass matrix '" + text(name) + "' has no shafts or no numbers";
        if (!wrong.empty()) return wrong;
        std::vector<std::string> names;
        std::vector<std::vector<double>> rows;
        for (size_t k = 0; k < n; ++k) {
            names.push_back(text(shafts[k]));
            rows.emplace_back(matrix + k * n, matrix + (k + 1) * n);
        }
        train->description.add_mass_matrix(name, names, std::move(rows));
        return wrong;
    });
}

int lm_set_housing(lm_train* train, const char* gear, const char* shaft) {
    lm::model::TrainDescription& of = train->description;
    const auto set = [&](const auto&) {
        of.set_housing(text(gear), text(shaft));
        return std::string{};
    };
    const auto nothing = [](const auto&) { return std::string{}; };
    const int known = with_named(*train, of.train.gears, "gear", gear, nothing);
    return known != LM_OK ? known : with_named(*train, of.train.shafts, "shaft", shaft, set);
}

int lm_add_brake(lm_train* train, const char* name, const char* shaft, double torque, double breakaway_torque) {
    return add<lm::model::Brake>(train, "brake", name, NumberLists().number(torque).number(breakaway_torque), shaft);
}
int lm_add_clutch(lm_train* train, const char* name, const char* input, const char* output, double torque,
                  double breakaway_torque) {
    return add_clutch(train, name, input, output, torque, breakaway_torque, false);
}
int lm_add_safety_clutch(lm_train* train, const char* name, const char* input, const char* output, double torque,
                         double breakaway_torque) {
    return add_clutch(train, name, input, output, torque, breakaway_torque, true);
}
int lm_add_freewheel(lm_train* train, const char* name, const char* input, const char* output) {
    return add<lm::model::Freewheel>(train, "freewheel", name, NumberLists(), input, output);
}
int lm_add_damper(lm_train* train, const char* name, const char* input, const char* output, double viscous_friction,
                  const lm_curve* drag) {
    const double slope = 0.0;
    const lm_curve none{nullptr, &slope, 0};
    return add<lm::model::Damper>(train, "damper", name,
                                  NumberLists().number(viscous_friction).curve(drag != nullptr ? drag : &none), input,
                                  output);
}
int lm_add_angle_torque(lm_train* train, const char* name, const char* shaft, const lm_periodic_curve* torque) {
    return add<lm::model::AngleTorque>(train, "angle torque", name, NumberLists().curve(torque), shaft);
}
int lm_add_spring(lm_train* train, const char* name, const char* shaft, const lm_curve* curve, double rest_angle) {
    return add<lm::model::Spring>(train, "spring", name, NumberLists().curve(curve).number(rest_angle), shaft);
}

}  // extern "C"
