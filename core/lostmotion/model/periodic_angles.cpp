#include "periodic_angles.hpp"

namespace lostmotion::model {

double common_period(const std::vector<double>& periods) {
    if (periods.empty()) return 0.0;
    const double longest = *std::max_element(periods.begin(), periods.end());
    for (int n = 1; n <= 100; ++n) {
        const auto is_whole = [&](double p) {
            const double q = n * longest / p;
            return std::fabs(q - std::round(q)) <= 1e-9 * q;
        };
        if (std::all_of(periods.begin(), periods.end(), is_whole)) return n * longest;
    }
    return 0.0;
}

std::vector<PeriodicAngle> periodic_angles(const Assembly& a) {
    std::vector<PeriodicAngle> angles;
    const Train& train = a.train();
    for (std::size_t s = 0; s < train.shafts.size(); ++s) {
        PeriodicAngle angle{static_cast<int>(s), a.places().shafts[s].angle, {}};
        if (angle.state == nowhere) continue;
        for (const auto& e : a.places().acting)
            if (e->turn != nowhere && e->shaft == angle.shaft) angle.turns.push_back({e->turn, e->period()});
        for (std::size_t g = 0; g < train.gears.size(); ++g) {
            const Gear& gear = train.gears[g];
            a.places().gears[g].each_over_angle(gear, [&](const PeriodicCurve& curve, const OverAngle& law) {
                const PeriodicAngle::Turn turn{law.turn, curve.period()};
                if (gear.input == angle.shaft) angle.turns.push_back(turn);
                if (gear.housing == angle.shaft) angle.turns.push_back({turn.memory, turn.period, -1.0});
            });
        }
        std::vector<double> periods;
        for (const PeriodicAngle::Turn& t : angle.turns) periods.push_back(t.period);
        // A controller, a spring or the field of a stepper knows the angle itself, however often the shaft has turned.
        const bool known =
            std::any_of(train.motors.begin(), train.motors.end(),
                        [&](const ShaftMotor& m) { return m.shaft == angle.shaft && m.law.has_winding(); }) ||
            std::any_of(train.controllers.begin(), train.controllers.end(),
                        [&](const LinearController& c) { return c.takes_angle(angle.shaft); }) ||
            std::any_of(a.places().acting.begin(), a.places().acting.end(), [&](const auto& e) {
                return e->shaft == angle.shaft && e->over_angle() && (e->turn == nowhere || e->motor() != nowhere);
            });
        if (!known) angle.period = common_period(periods);
        angles.push_back(std::move(angle));
    }
    return angles;
}

std::vector<Row> geometric_constraints(const Assembly& a, const Key& key) {
    struct Equation {
        std::vector<double> angle;  // of the shafts
        Row state;                  // equal to it, but for a constant
    };
    std::vector<Equation> equations;
    const Terms terms(a.layout());
    const std::vector<double> none(a.train().shafts.size());
    for (std::size_t s = 0; s < a.train().shafts.size(); ++s)
        if (const int k = a.places().shafts[s].angle; k != nowhere) {
            equations.push_back({none, terms.state(k)});
            equations.back().angle[s] = 1.0;
        }
    for (std::size_t g = 0; g < a.train().gears.size(); ++g) {
        const Gear& gear = a.train().gears[g];
        Equation e{none, {}};
        e.angle[static_cast<std::size_t>(gear.input)] = a.per_input(static_cast<int>(g), key);
        e.angle[static_cast<std::size_t>(gear.output)] = -1.0;
        if (gear.housing != nowhere)
            e.angle[static_cast<std::size_t>(gear.housing)] = a.per_housing(static_cast<int>(g), key);
        if (!gear.rigid()) e.state = terms.state(a.places().gears[g].twist);
        equations.push_back(e);
    }
    for (std::size_t s = 0; s < a.train().shafts.size(); ++s) {
        const auto of_shaft = [s](const Equation& x, const Equation& y) {
            return std::fabs(x.angle[s]) < std::fabs(y.angle[s]);
        };
        const auto found = std::max_element(equations.begin(), equations.end(), of_shaft);
        if (found == equations.end() || std::fabs(found->angle[s]) < loop_rounding) continue;
        const Equation pivot = *found;
        equations.erase(found);
        for (Equation& e : equations) {
            const double factor = e.angle[s] / pivot.angle[s];
            if (factor == 0.0) continue;
            for (std::size_t k = 0; k < e.angle.size(); ++k) e.angle[k] -= factor * pivot.angle[k];
            e.angle[s] = 0.0;
            e.state -= factor * pivot.state;
        }
    }
    std::vector<Row> kept;
    for (const Equation& e : equations)
        if (std::any_of(e.state.c.begin(), e.state.c.end(), [](double v) { return v != 0.0; })) kept.push_back(e.state);
    return kept;
}

}  // namespace lostmotion::model
