// A spring between a shaft and the frame: a counterbalance, a flexure pivot, a cable that is wound up, end stops.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "../parts/field.hpp"
#include "pieces.hpp"
#include "shaft_element.hpp"

namespace lostmotion::model {

// Torque -P(phi - rest_angle). A first piece of slope 0 leaves the shaft free between two end stops.
struct Spring {
    static constexpr const char* part = "Spring";
    std::string name;
    int shaft = 0;
    TorsionCurve curve;       // P [N m] over the angle [rad]
    double rest_angle = 0.0;  // [rad]

    template <class Fields>
    void describe(Fields& f) {
        f.curve("curve", curve);
        f.number({"rest_angle", "", "rad", Range::any, Given::has_default,
                  "angle of the shaft at which the spring has no torque"},
                 rest_angle);
    }
};

class SpringOnShaft final : public ShaftElement {
 public:
    explicit SpringOnShaft(const Spring& law) : ShaftElement(law.name, law.shaft), law_(law) {}

    const char* piecewise_law() const override { return law_.curve.pieces() > 1 ? "piece of the spring" : nullptr; }
    int pieces() const override { return law_.curve.pieces(); }
    bool over_angle() const override { return true; }
    bool drives() const override { return true; }
    const char* source() const override { return "spring"; }

    Row torque(const Site& on, const Key& key) const override {
        return -on_piece(on.terms, extension(on), law_.curve, piece(key));
    }
    double torque(const ShaftInstant& now) const override { return -law_.curve.torque(now.angle - law_.rest_angle); }
    int next(int, const ShaftInstant& now) const override { return law_.curve.locate(now.angle - law_.rest_angle); }
    void add_guards(const Site& on, const Key& key, bool turns, std::vector<Guard>& guards) const override {
        if (turns) add_piece_guards(on.terms, extension(on), law_.curve, branch, key, guards);
    }

 private:
    Row extension(const Site& on) const { return on.angle() - on.terms.one(law_.rest_angle); }

    Spring law_;
};

inline std::unique_ptr<ShaftElement> on_shaft(const Spring& law) { return std::make_unique<SpringOnShaft>(law); }

}  // namespace lostmotion::model
