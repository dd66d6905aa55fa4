// Properties that hold for any drive, for the tests and, at length, for the soak.
#pragma once

#include <algorithm>

#include "drive_runs.hpp"
#include "least_kernel.hpp"

namespace lostmotion::test {

// Random drives whose worm-like gear locks: it needs more torque to lower a load than the load brings. No friction but
// that of the mesh, so that what it can hold vanishes with the load.
class SelfLockingDrives : public RandomDrives {
 public:
    SelfLockingDrives(unsigned seed, bool hysteresis) : RandomDrives(seed), hysteresis_(hysteresis) {}

    Drive drive() {
        Drive d = RandomDrives::drive();
        Gearbox& g = d.gearbox;
        d.motor.friction_torque = d.load.friction_torque = 0.0;
        if (g.compliance == Gearbox::rigid) {
            set_curve(d, {}, {std::pow(2.0 * pi * spread(5.0, 150.0), 2) * d.input_inertia() * g.ratio});
        }
        g.hysteresis_efficiency = hysteresis_ ? uniform(0.7, 0.99) : 1.0;
        g.losses = Gearbox::loss_map;
        const double driving = 1.0 / uniform(0.3, 0.6) - 1.0, overrunning = 1.0 + uniform(0.02, 0.8),
                     moving = uniform(0.6, 1.0);
        const std::vector<double> speeds{0.0, 0.3, 1.0}, loads{-1.0, -0.3, 0.0, 0.3, 1.0};
        std::vector<double> values;
        for (const double mu : loads)
            for (const double v : speeds)
                values.push_back((mu < 0.0 ? -mu * overrunning : mu * driving) * (v == 0.0   ? 1.0
                                                                                  : v == 0.3 ? moving
                                                                                             : 0.9 * moving));
        g.map = LossMap(speeds, loads, values);
        return d;
    }
    // A load that reverses, and half of the time a command.
    Signals reversing(const Drive& d) {
        const double T = d.gearbox.rated_output_torque;
        Signals s{coin() ? Signal{} : sine(uniform(0.1, 1.0), spread(0.5, 5.0)),
                  sine(T * uniform(0.1, 0.8), spread(0.5, 10.0), uniform(-pi, pi))};
        if (coin(0.3)) s[1].breakpoints[0].value = T * uniform(-0.3, 0.3);
        return s;
    }

 private:
    bool hysteresis_;
};

// Drives at rest that nothing holds but the mesh, and that not before a load comes: no friction, no loss without load.
// Their gears lock or nearly do so, and what sets them in motion rises from zero.
class UnloadedDrives : public RandomDrives {
 public:
    using RandomDrives::RandomDrives;

