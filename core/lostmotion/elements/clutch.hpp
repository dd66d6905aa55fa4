// A clutch: a dry contact of two shafts. That of a friction clutch has a commanded capacity, a safety clutch is always
// engaged.
#pragma once

#include <algorithm>
#include <memory>
#include <string>
#include <vector>

#include "command.hpp"
#include "coupling_element.hpp"

namespace lostmotion::model {

// Capacity torque * u with the input u in [0, 1]; below 0 it is open, above 1 fully engaged. Of a safety clutch:
// torque.
struct Clutch {
    std::string name;
    int input = 0, output = 0;      // shafts
    double torque = 0.0;            // [N m] while it slips, at u = 1
    double breakaway_torque = 0.0;  // [N m] at rest, at u = 1; what lies below `torque` means that torque
    bool safety = false;

    double holding() const { return std::max(torque, breakaway_torque); }

    template <class Fields>
    void describe(Fields& f) {
        describe_capacity(f, torque, breakaway_torque);
        f.flag("safety", safety);
    }
};

class ClutchBetweenShafts final : public CouplingElement {
 public:
    explicit ClutchBetweenShafts(const Clutch& law) : CouplingElement(law.name, law.input, law.output), law_(law) {}

    bool has_command() const override { return !law_.safety; }
    const char* piecewise_law() const override { return has_command() ? "limit of the command" : nullptr; }

    bool is_dry() const override { return true; }
    bool holds_more() const override { return law_.holding() > law_.torque; }
    Row capacity(const Between& shafts, const Key& key, bool at_rest) const override;
    double capacity(int, const CouplingInstant& now, bool at_rest) const override {
        return (at_rest ? law_.holding() : law_.torque) * (has_command() ? std::clamp(now.command, 0.0, 1.0) : 1.0);
    }
    int next(int, const CouplingInstant& now) const override { return side_of(now.command, 0.0, 1.0); }
    void add_guards(const Between& shafts, const Key& key, bool, std::vector<Guard>& guards) const override;

 private:
    Clutch law_;
};

inline std::unique_ptr<CouplingElement> between_shafts(const Clutch& law) {
    return std::make_unique<ClutchBetweenShafts>(law);
}

}  // namespace lostmotion::model
