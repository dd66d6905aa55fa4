// A torque limiter: it holds its shafts together up to a torque, slips at a smaller one from then on, and engages again
// where they are in step: when they have nearly one speed, or at the next pocket of its balls.
#pragma once

#include <memory>
#include <numbers>
#include <string>
#include <vector>

#include "../parts/field.hpp"
#include "coupling_element.hpp"

namespace lostmotion::model {

struct TorqueLimiter {
    static constexpr const char* part = "TorqueLimiter";
    std::string name;
    int input = 0, output = 0;    // shafts
    double release_torque = 0.0;  // [N m]
    double slip_torque = 0.0;     // [N m]
    double engaging_speed = 0.0;  // [rad/s]
    int pockets = 0;              // to one turn; 0: it engages at any angle

    template <class Fields>
    void describe(Fields& f) {
        f.number({"release_torque", "T_1", "N*m", Range::positive, Given::needed, "up to which it holds"},
                 release_torque);
        f.number({"slip_torque", "T_2", "N*m", Range::not_negative, Given::needed, "while it slips"}, slip_torque);
        f.number({"engaging_speed", "", "rad/s", Range::not_negative, Given::has_default,
                  "slip speed below which it engages again"},
                 engaging_speed);
        f.integer({"pockets", "", "", Range::any, Given::has_default,
                   "of its balls, to one turn: it engages at the next one; 0: at any angle"},
                  pockets, 0, 1000);
    }
};

// Held it takes up to T_1, and so it does from the place on at which it engages, as long as it still slips.
class TorqueLimiterBetweenShafts final : public CouplingElement {
 public:
    explicit TorqueLimiterBetweenShafts(const TorqueLimiter& law)
        : CouplingElement(law.name, law.input, law.output), law_(law) {}

    bool is_dry() const override { return true; }
    bool holds_more() const override { return true; }
    const char* piecewise_law() const override { return "engagement"; }
    const char* loss() const override { return "torque limiter"; }
    double pitch() const override { return law_.pockets > 0 ? 2.0 * std::numbers::pi / law_.pockets : 0.0; }

    Row capacity(const Between& shafts, const Key& key, bool at_rest) const override {
        return shafts.terms.one(capacity(piece(key), at_rest));
    }
    double capacity(int, const CouplingInstant& now, bool at_rest) const override {
        return capacity(now.mode, at_rest);
    }
    int next(int mode, const CouplingInstant& now) const override {
        if (now.sticks) return mode == engages || law_.pockets == 0 ? held : mode;
        return mode == held ? slow : mode;
    }
    void add_guards(const Between& shafts, const Key& key, bool slips, std::vector<Guard>& guards) const override {
        const int mode = piece(key);
        if (!slips || shafts.way == 0 || law_.engaging_speed == 0.0) return;  // else it engages at a stop alone
        const Row faster = static_cast<double>(shafts.way) * shafts.slip - shafts.terms.one(law_.engaging_speed);
        if (mode == fast)
            guards.push_back(edge(faster, law_.pockets > 0 ? slow : engages));
        else
            guards.push_back(edge(-1.0 * faster, fast));
        if (law_.pockets > 0 && mode != engages)
            for (const int way : {+1, -1}) guards.push_back(in_step(shafts.terms, way, mode == slow ? engages : fast));
    }

 private:
    // slow: since it was released, it has slipped slower than it engages at.
    enum Mode { held, slow, fast, engages };

    double capacity(int mode, bool at_rest) const {
        const bool holds = mode == held || mode == engages || (at_rest && law_.pockets == 0);
        return holds ? law_.release_torque : law_.slip_torque;
    }

    TorqueLimiter law_;
};

inline std::unique_ptr<CouplingElement> between_shafts(const TorqueLimiter& law) {
    return std::make_unique<TorqueLimiterBetweenShafts>(law);
}

}  // namespace lostmotion::model
