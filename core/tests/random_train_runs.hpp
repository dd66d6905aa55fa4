// Runs of random trains, each by several ways: the exact solver, the adaptive one, time stepping, and the laws that
// every run obeys. The tests and `make soak` share them.
#pragma once

#include <cstdio>
#include <initializer_list>
#include <limits>

#include "lostmotion/base/decimal.hpp"
#include "lostmotion/model/shaft_angle.hpp"
#include "random_trains.hpp"
#include "recorded.hpp"
#include "time_stepping.hpp"

namespace lostmotion::model {

// The largest difference of a state before an instant, in units of its largest value.
inline double difference(const Recorded& p, const Recorded& q, double sign = 1.0,
                         double before = std::numeric_limits<double>::infinity()) {
    double worst = 0.0;
    for (std::size_t c = 0; c < p.run.channels().size(); ++c) {
        if (p.run.channels()[c].kind != TrainChannel::state) continue;
        double size = 1e-6, most = 0.0;
        for (std::size_t k = 0; k < p.samples; ++k) {
            size = std::max(size, std::fabs(p.out[c * p.samples + k]));
            if (!(p.interval * static_cast<double>(k) < before)) continue;
            most = std::max(most, std::fabs(p.out[c * p.samples + k] - sign * q.out[c * p.samples + k]));
        }
        worst = std::max(worst, most / size);
    }
    return worst;
}

// Trains of up to 16 coupled states; test_large_trains.cpp has others.
inline bool is_small(const Layout& n) {
    return n.coupled <= 16 && n.angles <= 4 && n.inputs <= 16 && n.memory <= 20 && n.contacts <= 24;
}

// A random train, with its inputs.
struct RandomRun {
    Train train;
    std::vector<Signal> inputs;

