// The C interface: trains, element by element.
#include "train.hpp"

#include <cmath>
#include <new>
#include <string>
#include <utility>
#include <vector>

#include "lostmotion/model/short_form.hpp"

namespace lm = lostmotion;

namespace {

std::string about(const std::string& what, const std::string& wrong) {
    return wrong.empty() ? wrong : what + ": " + wrong;
}

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

std::string read(const lm_curve& c, const std::string& what, lm::TorsionCurve& to) {
    NumberLists sides;
    for (int side = 0; side < 2; ++side) sides.list(c.breaks, c.n_breaks).list(c.slopes, c.n_breaks + 1);
    return about(what, sides.read(to));
}
std::string read(const lm_periodic_curve& c, const std::string& what, lm::model::PeriodicCurve& to) {
    NumberLists numbers;
    numbers.number(c.period).list(c.angles, c.n).list(c.values, c.n);
    return about(what, numbers.number(0.0).number(1.0).number(0.0).read(to));  // of no sine
}
std::string read(const lm_loss_map& m, const std::string& what, lm::LossMap& to) {
    NumberLists axes;
    axes.list(m.speeds, m.n_speeds).list(m.loads, m.n_loads).list(m.values, m.n_speeds * m.n_loads);
    return about(what, axes.read(to));
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

template <class Element>
int add_coupling(lm_train& train, Element element, const char* name, const char* input, const char* output) {
    return train.attempt([&] {
        std::string wrong = name_error(train, name);
        if (!wrong.empty()) return wrong;
        element.name = name;
        train.description.add(std::move(element), text(input), text(output));
        return wrong;
    });
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
        if (wrong.empty() && drag != nullptr) wrong = read(*drag, "shaft '" + text(name) + "': drag", s.drag);
        if (!wrong.empty()) return wrong;
        s.name = name;
        s.inertia = inertia;
        s.viscous_friction = viscous_friction;
        s.friction = {friction_torque, breakaway_torque, {}, {}};
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
            wrong = read(*stiffness, what + ": stiffness", law.curve);
        }
        if (wrong.empty() && losses != nullptr) {
            law.losses = lm::Gearbox::loss_map;
            wrong = read(*losses, what + ": losses", law.map);
        }
        if (wrong.empty() && transmission_error != nullptr)
            wrong = read(*transmission_error, what + ": transmission error", gear.transmission_error);
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
        return read(*factors, "gear '" + g.name + "': mesh stiffness", g.mesh_stiffness);
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
    return train->attempt([&] {
        std::string wrong = name_error(*train, name);
        if (wrong.empty()) train->description.add(lm::model::Brake{name, 0, torque, breakaway_torque}, text(shaft));
        return wrong;
    });
}

int lm_add_clutch(lm_train* train, const char* name, const char* input, const char* output, double torque,
                  double breakaway_torque) {
    return add_coupling(*train, lm::model::Clutch{"", 0, 0, torque, breakaway_torque}, name, input, output);
}
int lm_add_safety_clutch(lm_train* train, const char* name, const char* input, const char* output, double torque,
                         double breakaway_torque) {
    return add_coupling(*train, lm::model::Clutch{"", 0, 0, torque, breakaway_torque, true}, name, input, output);
}
int lm_add_freewheel(lm_train* train, const char* name, const char* input, const char* output) {
    return add_coupling(*train, lm::model::Freewheel{}, name, input, output);
}

int lm_add_damper(lm_train* train, const char* name, const char* input, const char* output, double viscous_friction,
                  const lm_curve* drag) {
    lm::model::Damper damper;
    damper.viscous_friction = viscous_friction;
    if (drag != nullptr) {
        const auto curve = [&] { return read(*drag, "damper '" + text(name) + "': drag", damper.drag); };
        if (train->attempt(curve) != LM_OK) return LM_INVALID;
    }
    return add_coupling(*train, std::move(damper), name, input, output);
}

int lm_add_angle_torque(lm_train* train, const char* name, const char* shaft, const lm_periodic_curve* torque) {
    return train->attempt([&] {
        std::string wrong = name_error(*train, name);
        lm::model::PeriodicCurve curve;
        if (wrong.empty() && torque == nullptr) wrong = "angle torque '" + text(name) + "' has no curve";
        if (wrong.empty()) wrong = read(*torque, "angle torque '" + text(name) + "'", curve);
        if (wrong.empty()) train->description.add(lm::model::AngleTorque{name, 0, curve}, text(shaft));
        return wrong;
    });
}

int lm_add_spring(lm_train* train, const char* name, const char* shaft, const lm_curve* curve, double rest_angle) {
    return train->attempt([&] {
        std::string wrong = name_error(*train, name);
        lm::model::Spring spring{name, 0, {}, rest_angle};
        if (wrong.empty() && curve == nullptr) wrong = "spring '" + text(name) + "' has no curve";
        if (wrong.empty()) wrong = read(*curve, "spring '" + text(name) + "'", spring.curve);
        if (wrong.empty()) train->description.add(std::move(spring), text(shaft));
        return wrong;
    });
}

}  // extern "C"
