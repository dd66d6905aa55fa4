// The runs of trains that are timed: the paper's drive, and trains of more shafts.
#pragma once

#include <string>
#include <vector>

#include "../core/kernels/solving.hpp"
#include "paper_run.hpp"

namespace lostmotion {

LOSTMOTION_SOLVING(extern template, model::Middle)
LOSTMOTION_SOLVING(extern template, Any)

struct TimedTrain {
    std::string name;
    model::Train train;
    std::vector<Signal> inputs;                    // as model::Places numbers them
    double duration = 2.0;                         // [s]
    int samples = 2001;                            // over it
    std::vector<std::pair<int, double>> twists{};  // at the start: gear, [rad]
};

// As in the scenario of the same name.
inline TimedTrain worm_lowering() {
    using namespace model;
    TimedTrain t{"worm drive, 3 shafts", {}, {}, 1.5, 1501, {{1, 2e-3}}};
    t.train.shafts = {shaft(0.0), shaft(0.8e-4), shaft(2.0)};
    t.train.shafts[1].viscous_friction = 1e-3;
    t.train.shafts[2].loaded = true;
    t.train.motors = {torque_motor(0)};
    t.train.motors[0].law.rotor_inertia = 0.2e-4;
    t.train.motors[0].law.friction_torque = 10e-3;
    t.train.gears = {spring(0, 1, 1.0, TorsionCurve({}, {500.0})), spring(1, 2, 50.0, TorsionCurve({}, {1e4}))};
    t.train.gears[0].mesh_damping = 5e-3;
    t.train.gears[1].mesh_damping = 20.0;
    t.train.gears[1].efficiencies = MeshEfficiency::worm(4.0 * pi / 180.0, std::atan(0.084));
    t.inputs = {lines({{0.0, 0.0, 0.0}, {0.1, -0.15, 0.0}, {1.2, 0.0, 0.0}}), constant(20.0)};
    return t;
}
inline TimedTrain two_motors_one_ring() {
    using namespace model;
    TimedTrain t{"two motors on one ring", {}, {}, 4.0, 4001};
    constexpr double arcmin = pi / (180.0 * 60.0);
    t.train.shafts = {shaft(0.0), shaft(0.0), shaft(40.0)};
    t.train.shafts[2].viscous_friction = 5.0;
    t.train.shafts[2].loaded = true;
    for (const int k : {0, 1}) {
        t.train.motors.push_back(torque_motor(k));
        t.train.motors[k].law.rotor_inertia = 1e-4;
        t.train.motors[k].law.friction_torque = 10e-3;
        t.train.gears.push_back(spring(k, 2, 200.0, TorsionCurve({2.0 * arcmin}, {0.0, 60.0 / arcmin})));
        t.train.gears[k].efficiencies = MeshEfficiency(0.94, 0.93);
    }
    for (const double bias : {0.4, -0.4}) {
        Signal s = sine(0.2, 0.5);
        s.breakpoints[0].value = bias;
        t.inputs.push_back(s);
    }
    t.inputs.push_back(sine(20.0, 0.7));
    return t;
}
// The paper's drive with a belt before the gearbox and a coupling behind it: 8 states.
inline TimedTrain four_shafts() {
    using namespace model;
    const PaperRun paper;
    TimedTrain t{"the paper's drive with belt and coupling", paper.train, paper.signals};
    Gear& gearbox = t.train.gears[0];
    std::vector<Shaft>& shafts = t.train.shafts;
    shafts.insert(shafts.begin() + 1, shaft(0.0));  // the input shaft of the gearbox
    shafts.insert(shafts.begin() + 2, shaft(0.05));
    gearbox.input = 1;
    gearbox.output = 2;
    t.train.gears.insert(t.train.gears.begin(), spring(0, 1, 1.0, TorsionCurve({}, {20.0})));
    t.train.gears.push_back(spring(2, 3, 1.0, TorsionCurve({}, {5e4})));
    return t;
}
// A motor, a belt, three gears with hysteresis and backlash, a coupling: each shaft with dry friction.
inline TimedTrain six_shafts() {
    using namespace model;
    TimedTrain t{"chain of 6 shafts", {}, {sine(1.0, 1.0)}, 2.0, 2001};
    t.train.motors.push_back({"motor", 0, test::paper_drive(stand_in_map()).motor});
    const double ratio[] = {2.0, 3.0, 3.0, 5.0, 1.0};
    double to_load = 1.0;  // from the motor up to here
    for (int k = 0; k < 6; ++k) {
        t.train.shafts.push_back(shaft(k == 0 ? 67e-7 : k == 5 ? 1.0 : 10e-7 * to_load * to_load));
        t.train.shafts[k].friction.torque = 0.004 * to_load;
        t.train.shafts[k].viscous_friction = 1e-6 * to_load * to_load;
        if (k == 5) break;
        to_load *= ratio[k];
        const double slope = 0.5 * to_load * to_load;  // [N m/rad]
        const bool has_teeth = k > 0 && k < 4;
        t.train.gears.push_back(
            spring(k, k + 1, ratio[k],
                   has_teeth ? TorsionCurve({1e-2 / to_load}, {0.2 * slope, slope}) : TorsionCurve({}, {slope})));
        if (has_teeth) t.train.gears[k].law.hysteresis_efficiency = 0.95;
    }
    return t;
}
// Masses joined by gears of ratio 1: every third with backlash, the others with damping; dry friction on every shaft of
// this many, driven by a sine. Of another size nothing else changes.
struct ChainOf {
    int masses, friction_every, backlash_every = 3;
    double friction = 0.05, amplitude = 3.0, frequency = 2.0, mesh_damping = 0.05;  // [N m, N m, Hz, N m s/rad]
};
inline TimedTrain chain_of(const ChainOf& c) {
    using namespace model;
    constexpr double inertia = 1e-3, stiffness = 500.0, half_backlash = 1e-3;
    TimedTrain t{"chain of " + std::to_string(c.masses), {}, {sine(c.amplitude, c.frequency)}, 1.0, 0};
    for (int k = 0; k < c.masses; ++k) {
        t.train.shafts.push_back(shaft(k == 0 ? 0.0 : inertia));
        t.train.shafts[k].viscous_friction = 2e-3;
        if (k % c.friction_every == 0) t.train.shafts[k].friction.torque = c.friction;
    }
    t.train.motors = {torque_motor(0)};
    t.train.motors[0].law.rotor_inertia = inertia;
    t.train.motors[0].law.friction_torque = 0.0;
    for (int k = 0; k + 1 < c.masses; ++k) {
        const bool gap = k % c.backlash_every == 1;
        t.train.gears.push_back(spring(
            k, k + 1, 1.0, gap ? TorsionCurve({half_backlash}, {0.0, stiffness}) : TorsionCurve({}, {stiffness})));
        if (!gap) t.train.gears[k].mesh_damping = c.mesh_damping;
    }
    return t;
}
// With two frictions and two gaps, and with friction on every mass and a gap at every third.
inline std::vector<TimedTrain> chains() {
    std::vector<TimedTrain> all;
    for (const int masses : {8, 16, 32, 64, 128}) {
        all.push_back(chain_of({masses, masses / 2, masses / 2}));
        all.back().name = "few contacts, " + std::to_string(masses);
    }
    for (const int masses : {8, 16, 32}) {
        all.push_back(chain_of({masses, 1, 3}));
        all.back().name = "friction on all, " + std::to_string(masses);
    }
    return all;
}
inline std::vector<TimedTrain> timed_trains() {
    const PaperRun paper;
    return {{"the paper's drive", paper.train, paper.signals},
            worm_lowering(),
            two_motors_one_ring(),
            four_shafts(),
            six_shafts()};
}

// A train in a kernel of these dimensions.
template <class D>
struct TrainIn {
    using System = model::TrainSystem<D>;

