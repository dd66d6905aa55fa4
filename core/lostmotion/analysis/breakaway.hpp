// From which command on a motor keeps its shaft turning: statics of a train, the inertia forces left out.
//
// The motor is thought to wind up slowly, from the torques that the gears pass on at present, all that it has to turn:
// everything that gears and clutches join to its shaft, each shaft against its load, its dry friction and the other
// motors, whose commands stay. The hardest point on the way of each gear counts. A gear driven from its output turns
// the motor behind it, unless it locks itself; a clutch slips where its capacity is less than what is behind it needs.
// Torques over angles are those of the present angles, and a damper turns a shaft at rest as its other one moves.
// Without a branch that is exact, of any length; where shafts turn several gears, it is too as long as each gear needs
// more torque on its input the more it is loaded (a self-locking one that overruns needs less), else it is an upper
// bound.
#pragma once

#include <cmath>
#include <limits>
#include <vector>

#include "../model/capacity.hpp"

namespace lostmotion {

class Breakaway {
 public:
    // now: a point of a motion in the regime r.
    Breakaway(const model::Assembly& a, const model::Regime& r, const model::Instant& now)
        : assembly_(a), train_(a.train()), key_(r.key), ties_(r.ties), now_(now) {
        for (const model::Row& T : r.output_torque) T_2_.push_back(model::evaluate(a.layout(), T, now));
    }
    // Forward s = +1, backward s = -1. Infinite if no command turns it; NaN if it turns a loop or a gear whose housing
    // turns, whose torques depend on more than statics.
    double command(int motor, int s);

 private:
    static constexpr double never = std::numeric_limits<double>::infinity();

    // Torque that has to act on a shaft, beside what acts on it anyway and not through the element `from`, so that it
    // turns in direction s and takes along all that is behind it.
    double to_turn(int shaft, int s, const void* from);
    bool reaches_a_loop(int shaft);

    // Torques on a shaft that do not depend on whether it turns.
    double acting(int shaft) const;
    // To a shaft at rest, by the slip of another one.
    double passed_on(const model::CouplingElement& c, int shaft) const;
    double torque_at_rest(std::size_t m) const;
    double input(int k) const { return now_.input[0][static_cast<std::size_t>(k)]; }

    // What a gear that passes T on takes from its input shaft, which turns in direction s.
    double input_torque(int g, double T, int s) const;
    // Where that is not straight: loads s T, rising.
    std::vector<double> edges(int g) const;

    double to_drive(int g, int s);

    // The output turns the input: T_2 falls from what it is until what the gear takes from its input shaft, there a
    // drive, turns that.
    double to_drive_back(int g, int s);
    // Where a straight line through two points has a value.
    template <class F>
    static double between(double a, double b, const F& f, double value) {
        const double f_a = f(a), f_b = f(b);
        return f_a == f_b ? b : a + (value - f_a) / (f_b - f_a) * (b - a);
    }

    double to_carry(const model::CouplingElement& c, bool from_input, int s);

    const model::Assembly& assembly_;
    const model::Train& train_;
    model::Key key_;
    model::Ties ties_;
    model::Instant now_;
    std::vector<double> T_2_;
    std::vector<bool> visited_;
    int left_out_ = -1;
    bool loop_ = false;
};

}  // namespace lostmotion
