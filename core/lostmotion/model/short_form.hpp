// The drive of the paper as a train, and its parameters by their keys in scenario files.
#pragma once

#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "train.hpp"

namespace lostmotion::model {

// A motor that turns a load through a gearbox.
inline Train drive_train() {
    Train t;
    t.short_form = true;
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

struct Parameter {
    std::string key, unit;
    double* value;  // of the train that it was found in
};

// The parameters of a train in the short form that are single numbers, as its parts describe them.
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