    explicit TrainIn(const TimedTrain& t) : assembly(t.train), system(assembly) {
        make_room(signals, system.counts().inputs);
        for (std::size_t k = 0; k < t.inputs.size(); ++k) signals[k] = t.inputs[k];
        for (const auto& [gear, d] : t.twists) start[assembly.places().gears[gear].twist] = d;
    }
    // The states that the train has, without those that only fill the kernel.
    std::vector<int> states() const {
        std::vector<int> out;
        for (int k = 0; k < assembly.layout().coupled; ++k) out.push_back(k);
        for (int k = 0; k < assembly.layout().angles; ++k) out.push_back(D::coupled + k);
        return out;
    }

    const model::Assembly assembly;
    const System system;
    SignalsOf<D> signals;
    StateOf<D> start{};
};

// Calls use(a TrainIn) in the smallest kernel that holds a train.
template <class Use>
void in_kernel(const TimedTrain& t, Use&& use) {
    const model::Assembly a(t.train);
    const auto holds = [&]<class D>(D) { return sizes_of<D>.hold(t.train, a.layout()); };
    if (holds(model::Least{}))
        use(TrainIn<model::Least>(t));
    else if (holds(model::Middle{}))
        use(TrainIn<model::Middle>(t));
    else
        use(TrainIn<Any>(t));
}

}  // namespace lostmotion