    RandomRun(RandomTrains& random, int shafts, double duration, int fewest = 2) {
        do train = named(random.any(random.pick(fewest, shafts)));
        while (lostmotion::TrainRun(train).error() != "" || (fewest == 2 && !is_small(Assembly(train).layout())));
        inputs = random.signals(Assembly(train), duration);
    }
    RandomRun(Train t, std::vector<Signal> u) : train(named(std::move(t))), inputs(std::move(u)) {}
};

// Of about the torque 1, with a field that is weakened above the speed of 0.3 of an electrical turn in a tick, and
// gains of loops g/(z (z - 1)).
inline control::FieldOrientation random_winding(RandomTrains& random, double sample_time) {
    control::FieldOrientation f;
    f.current_limit = 2.0;
    f.winding.pole_pairs = random.pick(1, 4);
    f.winding.flux_linkage = random.uniform(0.1, 0.3);
    f.winding.inductance_d = f.winding.flux_linkage * random.uniform(0.1, 0.4);
    f.winding.inductance_q = f.winding.inductance_d * (random.coin() ? 1.0 : random.uniform(1.0, 2.5));
    f.winding.resistance = f.winding.inductance_d / (sample_time * random.uniform(5.0, 50.0));
    f.gain = 0.3;
    f.voltage_limit = f.winding.flux_linkage * 0.3 / sample_time;
    f.sample_time = sample_time;
    f.parts = random.pick(1, 2);
    return f;
}

// Controllers for some of its motors: torque, speed or position, of plausible gains, with the encoder on any shaft
// whose angle is known. windings: torque sources are such under field-oriented control.
inline Control random_control(RandomTrains& random, const Assembly& a, bool windings = false) {
    using control::Axis;
    Control c;
    c.tick = random.spread(5e-4, 5e-3);
    for (std::size_t m = 0; m < a.train().motors.size(); ++m) {
        const ShaftMotor& motor = a.train().motors[m];
        if (m > 0 && random.coin()) continue;
        ControlledAxis axis;
        axis.motor = static_cast<int>(m);
        axis.speed_shaft = axis.position_shaft = motor.shaft;
        if (!shaft_angle(a, motor.shaft)) continue;
        Axis& law = axis.law;
        law.mode = static_cast<Axis::Mode>(random.pick(0, 2));
        law.delay.samples = random.pick(0, 2);
        law.estimate.kind = static_cast<control::SpeedEstimate::Kind>(random.pick(0, 2));
        law.estimate.span = random.pick(1, 3);
        law.estimate.time_constant = c.tick * random.uniform(0.0, 4.0);
        law.estimate.bandwidth = random.uniform(0.008, 0.05) / c.tick;
        law.speed_schedule.every = law.current_schedule.every = random.pick(1, 2);
        law.position_schedule = {law.speed_schedule.every * random.pick(1, 4), random.pick(0, 1)};
        const double bandwidth = random.uniform(0.01, 0.05) / (c.tick * law.speed_schedule.every);
        law.speed_loop.gain = bandwidth;
        law.speed_loop.reference_weight = random.uniform(0.3, 1.0);
        law.speed_loop.integral_gain = random.coin() ? law.speed_loop.gain * bandwidth * 0.2 : 0.0;
        law.speed_loop.torque_limit = random.uniform(0.5, 3.0);
        law.position_loop.gain = 0.2 * bandwidth;
        law.position_loop.feedforward = random.uniform(0.0, 1.0);
        law.feedforward.inertia = random.uniform(0.0, 1.0);
        law.rated_torque = motor.law.rated_torque;
        if (motor.law.kind == Motor::dc) {
            control::CurrentLoop& loop = law.current_loop.emplace();
            loop.electrical_time_constant = motor.law.electrical_time_constant;
            loop.armature_voltage_constant = motor.law.armature_voltage_constant;
            loop.rated_speed = motor.law.rated_speed;
            loop.rated_torque = motor.law.rated_torque;
            loop.command_limit = 2.0;
        } else if (windings) {
            law.field_orientation = random_winding(random, c.tick * law.current_schedule.every);
            law.field_orientation->delay = law.delay;
            law.field_orientation->delay_time = c.tick * law.delay.samples;
        }
        const double amplitude = random.uniform(0.1, 1.0);
        law.reference.sines.push_back({amplitude, random.uniform(0.5, 3.0), random.uniform(0.0, 6.0)});
        if (random.coin()) law.reference.pieces.push_back({0.1, {0.3, random.uniform(-1.0, 1.0), 0.5, -0.2}});
        c.axes.push_back(axis);
    }
    return c;
}

// Where contacts are redundant, their torques depend on what they were, or are shared by another rule. If one of them
// holds more than it takes while it slips, or a loss depends on such a torque, so does the instant at which one of them
// breaks away: rigid bodies leave it open.
inline bool leaves_break_away_open(const Train& t) {
    const Assembly a(t);
    const auto more = [](const auto& e) { return e.holding() > e.torque; };
    return std::any_of(a.places().contacts.begin(), a.places().contacts.end(),
                       [](const ContactPlace& c) { return c.locked != nowhere; }) &&
           (std::any_of(t.brakes.begin(), t.brakes.end(), more) ||
            std::any_of(t.clutches.begin(), t.clutches.end(), more) ||
            std::any_of(t.gears.begin(), t.gears.end(), [](const Gear& g) { return g.has_dry_losses(); }) ||
            std::any_of(t.shafts.begin(), t.shafts.end(),
                        [](const Shaft& s) { return s.friction.holding() > s.friction.at_zero(0); }));
}

// What time stepping converges to. A run is undecided if it does not agree with itself.
struct SteppingTally {
    int compared = 0, undecided = 0, open = 0, wrong = 0;
    double worst = 0.0;

    int failed() const { return wrong; }
    std::string text() const {
        return std::to_string(compared) + " trains compared, " + std::to_string(undecided) + " undecided, " +
               std::to_string(open) + " whose break-away rigid bodies leave open; largest difference " +
               general_text(worst, 3);
    }
};

// The largest difference of a speed or twist between the exact run and stepping `coarse` and four times as often, and
// between the two.
struct Stepped {
    double exact = 0.0, own = 0.0;

