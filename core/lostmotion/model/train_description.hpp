// A train as it is described from outside: elements by name, added in the order of the equations.
#pragma once

#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "train.hpp"

namespace lostmotion::model {

class TrainDescription {
 public:
    Train train;

    void add_shaft(Shaft shaft) { train.shafts.push_back(std::move(shaft)); }
    void add_mass_matrix(const std::string& name, const std::vector<std::string>& shafts,
                         std::vector<std::vector<double>> matrix);
    void add(ShaftMotor motor, const std::string& shaft) {
        motor.shaft = place_of(shaft);
        train.motors.push_back(std::move(motor));
    }
    void add(Gear gear, const std::string& input, const std::string& output) {
        gear.input = place_of(input);
        gear.output = place_of(output);
        train.gears.push_back(std::move(gear));
    }
    // Puts the housing of a gear, by default on the frame, on a shaft.
    void set_housing(const std::string& gear, const std::string& shaft);
    // What acts on one shaft.
    template <class Element>
    void add(Element element, const std::string& shaft) {
        element.shaft = place_of(shaft);
        Train::each_kind(train, [&](const char*, const char*, auto& elements) {
            if constexpr (std::is_same_v<std::vector<Element>&, decltype(elements)>)
                elements.push_back(std::move(element));
        });
    }
    // What joins two shafts.
    template <class Element>
    void add(Element element, const std::string& input, const std::string& output) {
        element.input = place_of(input);
        element.output = place_of(output);
        Train::each_coupling_kind(train, [&](const char*, const char*, auto& elements) {
            if constexpr (std::is_same_v<std::vector<Element>&, decltype(elements)>)
                elements.push_back(std::move(element));
        });
    }
    void add_controller(LinearController c, const std::string& motor);

 private:
    // -1 if there is none of that name, which the check of the train finds.
    int place_of(const std::string& shaft) const;
};

}  // namespace lostmotion::model
