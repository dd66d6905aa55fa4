// A freewheel: it carries any torque that drives its output forward, and none backward.
#pragma once

#include <limits>
#include <memory>
#include <string>

#include "coupling_element.hpp"

namespace lostmotion::model {

struct Freewheel {
    std::string name;
    int input = 0, output = 0;  // shafts

    template <class Fields>
    void describe(Fields&) {}
};

class FreewheelBetweenShafts final : public CouplingElement {
 public:
    explicit FreewheelBetweenShafts(const Freewheel& law) : CouplingElement(law.name, law.input, law.output) {}

    bool is_dry() const override { return true; }
    bool is_one_way() const override { return true; }
    double capacity(int way, const CouplingInstant&, bool) const override {
        return way > 0 ? std::numeric_limits<double>::infinity() : 0.0;
    }
};

inline std::unique_ptr<CouplingElement> between_shafts(const Freewheel& law) {
    return std::make_unique<FreewheelBetweenShafts>(law);
}

}  // namespace lostmotion::model