    Stepped(const Recorded& r, const Train& train, const std::vector<Signal>& inputs, double duration, long coarse) {
        TrainSteps a(train, inputs), b(train, inputs);
        const long parts = static_cast<long>(r.samples) - 1;
        const double h = duration / static_cast<double>(coarse);
        std::vector<double> size(train.shafts.size() + train.gears.size(), 1e-3), own_gap(size.size()),
            gap(size.size());
        for (long k = 0; k < coarse && !a.stopped && !b.stopped; ++k) {
            const double t = h * static_cast<double>(k);
            a.step(t, h);
            for (int n = 0; n < 4; ++n) b.step(t + 0.25 * h * n, 0.25 * h);
            if ((k + 1) % (coarse / parts) != 0) continue;
            const auto sample = static_cast<std::size_t>((k + 1) / (coarse / parts));
            const auto note = [&](std::size_t at, const double* exact, double one, double other) {
                size[at] = std::max(size[at], std::fabs(exact[sample]));
                gap[at] = std::max(gap[at], std::fabs(exact[sample] - other));
                own_gap[at] = std::max(own_gap[at], std::fabs(one - other));
            };
            for (std::size_t s = 0; s < train.shafts.size(); ++s)
                note(s, r.channel(train.shafts[s].name + "_speed"), a.speed[s], b.speed[s]);
            for (std::size_t g = 0; g < train.gears.size(); ++g)
                if (const double* d = r.channel(train.gears[g].name + "_twist"); d != nullptr)
                    note(train.shafts.size() + g, d, a.twist[g], b.twist[g]);
        }
        for (std::size_t k = 0; k < size.size(); ++k) {
            exact = std::max(exact, gap[k] / size[k]);
            own = std::max(own, own_gap[k] / size[k]);
        }
        if (a.stopped || b.stopped) own = 1.0;
    }
    // Of a method of first order, the finer run is off by a third of what the two differ by.
    bool agrees() const { return exact <= own + 1e-6; }
    bool decided() const { return own < 0.02; }
};

inline void compare_with_steps(const RandomRun& r, double duration, long steps, SteppingTally& tally,
                               const char* tell = nullptr) {
    const Recorded exact(r.train, r.inputs, duration, duration / 20.0);
    if (!exact.done()) {
        ++tally.undecided;
        return;
    }
    Stepped s(exact, r.train, r.inputs, duration, steps);
    for (int finer = 0; finer < 2 && !(s.decided() && s.agrees()); ++finer)
        s = Stepped(exact, r.train, r.inputs, duration, steps *= 8);
    if (!s.decided()) {
        ++tally.undecided;
        return;
    }
    if (!s.agrees() && leaves_break_away_open(r.train)) {
        ++tally.open;
        return;
    }
    ++tally.compared;
    tally.worst = std::max(tally.worst, s.exact);
    if (s.agrees()) return;
    ++tally.wrong;
    if (tell != nullptr)
        std::printf("  %s: exact run and time stepping differ by %.2g, stepping with itself by %.2g\n", tell, s.exact,
                    s.own);
}
inline void compare_with_steps(RandomTrains& random, int shafts, double duration, long steps, SteppingTally& tally,
                               const char* tell = nullptr) {
    compare_with_steps(RandomRun(random, shafts, duration), duration, steps, tally, tell);
}

// Do two runs switch at the same instants? The adaptive solver turns a speed that dies out through zero by its error,
// at an instant that depends on the tolerance.
inline bool same_instants(const Recorded& p, const Recorded& q) {
    return std::equal(p.report.switchings.begin(), p.report.switchings.end(), q.report.switchings.begin(),
                      q.report.switchings.end(),
                      [](const auto& a, const auto& b) { return std::fabs(a.time - b.time) < 1e-6; });
}

// Where two runs part, does a speed graze zero in one of them? An undamped shaft under a torque that rises in a
// straight line comes back to zero once a period: whether its hysteresis is set anew there is decided by rounding.
inline bool part_at_grazing(const Recorded& p, const Recorded& q) {
    const auto &a = p.report.switchings, &b = q.report.switchings;
    std::size_t k = 0;
    while (k < std::min(a.size(), b.size()) && std::fabs(a[k].time - b[k].time) < 1e-6) ++k;
    const auto grazes = [k](const auto& all) {
        return k < all.size() && !all[k].input_jump && all[k].kind == Guard::speed && all[k].before == all[k].after;
    };
    return grazes(a) || grazes(b);
}

// The first instant at which only one of two runs switches; infinite if there is none.
inline double parting(const Recorded& p, const Recorded& q) {
    const auto &a = p.report.switchings, &b = q.report.switchings;
    std::size_t k = 0;
    while (k < std::min(a.size(), b.size()) && std::fabs(a[k].time - b[k].time) < 1e-6) ++k;
    constexpr double never = std::numeric_limits<double>::infinity();
    return std::min(k < a.size() ? a[k].time : never, k < b.size() ? b[k].time : never);
}

// Do runs by smaller and smaller tolerances follow a run for longer and longer, each until then to within 1e-6? A
// speed that dies out never reaches zero: the adaptive solver turns it by its error, later with a smaller one.
inline bool follow_for_longer(const Recorded& exact, std::initializer_list<const Recorded*> finer) {
    double until = 0.0;
    for (const Recorded* run : finer) {
        const double parts = parting(exact, *run);
        if (!run->done() || !(parts > until + 1e-6) || difference(exact, *run, 1.0, parts) > 1e-6) return false;
        until = parts;
    }
    return true;
}

// The same train with inertias, frictions and inputs that differ by up to `size` of their values.
inline RandomRun nearby(const RandomRun& r, RandomTrains& random, double size) {
    RandomRun other = r;
    const auto factor = [&] { return 1.0 + size * random.uniform(-1.0, 1.0); };
    for (Shaft& s : other.train.shafts) {
        s.inertia *= factor();
        const double friction = factor();
        s.friction.torque *= friction;
        s.friction.breakaway_torque *= friction;
    }
    for (Signal& u : other.inputs) {
        const double scale = factor();
        for (Breakpoint& b : u.breakpoints) b = {b.time, scale * b.value, scale * b.slope};
        for (Sine& w : u.sines) w.amplitude *= scale;
    }
    return other;
}

// Is a motion one that the exact solver finds of a train nearby? At an event that rounding decides, such as a speed
// that touches zero, two motions begin. A motion that is an error of either solver is none of them.
inline bool is_branch(const RandomRun& r, const Control& control, double duration, const Recorded& motion) {
    RandomTrains random(1);
    for (const double size : {1e-12, 1e-11, 1e-10, 1e-9, 5e-9})
        for (int n = 0; n < 20; ++n) {
            const RandomRun other = nearby(r, random, size);
            const Recorded exact(other.train, other.inputs, duration, duration / 50.0, 0.0, {}, {}, control);
            if (exact.done() && difference(exact, motion) < 1e-5) return true;
        }
    return false;
}

// Exact against adaptive solver. Two tolerances of the adaptive one tell how well it knows the motion: a run counts if
// it agrees with itself. Where it does not, or has taken the same steps with both, smaller ones tell. Where these part
// from each other or from the exact run at an event that rounding decides, the exact solver has to find each of the
// motions in trains nearby (`forked`), or all of them follow it for longer with each smaller tolerance (`outlasted`).
struct SolverTally {
    int compared = 0, forked = 0, outlasted = 0, undecided = 0, jammed = 0, wrong = 0;
    double worst = 0.0;

