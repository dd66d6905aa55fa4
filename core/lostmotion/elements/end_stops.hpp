// End stops of a shaft or a slide: elastic ones, with damping or without, or rigid ones that it strikes.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "../parts/field.hpp"
#include "shaft_element.hpp"

namespace lostmotion::model {

struct EndStops {
    std::string name;
    int shaft = 0;
    double lower = 0.0, upper = 0.0;          // [rad]
    double stiffness = 0.0;                   // of each [N m/rad]; 0: they are rigid
    double damping = 0.0, restitution = 0.0;  // [N m s/rad] while they are pressed; of rigid ones

    template <class Fields>
    void describe(Fields& f, const char* angle = "rad", const char* per_angle = "N*m/rad",
                  const char* per_speed = "N*m*s/rad") {
        f.number({"lower", "", angle, Range::any, Given::needed, "where the lower stop is"}, lower);
        f.number({"upper", "", angle, Range::any, Given::needed, "where the upper stop is"}, upper);
        f.number({"stiffness", "k", per_angle, Range::positive, Given::may_be_left_out,
                  "of each stop; left out, they are rigid"},
                 stiffness);
        f.number({"damping", "", per_speed, Range::not_negative, Given::has_default,
                  "of each elastic stop, which only presses"},
                 damping);
        f.number({"restitution", "", "", Range::share, Given::may_be_left_out,
                  "of rigid stops: speed at which they are left over that at which they are struck"},
                 restitution);
    }
};

// Beyond an end, by e: k e + d e' towards the travel, and nothing while that would pull.
class EndStopsOfShaft final : public ShaftElement {
 public:
    explicit EndStopsOfShaft(const EndStops& law)
        : ShaftElement(law.name, law.shaft), law_(law), ends_{law.lower, law.upper, law.restitution} {}

    const Ends* strikes() const override { return law_.stiffness > 0.0 ? nullptr : &ends_; }
    bool is_pressed() const override { return true; }
    bool drives() const override { return true; }
    const char* piecewise_law() const override { return strikes() != nullptr ? nullptr : "pressed stop"; }
    bool over_angle() const override { return true; }
    // What a damped stop has stored counts as lost until it gives it back.
    const char* source() const override { return law_.stiffness > 0.0 && law_.damping == 0.0 ? "end stop" : nullptr; }
    const char* loss() const override { return law_.damping > 0.0 ? "end stop" : nullptr; }

    Row torque(const Site& on, const Key& key) const override {
        const int way = pressed(piece(key));
        return way == 0 ? Row{} : -static_cast<double>(way) * pressure(on, way);
    }
    double torque(const ShaftInstant& now) const override {
        const int way = pressed(next(0, now));
        return way == 0 ? 0.0 : -way * (law_.stiffness * beyond(now, way) + law_.damping * (way * now.speed));
    }
    int next(int, const ShaftInstant& now) const override {
        for (const int way : {+1, -1})
            if (const double e = beyond(now, way); e > 0.0)
                return law_.stiffness * e + law_.damping * (way * now.speed) < 0.0 ? left_behind * way : way;
        return 0;
    }
    void add_guards(const Site& on, const Key& key, bool turns, std::vector<Guard>& guards) const override {
        if (!turns || strikes() != nullptr) return;
        const auto edge = [&](const Row& form, int neighbour) {
            Guard& guard = guards.emplace_back();
            guard.form = form;
            guard.kind = Guard::edge;
            guard.branch = branch;
            guard.neighbour = neighbour;
        };
        const int at = piece(key);
        if (at == 0) {
            for (const int way : {+1, -1}) edge(-1.0 * extension(on, way), way);
            return;
        }
        const int way = at > 0 ? +1 : -1;
        if (pressed(at) != 0) {
            edge(pressure(on, way), law_.damping > 0.0 ? left_behind * way : 0);
        } else {
            edge(-1.0 * pressure(on, way), way);
            edge(extension(on, way), 0);
        }
    }

 private:
    static constexpr int left_behind = 2;  // branch, times the side: the damped stop does not follow that fast
    static int pressed(int at) { return at == +1 || at == -1 ? at : 0; }
    double beyond(const ShaftInstant& now, int way) const {
        return way * (now.angle - (way > 0 ? law_.upper : law_.lower));
    }
    Row extension(const Site& on, int way) const {
        return on.angle(way) - on.terms.one(way * (way > 0 ? law_.upper : law_.lower));
    }
    Row pressure(const Site& on, int way) const {
        return law_.stiffness * extension(on, way) + on.speed(law_.damping * way);
    }

    EndStops law_;
    Ends ends_;
};

inline std::unique_ptr<ShaftElement> on_shaft(const EndStops& law) { return std::make_unique<EndStopsOfShaft>(law); }

}  // namespace lostmotion::model
