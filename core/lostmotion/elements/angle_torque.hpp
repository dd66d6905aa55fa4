// A torque that depends on the angle of its shaft, periodically: gravity or unbalance (m g r sin phi), cogging, ripple.
#pragma once

#include <cmath>
#include <memory>
#include <string>

#include "pieces.hpp"
#include "shaft_element.hpp"

namespace lostmotion::model {

struct AngleTorque {
    std::string name;
    int shaft = 0;
    PeriodicCurve torque;  // [N m] on the shaft, in the direction of its angle

    template <class Fields>
    void describe(Fields& f) {
        f.curve("torque", torque);
    }
};

class AngleTorqueOnShaft final : public ShaftElement {
 public:
    explicit AngleTorqueOnShaft(const AngleTorque& law) : ShaftElement(law.name, law.shaft), curve_(law.torque) {}

    const char* piecewise_law() const override { return "piece of the torque over angle"; }
    int pieces() const override { return curve_.pieces(); }
    bool over_angle() const override { return true; }
    double period() const override { return curve_.period(); }
    bool is_smooth() const override { return curve_.of_sine(); }
    bool drives() const override { return true; }
    const char* source() const override { return "torque over angle"; }

    Row torque(const Site& on, const Key& key) const override;
    double torque(const ShaftInstant& now) const override { return curve_(now.angle); }
    int next(int, const ShaftInstant& now) const override { return curve_.piece(now.angle - now.turn); }
    void add_guards(const Site& on, const Key& key, bool turns, std::vector<Guard>& guards) const override {
        if (turns) add_piece_guards(on.terms, on.angle(), curve_, turn, branch, key, guards);
    }
    Remainder remainder_at(const ShaftInstant& now, int k) const override;

 private:
    PeriodicCurve curve_;
};

inline std::unique_ptr<ShaftElement> on_shaft(const AngleTorque& law) {
    return std::make_unique<AngleTorqueOnShaft>(law);
}

}  // namespace lostmotion::model
