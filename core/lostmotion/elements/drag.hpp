// A torque against the motion of a shaft over its speed: a fan, a pump, an eddy-current brake.
#pragma once

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "pieces.hpp"
#include "shaft_element.hpp"

namespace lostmotion::model {

class DragOnShaft final : public ShaftElement {
 public:
    // curve: [N m] over [rad/s]. Its name is that of the shaft.
    DragOnShaft(const std::string& shaft_name, int on, TorsionCurve curve)
        : ShaftElement(shaft_name, on), curve_(std::move(curve)) {}

    const char* piecewise_law() const override { return curve_.pieces() > 1 ? "piece of the drag" : nullptr; }
    int pieces() const override { return curve_.pieces(); }
    const char* loss() const override { return "drag"; }

    bool acts_at_rest() const override { return false; }
    Row torque(const Site& on, const Key& key) const override {
        return -on_piece(on.terms, on.speed(), curve_, piece(key));
    }
    double torque(const ShaftInstant& now) const override { return -curve_.torque(now.speed); }
    int next(int, const ShaftInstant& now) const override { return curve_.locate(now.speed); }
    int locate_steady(double speed) const override { return curve_.locate(speed); }
    void add_guards(const Site& on, const Key& key, bool turns, std::vector<Guard>& guards) const override {
        if (turns) add_piece_guards(on.terms, on.speed(), curve_, branch, key, guards);
    }

 private:
    TorsionCurve curve_;
};

}  // namespace lostmotion::model
