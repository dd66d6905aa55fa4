// A torque over the slip speed of two shafts: a viscous or fluid coupling, an eddy-current coupling, a torsional
// vibration damper.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "../parts/field.hpp"
#include "coupling_element.hpp"
#include "pieces.hpp"

namespace lostmotion::model {

struct Damper {
    static constexpr const char* part = "Damper";
    std::string name;
    int input = 0, output = 0;      // shafts
    double viscous_friction = 0.0;  // [N m s/rad]
    TorsionCurve drag{{}, {0.0}};   // [N m] over the slip speed [rad/s], in addition

    template <class Fields>
    void describe(Fields& f) {
        f.number({"viscous_friction", "b", "N*m*s/rad", Range::not_negative, Given::has_default,
                  "torque over the slip, in proportion"},
                 viscous_friction);
        f.curve("drag", drag);
    }
};

class DamperBetweenShafts final : public CouplingElement {
 public:
    explicit DamperBetweenShafts(const Damper& law) : CouplingElement(law.name, law.input, law.output), law_(law) {}

    const char* piecewise_law() const override { return law_.drag.pieces() > 1 ? "piece of the drag" : nullptr; }
    int pieces() const override { return law_.drag.pieces(); }
    const char* loss() const override { return "damper"; }

    Row torque(const Between& shafts, const Key& key) const override {
        return law_.viscous_friction * shafts.slip + on_piece(shafts.terms, shafts.slip, law_.drag, piece(key));
    }
    int next(int, const CouplingInstant& now) const override { return law_.drag.locate(now.slip); }
    int locate_steady(double slip) const override { return law_.drag.locate(slip); }
    void add_guards(const Between& shafts, const Key& key, bool slips, std::vector<Guard>& guards) const override {
        if (slips) add_piece_guards(shafts.terms, shafts.slip, law_.drag, branch, key, guards);
    }

 private:
    Damper law_;
};

inline std::unique_ptr<CouplingElement> between_shafts(const Damper& law) {
    return std::make_unique<DamperBetweenShafts>(law);
}

}  // namespace lostmotion::model
