// A ratchet: its input drives the output forward by the teeth of a wheel. Backward it runs free, from tooth to tooth,
// so that it holds again at the next one.
#pragma once

#include <limits>
#include <memory>
#include <numbers>
#include <string>

#include "../parts/field.hpp"
#include "coupling_element.hpp"

namespace lostmotion::model {

struct Ratchet {
    static constexpr const char* part = "Ratchet";
    std::string name;
    int input = 0, output = 0;  // shafts
    int teeth = 1;              // of its wheel
    double restitution = 0.0;   // of the pawl on a tooth

    template <class Fields>
    void describe(Fields& f) {
        f.integer({"teeth", "", "", Range::any, Given::needed, "of its wheel, to one turn"}, teeth, 1, 10000);
        f.number({"restitution", "", "", Range::share, Given::has_default,
                  "speed at which the pawl leaves a tooth over that at which it strikes"},
                 restitution);
    }
};

class RatchetBetweenShafts final : public CouplingElement {
 public:
    explicit RatchetBetweenShafts(const Ratchet& law)
        : CouplingElement(law.name, law.input, law.output),
          pitch_(2.0 * std::numbers::pi / law.teeth),
          ends_{-pitch_, 0.0, law.restitution, true} {}

    bool is_dry() const override { return true; }
    bool is_one_way() const override { return true; }
    double capacity(int way, const CouplingInstant&, bool) const override {
        return way > 0 ? std::numeric_limits<double>::infinity() : 0.0;
    }
    double pitch() const override { return pitch_; }
    const Ends* strikes() const override { return &ends_; }
    double turn_at(double twist) const override { return pitch_ * std::ceil(twist / pitch_); }

 private:
    double pitch_;
    Ends ends_;
};

inline std::unique_ptr<CouplingElement> between_shafts(const Ratchet& law) {
    return std::make_unique<RatchetBetweenShafts>(law);
}

}  // namespace lostmotion::model
