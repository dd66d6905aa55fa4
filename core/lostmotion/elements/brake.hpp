// A holding brake: a dry contact of a shaft with the frame, whose capacity is commanded.
#pragma once

#include <algorithm>
#include <memory>
#include <string>

#include "command.hpp"
#include "shaft_element.hpp"

namespace lostmotion::model {

// Capacity torque * u with the input u in [0, 1]; below 0 it is open, above 1 fully engaged. On its shaft it adds to
// whatever else is dry there: one speed, one sign.
struct Brake {
    std::string name;
    int shaft = 0;
    double torque = 0.0;            // [N m] while it slips, at u = 1
    double breakaway_torque = 0.0;  // [N m] at rest, at u = 1; what lies below `torque` means that torque

    double holding() const { return std::max(torque, breakaway_torque); }

    template <class Fields>
    void describe(Fields& f) {
        describe_capacity(f, torque, breakaway_torque);
    }
};

class BrakeOnShaft final : public ShaftElement {
 public:
    explicit BrakeOnShaft(const Brake& law) : ShaftElement(law.name, law.shaft), law_(law) {}

    bool has_command() const override { return true; }
    const char* piecewise_law() const override { return "limit of the command"; }
    const char* loss() const override { return "brake"; }

    bool is_dry() const override { return true; }
    bool holds_more() const override { return law_.holding() > law_.torque; }
    Row friction(const Site& on, const Key& key, bool at_rest) const override {
        return commanded(on.terms, at_rest ? law_.holding() : law_.torque, command, piece(key));
    }
    double friction(const ShaftInstant& now, bool at_rest) const override {
        return (at_rest ? law_.holding() : law_.torque) * std::clamp(now.command, 0.0, 1.0);
    }
    int next(int, const ShaftInstant& now) const override { return side_of(now.command, 0.0, 1.0); }
    int locate_steady(double) const override { return -1; }
    void add_guards(const Site& on, const Key& key, bool, std::vector<Guard>& guards) const override;

 private:
    Brake law_;
};

inline std::unique_ptr<ShaftElement> on_shaft(const Brake& law) { return std::make_unique<BrakeOnShaft>(law); }

}  // namespace lostmotion::model