    int failed() const { return wrong + jammed; }
    std::string text() const {
        const auto n = [](int count) { return std::to_string(count); };
        return n(compared) + " trains compared, largest difference " + general_text(worst, 3) + "; " + n(undecided) +
               " that the adaptive solver does not settle, " + n(forked) + " with two motions, " + n(outlasted) +
               " that the adaptive solver follows for a time, " + n(jammed) + " that jam";
    }
};

inline void compare_solvers(const RandomRun& r, const Control& control, double duration, SolverTally& tally,
                            const char* tell = nullptr) {
    const auto run = [&](double tolerance) {
        return Recorded(r.train, r.inputs, duration, duration / 50.0, tolerance, {}, {}, control);
    };
    const Recorded exact = run(0.0), fine = run(1e-10);
    if (!exact.done()) {
        ++tally.jammed;
        return;
    }
    double gap = fine.done() ? difference(exact, fine) : 1.0, own = 0.0;
    if (gap > 1e-7) {
        const Recorded coarse = run(1e-8);
        own = fine.done() && coarse.done() ? difference(coarse, fine) : 1.0;
    }
    if (own > 1e-5 || gap > std::max(1e-6, 2.0 * own)) {
        const Recorded finer = run(1e-12), finest = run(1e-13);
        own = finer.done() && finest.done() ? difference(finer, finest) : 1.0;
        gap = finest.done() ? difference(exact, finest) : 1.0;
        if (gap > 1e-6 && (!same_instants(finer, finest) || part_at_grazing(exact, finest))) own = 1.0;
        if (own > 1e-5 && gap > 1e-6 && finest.done()) {
            if (follow_for_longer(exact, {&fine, &finer, &finest})) {
                ++tally.outlasted;
                return;
            }
            const bool both =
                is_branch(r, control, duration, finest) &&
                (!finer.done() || difference(finer, finest) < 1e-5 || is_branch(r, control, duration, finer));
            if (both) {
                ++tally.forked;
                return;
            }
        }
    }
    if (own > 1e-5 && gap > 1e-6) {
        ++tally.undecided;
        if (tell != nullptr) std::printf("  %s: the adaptive run does not settle\n", tell);
        return;
    }
    const bool agree = gap <= std::max(1e-6, 2.0 * own);
    ++tally.compared;
    tally.worst = std::max(tally.worst, gap);
    if (agree) return;
    ++tally.wrong;
    if (tell != nullptr)
        std::printf("  %s: exact and adaptive run differ by %.2g, the adaptive one with itself by %.2g\n", tell, gap,
                    own);
}

inline void compare_solvers(RandomTrains& random, int shafts, double duration, SolverTally& tally,
                            const char* tell = nullptr, bool closed_loop = false, bool windings = false) {
    const RandomRun r(random, shafts, duration);
    const Control control = closed_loop ? random_control(random, Assembly(r.train), windings) : Control{};
    compare_solvers(r, control, duration, tally, tell);
}

// Balance and sign of the energies, mirror image, sampling, a split at which all signals begin anew.
struct LawTally {
    int runs = 0, undecided = 0, unbalanced = 0, gained = 0, mirrored = 0;
    int unlike_mirror = 0, unlike_sampled = 0, unlike_split = 0;
    double residual = 0.0;