    Drive drive() {
        Drive d;
        const double J = spread(1e-6, 1e-4), T = spread(1.0, 300.0), i = uniform(5.0, 100.0), k = spread(1e2, 1e5);
        d.motor.rotor_inertia = d.gearbox.inertia = J;
        d.motor.rated_torque = T / i;
        d.motor.rated_speed = 300.0;
        d.motor.electrical_time_constant = 1e-4;
        d.motor.armature_voltage_constant = uniform(1.5, 6.0);
        Gearbox& g = d.gearbox;
        g.ratio = i;
        g.rated_input_speed = 300.0;
        g.rated_output_torque = T;
        g.compliance = Gearbox::torsion_curve;
        g.curve = coin() ? TorsionCurve({0.3 * T / k}, {0.2 * k, k}) : TorsionCurve({}, {k});
        if (coin()) g.hysteresis_efficiency = uniform(0.7, 0.99);
        g.losses = Gearbox::loss_map;
        const double moving = 1.5 * uniform(0.5, 1.5), still = 1.2 * moving, fast = coin(0.2) ? 0.05 : 0.0;
        g.map = LossMap({0.0, 1.0}, {-1.5, 0.0, 1.5}, {still, moving, 0.0, fast, still, moving});
        d.load.inertia = J * i * i * spread(0.1, 10.0);
        if (coin()) d.load.viscous_friction = 0.1 * T;
        return d;
    }
    Signals from_zero(const Drive& d) {
        const double T = d.gearbox.rated_output_torque;
        Signals s{sine(coin(0.3) ? 0.0 : uniform(0.1, 1.0), uniform(0.5, 5.0)),
                  sine(T * uniform(0.0, 1.0), uniform(0.5, 8.0))};
        if (coin()) s[0].breakpoints[0].value = uniform(-1.0, 1.0);
        if (coin()) s[1].breakpoints[0].value = 0.2 * T;
        return s;
    }
};

// Inputs that move for a while and are constant, or zero, from then on.
inline Signals that_end(Signals s, double at, bool in_zero) {
    for (Signal& signal : s) {
        signal.sines.clear();
        std::vector<Breakpoint> breakpoints;
        for (const Breakpoint& k : signal.breakpoints)
            if (k.time < at) breakpoints.push_back(k);
        breakpoints.push_back({at, in_zero ? 0.0 : breakpoints.back().value, 0.0});
        signal.breakpoints = breakpoints;
    }
    return s;
}

// Largest difference of the coupled states at the end, in units of each one's largest magnitude in a run (or a
// billionth of its rated size, if it hardly moves). Speeds of input and load are one quantity seen from two sides.
template <class State>
double difference_at_end(const Drive& drive, const Samples& run, const State& other) {
    std::array<double, n_coupled> size{};
    for (int k = 0; k < n_coupled; ++k) {
        size[k] = 1e-9 * drive.rated_scale()[k];
        for (std::size_t n = 0; n < run.samples; ++n)
            size[k] = std::fmax(size[k], std::fabs(run(static_cast<Quantity>(k), n)));
    }
    size[load_speed] = std::fmax(size[load_speed], size[motor_speed] / drive.gearbox.ratio);
    double worst = 0.0;
    for (int k = 0; k < n_coupled; ++k) worst = std::fmax(worst, std::fabs(run.report.x[k] - other[k]) / size[k]);
    return worst;
}

// All values of the inputs times 1 + 1e-14: what this changes in a motion, rounding may change as well.
inline Signals perturbed(Signals signals) {
    for (Signal& s : signals) {
        for (Breakpoint& k : s.breakpoints) k.value *= 1.0 + 1e-14, k.slope *= 1.0 + 1e-14;
        for (Sine& q : s.sines) q.amplitude *= 1.0 + 1e-14;
    }
    return signals;
}

// A random drive whose inputs go on, or end in constants or zero, and an instant at which to split its run.
struct SplitCase {
    Drive drive;
    Signals signals;
    double duration, at;  // [s]

    SplitCase(RandomDrives& random, long n) : drive(random.drive()), signals(random.signals(drive, 0.25)) {
        const int kind = static_cast<int>(n % 4);
        duration = kind < 2 ? 0.25 : 5.0;
        at = duration * random.uniform(0.02, 0.98);
        if (kind > 0) signals = that_end(signals, kind == 1 ? 0.02 : 0.2, kind == 3);
    }
};

struct Splitting {
    Status status = Status::done, split = Status::done;
    double time = 0.0;           // [s] reached
    double gap = 0.0;            // between the whole run and the one that is split
    double amplification = 0.0;  // what becomes of a relative change of the inputs by 1e-14
};

// A run in one go against the same run that looks at its contacts anew at an instant.
inline Splitting split_run(const Drive& drive, const Signals& signals, double duration, double at) {
    Splitting out;
    const double interval = duration / 200.0;
    const Samples whole = run(drive, signals, duration, interval);
    out.status = whole.report.status;
    out.time = whole.report.time;
    if (out.status != Status::done) return out;
    using System = model::TrainSystem<model::Least>;
    const System system(whole.run.assembly());
    ExactSolver<System> solver(system, model::packed_signals<model::Least>({signals.begin(), signals.end()}), interval,
                               system.balanced_scale());
    Observer<System> nothing;
    out.split = solver.begin(0.0, {}, {});
    if (out.split == Status::done) out.split = solver.advance(at, nothing);
    if (out.split == Status::done) out.split = solver.inputs_changed();
    if (out.split == Status::done) out.split = solver.advance(duration, nothing);
    if (out.split == Status::done) out.gap = difference_at_end(drive, whole, solver.state());
    if (out.gap > 1e-10) {
        const Samples other = run(drive, perturbed(signals), duration, interval);
        out.amplification = other.report.status == Status::done ? difference_at_end(drive, whole, other.report.x) : 1.0;
    }
    return out;
}

// Rounding, as far as the motion amplifies it.
inline bool same_beyond_rounding(const Splitting& s) {
    return s.status == Status::done && s.split == Status::done && s.gap <= std::fmax(1e-9, 10.0 * s.amplification);
}

}  // namespace lostmotion::test
