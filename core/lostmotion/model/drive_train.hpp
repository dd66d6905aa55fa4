// The drive of the paper as a train, and its parameters by their keys in scenario files.
#pragma once

#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "train.hpp"

namespace lostmotion::model {

// What the results of such a train are called, in the order and the words of the paper.
inline std::vector<Alias> aliases_of_drive() {
    return {{"motor_command", "command"},
            {"load_load_torque", "load_torque"},
            {"motor_torque", "motor_torque"},
            {"motor_speed", "motor_speed"},
            {"load_speed", "load_speed"},
            {"load_angle", "load_angle"},
            {"motor_angle", ""},
            {"gearbox_twist", "twist"},
            {"gearbox_output_torque", "output_torque"},
            {"gearbox_input_torque", "input_torque"},
            {"gearbox_loss_coefficient", "loss_coefficient"},
            {"motor_contact", "input_contact"},
            {"gearbox_twist_contact", "twist_contact"},
            {"load_contact", "load_contact"},
            {"input_contact_torque", ""},
            {"twist_contact_torque", ""},
            {"load_contact_torque", ""},
            {"gearbox_efficiency", "efficiency"},
            {"motor_power", "motor_power"},
            {"gearbox_hysteresis_capacity", "hysteresis_capacity"},
            {"gearbox_locked_torque", "locked_torque"},
            {"motor_", ""},
            {"motor: motor", "source"},
            {"motor: viscous friction", "input_damper"},
            {"motor: dry friction", "motor_friction"},
            {"gearbox: mesh", "gear_losses"},
            {"gearbox: hysteresis and damping", "hysteresis"},
            {"load: viscous friction", "load_damper"},
            {"load: dry friction", "load_friction"},
            {"load: load", "load_work"},
            {"gearbox: parametric work", "parametric_work"},
            {"stored_change", ""},
            {"kinetic_change", "kinetic_change"},
            {"elastic_change", "elastic_change"},
            {"residual", "residual"},
            {"turned_over", "turned_over"}};
}

// A motor that turns a load through a gearbox.
inline Train drive_train() {
    Train t;
    t.aliases = aliases_of_drive();
    t.shafts.resize(2);
    t.shafts[0].name = "motor";
    t.shafts[1].name = "load";
    t.shafts[1].loaded = true;
    t.motors.resize(1);
    t.motors[0].name = "motor";
    t.gears.resize(1);
    t.gears[0].name = "gearbox";
    t.gears[0].output = 1;
    return t;
}

// Whether a train has no more elements than that.
inline bool is_drive(const Train& t) {
    return t.motors.size() == 1 && t.gears.size() == 1 && t.shafts.size() == 2 && t.motors[0].shaft == 0 &&
           t.gears[0].input == 0 && t.mass_matrices.empty() && t.controllers.empty() && shaft_elements(t).empty() &&
           coupling_elements(t).empty();
}

struct Parameter {
    std::string key, unit;
    double* value;  // of the train that it was found in
};

// The parameters of such a train that are single numbers, as its parts describe them.
class ParameterFinder : public FieldVisitor {
 public:
    std::vector<Parameter> found;

    template <class Part>
    void add(const std::string& table, Part& part) {
        table_ = table;
        part.describe(*this);
    }
    using FieldVisitor::number;
    void number(const Field& field, double& v) { found.push_back({table_ + '.' + field.key, field.unit, &v}); }

 private:
    std::string table_;
};

inline std::vector<Parameter> parameters_of(Train& t) {
    ParameterFinder of;
    of.add("motor", t.motors[0].law);
    of.add("gearbox", t.gears[0].law);
    of.add("gearbox", t.gears[0]);
    of.add("load", t.shafts[1]);
    of.found.push_back({"load.friction_torque", "N*m", &t.shafts[1].friction.torque});
    return std::move(of.found);
}

// Their keys and units.
inline const std::vector<Parameter>& parameters() {
    static const std::vector<Parameter> all = [] {
        Train t = drive_train();
        std::vector<Parameter> named = parameters_of(t);
        for (Parameter& p : named) p.value = nullptr;
        return named;
    }();
    return all;
}

// The value of a parameter; nullptr: there is none of this key.
inline double* find_parameter(Train& t, std::string_view key) {
    for (const Parameter& p : parameters_of(t))
        if (p.key == key) return p.value;
    return nullptr;
}

}  // namespace lostmotion::model