    int failed() const { return unbalanced + gained + unlike_mirror + unlike_sampled + unlike_split; }
};

// Nothing of it tells forward from backward.
inline bool is_symmetric(const Train& t) {
    return t.angle_torques.empty() && t.freewheels.empty() &&
           std::none_of(t.gears.begin(), t.gears.end(), [](const Gear& g) { return g.over_angle(); });
}
// What it turns into heat is nowhere negative: a constant efficiency gives energy where the load drives.
inline bool loses_only(const Train& t) {
    return std::none_of(t.gears.begin(), t.gears.end(),
                        [](const Gear& g) { return !g.has_dry_losses() && g.law.efficiency < 1.0; });
}
// The same signal with its zero of time at t.
inline Signal from(const Signal& s, double t) {
    Signal out;
    const std::size_t k = s.segment(t);
    out.breakpoints[0] = {0.0, s.breakpoints[k].value + s.breakpoints[k].slope * (t - s.breakpoints[k].time),
                          s.breakpoints[k].slope};
    for (std::size_t n = k + 1; n < s.breakpoints.size(); ++n)
        out.breakpoints.push_back({s.breakpoints[n].time - t, s.breakpoints[n].value, s.breakpoints[n].slope});
    out.sines = s.sines;
    for (Sine& w : out.sines) w.phase += 2.0 * pi * w.frequency * t;
    return out;
}
// Of the states at the end, in units of their largest values in the course of a run.
inline double difference_at_end(const Recorded& run, const std::vector<double>& x) {
    double worst = 0.0;
    for (std::size_t c = 0; c < run.run.channels().size(); ++c) {
        if (run.run.channels()[c].kind != TrainChannel::state) continue;
        double size = 1e-6;
        for (std::size_t k = 0; k < run.samples; ++k) size = std::max(size, std::fabs(run.out[c * run.samples + k]));
        const auto state = static_cast<std::size_t>(run.run.channels()[c].index);
        worst = std::max(worst, std::fabs(run.report.x[state] - x[state]) / size);
    }
    return worst;
}

inline void check_laws(RandomTrains& random, int shafts, double duration, LawTally& tally, const char* tell = nullptr) {
    const RandomRun r(random, shafts, duration);
    const double at = random.uniform(0.1, 0.9) * duration;
    const Recorded run(r.train, r.inputs, duration, duration / 40.0);
    if (!run.done()) return;
    ++tally.runs;
    const auto count = [&](int& wrong, const char* what, double by) {
        ++wrong;
        if (tell != nullptr) std::printf("  %s: %s by %.2g\n", tell, what, by);
    };
    const double turned_over = std::max(1e-9, run.report.turned_over), residual = std::fabs(run.report.residual());
    tally.residual = std::max(tally.residual, residual / turned_over);
    if (residual > 1e-9 * turned_over) count(tally.unbalanced, "energies do not balance", residual / turned_over);
    for (const TrainEnergy& e : run.report.energy)
        if (e.kind == PowerFlow::loss && e.energy < -1e-10 * turned_over && loses_only(r.train))
            count(tally.gained, e.name.c_str(), -e.energy / turned_over);

    const Recorded sampled(r.train, r.inputs, duration, duration / 7.0);
    // An error of rounding grows by up to a thousand from switching to switching of a run of this length.
    constexpr double near = 1e-9;
    if (const double d = sampled.done() ? difference_at_end(run, sampled.report.x) : 1.0; d > near)
        count(tally.unlike_sampled, "sampling changes it", d);
    if (is_symmetric(r.train)) {
        ++tally.mirrored;
        std::vector<Signal> inputs = r.inputs;
        // Brakes and clutches have no mirror image.
        const std::size_t motors_and_loads =
            r.train.motors.size() + static_cast<std::size_t>(std::count_if(r.train.shafts.begin(), r.train.shafts.end(),
                                                                           [](const Shaft& s) { return s.loaded; }));
        for (std::size_t k = 0; k < motors_and_loads; ++k) inputs[k] = test::mirrored(inputs[k]);
        const Recorded image(r.train, inputs, duration, duration / 40.0);
        if (const double d = image.done() ? difference(run, image, -1.0) : 1.0; d > near)
            count(tally.unlike_mirror, "its mirror image differs", d);
    }
    const Recorded first(r.train, r.inputs, at, at / 2.0);
    std::vector<Signal> rest;
    for (const Signal& s : r.inputs) rest.push_back(from(s, at));
    const Recorded second(r.train, rest, duration - at, (duration - at) / 2.0, 0.0, first.report.x,
                          first.report.memory);
    if (const double d = second.done() ? difference_at_end(run, second.report.x) : 1.0; d > near)
        count(tally.unlike_split, "split it differs", d);
}

}  // namespace lostmotion::model
