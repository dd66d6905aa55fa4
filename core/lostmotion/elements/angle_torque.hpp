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
    // The torque of a motor's field, of which a command below 1/2 leaves a share.
    AngleTorqueOnShaft(const AngleTorque& law, int motor, double share_at_rest)
        : ShaftElement(law.name, law.shaft), curve_(law.torque), motor_(motor), share_at_rest_(share_at_rest) {}

    const char* piecewise_law() const override { return "piece of the torque over angle"; }
    int pieces() const override { return has_command() ? 2 * own_pieces() : own_pieces(); }
    bool has_command() const override { return share_at_rest_ < 1.0; }
    int motor() const override { return motor_; }
    bool over_angle() const override { return true; }
    double period() const override { return curve_.period(); }
    bool is_smooth() const override { return curve_.of_sine(); }
    bool drives() const override { return true; }
    const char* source() const override { return motor_ == nowhere ? "torque over angle" : nullptr; }

    Row torque(const Site& on, const Key& key) const override;
    double torque(const ShaftInstant& now) const override { return share(next(0, now)) * curve_(now.angle); }
    int next(int, const ShaftInstant& now) const override {
        const bool reduced = has_command() && now.command < full_current;
        return (is_whole() ? 0 : curve_.piece(now.angle - now.turn)) + (reduced ? own_pieces() : 0);
    }
    int locate_steady(double) const override { return motor_ == nowhere ? 0 : curve_.piece(0.5 * curve_.period()); }
    void add_guards(const Site& on, const Key& key, bool turns, std::vector<Guard>& guards) const override;
    Remainder remainder_at(const ShaftInstant& now, int k) const override;

 private:
    static constexpr double full_current = 0.5;  // of the command

    Row angle(const Site& on) const;
    // In the branches beyond those of the curve the current is reduced.
    double share(int k) const { return k < own_pieces() ? 1.0 : share_at_rest_; }
    // The adaptive solver takes a sine whole: the edges of straight lines would only cut its steps, and hold a rotor.
    bool is_whole() const { return remainder != nowhere; }
    int own_pieces() const { return is_whole() ? 1 : curve_.pieces(); }

    PeriodicCurve curve_;
    int motor_ = nowhere;
    double share_at_rest_ = 1.0;
};

inline std::unique_ptr<ShaftElement> on_shaft(const AngleTorque& law) {
    return std::make_unique<AngleTorqueOnShaft>(law);
}

}  // namespace lostmotion::model
