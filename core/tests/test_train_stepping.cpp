// Trains step by step and at one instant: against whole runs, guards and closed forms.
#include <doctest/doctest.h>

#include <cstring>

#include "drive_runs.hpp"
#include "lostmotion/analysis/train_explain.hpp"
#include "lostmotion/scenario/simulation.hpp"
#include "lostmotion/simulation/train_stepping.hpp"
#include "random_trains.hpp"

TEST_SUITE_BEGIN("train_stepping");

namespace lostmotion::model {

using test::point;
using test::restore;

namespace {

using Values = std::vector<double>;

// Inputs at instants 0, h, 2h, ...: between them they run in straight lines.
std::vector<Values> random_levels(RandomTrains& random, std::size_t instants, int inputs) {
    std::vector<Values> levels(instants, Values(static_cast<std::size_t>(inputs)));
    for (Values& level : levels)
        for (double& u : level) u = random.uniform(-2.0, 2.0);
    return levels;
}
std::vector<Signal> straight_lines(const std::vector<Values>& levels, double h) {
    std::vector<Signal> signals(levels[0].size());
    for (std::size_t i = 0; i < signals.size(); ++i) {
        signals[i].breakpoints.clear();
        for (std::size_t k = 0; k + 1 < levels.size(); ++k)
            signals[i].breakpoints.push_back(
                {h * static_cast<double>(k), levels[k][i], (levels[k + 1][i] - levels[k][i]) / h});
    }
    return signals;
}
Values between(const Values& a, const Values& b, double share) {
    Values u(a.size());
    for (std::size_t i = 0; i < u.size(); ++i) u[i] = a[i] + (b[i] - a[i]) * share;
    return u;
}
template <class States>
double difference(const States& x, const Values& reference) {
    double off = 0.0;
    for (std::size_t k = 0; k < reference.size(); ++k)
        off = std::max(off, std::fabs(x[k] - reference[k]) / (1.0 + std::fabs(reference[k])));
    return off;
}

// In closed form, with the inertia forces left out: the motor winds up the gear from T_2 to the torque that frees the
// load, and the hardest point on the way counts. The torque that it needs is piecewise linear.
double smallest_command(const test::Drive& d, double T_2, double M_Z, int s) {
    const Gearbox& g = d.gearbox;
    const bool has_map = g.losses == Gearbox::loss_map;
    const auto to_pass_on = [&](double T) {
        return s * T / (g.ratio * (has_map ? 1.0 : g.efficiency)) + d.motor.friction_torque +
               g.loss_at_rest(s * T) / g.ratio;
    };
    const double freed = M_Z + s * d.load.friction_torque;
    double needed = to_pass_on(freed);
    if (s * (freed - T_2) > 0.0) {
        needed = std::fmax(needed, to_pass_on(T_2));
        for (int j = 0; has_map && j + 1 < g.map.load_intervals(); ++j)
            if (const double T = s * g.map.load_interval_upper(j) * g.rated_output_torque;
                (T - T_2) * (T - freed) < 0.0)
                needed = std::fmax(needed, to_pass_on(T));
    }
    return s * needed / d.motor.stall_torque();
}

}  // namespace

// The angle t^3, whose acceleration is one straight line, drives a load of 2 kg m2 through a spring: x'' = w^2 (t^3 -
// x), so that x = t^3 - 6 t/w^2 + 6 sin(w t)/w^3; the torque of the drive is J 6 t + k (t^3 - x).
TEST_CASE("a given motion is met at the end of each step, and its torque and what it drives have their closed forms") {
    Train t;
    t.shafts = {shaft(0.5), shaft(2.0)};
    t.shafts[0].name = "crank";
    t.shafts[1].name = "load";
    t.shafts[0].given_motion = true;
    t.gears = {spring(0, 1, 1.0, TorsionCurve({}, {200.0}))};
    t.gears[0].name = "g";
    ScenarioSimulation s(t, 0.1);
    const auto crank = s.given_shaft("crank");
    REQUIRE(crank);
    CHECK(!s.given_shaft("load"));
    const double w = 10.0;
    const Values nothing(s.names().inputs.size());
    for (int k = 1; k <= 20; ++k) {
        const double at = 0.1 * k;
        // All three, speed and angle, or speed and acceleration: what is left out follows.
        MotionEnd to{3.0 * at * at, at * at * at, 6.0 * at};
        if (k % 3 == 1) to.acceleration.reset();
        if (k % 3 == 2) to.angle.reset();
        REQUIRE(s.advance(0.1, nothing, nothing, std::vector{ScenarioSimulation::GivenCourse{*crank, to}}) ==
                Status::done);
        Values now(s.variables().size());
        REQUIRE(s.read(now.data()) == Status::done);
        const auto value = [&](const char* name) { return now[static_cast<std::size_t>(s.variables().place(name))]; };
        const double x = at * at * at - 6.0 * at / (w * w) + 6.0 * std::sin(w * at) / (w * w * w);
        CHECK(value("crank_speed") == doctest::Approx(3.0 * at * at).epsilon(1e-14));
        CHECK(value("crank_acceleration") == doctest::Approx(6.0 * at).epsilon(1e-11));
        CHECK(value("load_angle") == doctest::Approx(x).epsilon(1e-12));
        CHECK(value("g_twist") + value("load_angle") == doctest::Approx(at * at * at).epsilon(1e-13));
        CHECK(value("crank_drive_torque") == doctest::Approx(3.0 * at + 200.0 * (at * at * at - x)).epsilon(1e-10));
    }
}

TEST_CASE("random trains stepped with intervals split at random follow the run in one go") {
    RandomTrains random(52);
    constexpr double h = 0.02;
    constexpr std::size_t steps = 60;
    int compared = 0, sensitive = 0;
    for (int n = 0; n < cases(150); ++n) {
        const lostmotion::TrainRun run(random.train(random.pick(2, 6), true));
        REQUIRE(run.error() == "");
        const Assembly& a = run.assembly();
        const auto levels = random_levels(random, steps + 1, a.layout().inputs);
        TrainOptions options;
        options.duration = h * steps;
        options.energy = false;
        std::vector<double> none;
        const TrainReport whole = run.run(straight_lines(levels, h), {}, {}, options, none.data());
        TrainSimulation stepped(a.train(), h);
        Status status = Status::done;
        for (std::size_t k = 0; k < steps && status == Status::done; ++k) {
            double at = 0.0;
            while (at < 1.0 && status == Status::done) {
                const double to = random.coin(0.4) ? 1.0 : std::min(1.0, at + random.uniform(0.05, 0.9));
                status = stepped.motion().advance(h * (to - at), between(levels[k], levels[k + 1], at),
                                                  between(levels[k], levels[k + 1], to));
                at = to;
            }
        }
        CAPTURE(n);
        REQUIRE(status == whole.status);
        if (status != Status::done) continue;
        ++compared;
        const TrainPoint end = point(stepped);
        const double off = difference(end.now.x, whole.x);
        if (off < 1e-9) continue;
        // What changes of the inputs by 1e-14 do, rounding may do as well.
        ++sensitive;
        RandomTrains changes(n);
        double amplified = 0.0;
        for (int k = 0; k < 8; ++k) {
            auto changed = levels;
            for (Values& level : changed)
                for (double& u : level) u *= 1.0 + changes.uniform(-1e-14, 1e-14);
            const TrainReport other = run.run(straight_lines(changed, h), {}, {}, options, none.data());
            REQUIRE(other.status == whole.status);
            amplified = std::max(amplified, difference(other.x, whole.x));
        }
        CHECK(off < 10.0 * amplified);
    }
    MESSAGE(compared << " trains compared, " << sensitive << " that rounding may change");
    CHECK(compared > share(140));
    CHECK(sensitive < 3);
}

TEST_CASE("a restored simulation of a train continues bit for bit") {
    RandomTrains random(53);
    for (int n = 0; n < cases(300); ++n) {
        const Train train = random.train(random.pick(2, 6), true);
        TrainSimulation a(train, 1e-2), b(train, 1e-2);
        const auto levels = random_levels(random, 121, a.assembly().layout().inputs);
        CAPTURE(n);
        Status status = Status::done;
        for (std::size_t k = 0; k < 120 && status == Status::done; ++k) {
            if (k == 47) restore(b, a);
            const Values& begin = levels[k % 5 == 0 ? k + 1 : k];  // held now and then
            status = a.motion().advance(1e-2, begin, levels[k + 1]);
            if (k < 47) continue;
            REQUIRE(b.motion().advance(1e-2, begin, levels[k + 1]) == status);
            if (status != Status::done) break;
            const TrainPoint p = point(a), q = point(b);
            REQUIRE(p.now.x == q.now.x);
            REQUIRE(p.now.memory == q.now.memory);
            REQUIRE(p.key == q.key);
            REQUIRE(std::memcmp(p.values.data(), q.values.data(), p.values.size() * sizeof(double)) == 0);
        }
    }
}

TEST_CASE("what a contact at rest can hold is its guard's margin and what it holds; sliding it takes its capacity") {
    RandomTrains random(54);
    int stuck = 0, sliding = 0;
    for (int n = 0; n < cases(200); ++n) {
        TrainSimulation s(random.train(random.pick(2, 6), true), 1e-2);
        const Assembly& a = s.assembly();
        const auto levels = random_levels(random, 40, a.layout().inputs);
        for (const Values& level : levels) {
            if (s.motion().advance(1e-2, level, level) != Status::done) break;
            const TrainPoint p = point(s);
            const Regime r = a.build(p.key);
            const auto contacts = explain_contacts(a, p);
            CAPTURE(n);
            for (const Guard& g : r.guards) {
                if (g.kind != Guard::capacity) continue;
                const ContactReport& c = contacts[static_cast<std::size_t>(g.contact)];
                const double capacity = g.neighbour > 0 ? c.capacity_forward : c.capacity_backward;
                const double margin = evaluate(a.layout(), g.form, p.now), size = magnitude(a.layout(), g.form, p.now);
                CHECK(std::fabs(capacity - g.neighbour * c.torque - margin) <= 1e-13 * size);
                ++stuck;
            }
            for (std::size_t k = 0; k < contacts.size(); ++k) {
                const ContactReport& c = contacts[k];
                if (r.at_rest[k] || c.mode == 0) continue;
                const double size = magnitude(a.layout(), r.contact_torque[k], p.now);
                const double capacity = c.mode > 0 ? c.capacity_forward : c.capacity_backward;
                CHECK(std::fabs(capacity - c.mode * c.torque) <= 1e-11 * size);
                ++sliding;
            }
        }
    }
    MESSAGE(stuck << " margins, " << sliding << " sliding contacts");
    CHECK(stuck > share(1000));
    CHECK(sliding > share(1000));
}

TEST_CASE("the command that turns the motor of a drive is that of a closed form") {
    test::RandomDrives random(55);
    int compared = 0;
    for (int n = 0; n < cases(100); ++n) {
        const test::Drive d = random.drive();
        if (d.jams()) continue;
        TrainSimulation s(train_of(d), 1e-3);
        for (int k = 0; k < 10; ++k) {
            const double u = random.uniform(-0.5, 0.5), M_Z = random.uniform(-1.0, 1.0) * d.gearbox.rated_output_torque;
            if (s.motion().advance(5e-3, Values{u, M_Z}, Values{u, M_Z}) != Status::done) break;
            const TrainPoint p = point(s);
            const double T_2 = evaluate(s.assembly().layout(), s.assembly().build(p.key).output_torque[0], p.now);
            const auto motors = explain_motors(s.assembly(), p);
            const double forward = smallest_command(d, T_2, M_Z, +1), backward = smallest_command(d, T_2, M_Z, -1);
            const double size = std::fabs(forward) + std::fabs(backward);
            CAPTURE(n);
            CHECK(std::fabs(motors[0].command_forward - forward) <= 1e-13 * size);
            CHECK(std::fabs(motors[0].command_backward - backward) <= 1e-13 * size);
            ++compared;
        }
    }
    CHECK(compared > share(500));
}

// A motor of ratio 1 on a shaft, and what it has to turn.
TEST_CASE("the command that turns a motor: what is behind a clutch, a freewheel, a locking gear or a loop") {
    Train t;
    t.shafts = {shaft(1.0), shaft(1.0), shaft(1.0)};
    t.shafts[0].friction.torque = 0.5;
    t.shafts[1].friction.torque = 1.0;
    t.shafts[1].friction.breakaway_torque = 1.25;
    t.shafts[2].friction.torque = 2.0;
    t.shafts[2].loaded = true;
    t.motors = {torque_motor(0)};
    const auto commands = [](const Train& train, const Values& u) {
        TrainSimulation s(train, 1e-3);
        REQUIRE(model::check(train).empty());
        REQUIRE(s.motion().advance(1e-6, u, u) == Status::done);
        return explain_motors(s.assembly(), point(s));
    };
    Gear slow = spring(0, 1, 2.0, TorsionCurve({}, {100.0}));
    slow.efficiencies.emplace(0.8, 0.5);
    Train chain = t;
    chain.gears = {slow, spring(1, 2, 4.0, TorsionCurve({}, {100.0}))};
    // Load 6 on the last: forward (6 + 2)/4 + 1.25 = 3.25, /(2 * 0.8) + 0.5; backward (6 - 2)/4 - 1.25 = -0.25, which
    // is driving in that direction.
    auto of = commands(chain, {0.0, 6.0});
    CHECK(of[0].command_forward == doctest::Approx(3.25 / 1.6 + 0.5).epsilon(1e-14));
    CHECK(of[0].command_backward == doctest::Approx(-0.25 / 1.6 - 0.5).epsilon(1e-14));
    // A load of 16 overruns: (16 - 2)/4 - 1.25 = 2.25, of which 0.5/2 reaches the motor.
    of = commands(chain, {0.0, 16.0});
    CHECK(of[0].command_backward == doctest::Approx(2.25 * 0.25 - 0.5).epsilon(1e-14));
    // A safety clutch passes on no more than it can; a freewheel drives one way only.
    Train clutched = t;
    clutched.gears = {slow};
    clutched.clutches = {{"clutch", 1, 2, 3.0, 0.0, true}};
    of = commands(clutched, {0.0, 6.0});
    CHECK(of[0].command_forward == doctest::Approx((3.0 + 1.25) / 1.6 + 0.5).epsilon(1e-14));
    clutched.clutches.clear();
    clutched.freewheels = {{"freewheel", 1, 2}};
    of = commands(clutched, {0.0, 6.0});
    CHECK(of[0].command_forward == doctest::Approx((8.0 + 1.25) / 1.6 + 0.5).epsilon(1e-14));
    of = commands(clutched, {0.0, 0.0});
    CHECK(of[0].command_backward == doctest::Approx(-1.25 / 1.6 - 0.5).epsilon(1e-14));
    // A motor on the output has to turn the input from behind: friction 0.5 at 0.5/2 a unit. One that locks holds.
    Train behind = t;
    behind.motors = {torque_motor(1)};
    behind.gears = {slow, spring(1, 2, 4.0, TorsionCurve({}, {100.0}))};
    of = commands(behind, {0.0, 0.0});
    CHECK(of[0].command_forward == doctest::Approx(0.5 / 0.25 + 1.25 + 0.5).epsilon(1e-14));
    CHECK(of[0].command_backward == doctest::Approx(-0.5 / 0.25 - 1.25 - 0.5).epsilon(1e-14));
    behind.gears[0].efficiencies.emplace(0.4, -0.1);
    of = commands(behind, {0.0, 0.0});
    CHECK(of[0].command_forward == std::numeric_limits<double>::infinity());
    CHECK(of[0].command_backward == -std::numeric_limits<double>::infinity());
    // A damper passes nothing on to a shaft that turns with its own as slowly, but lets one that turns act on it.
    Train damped = t;
    damped.gears = {slow};
    damped.dampers = {{"damper", 2, 0, 0.3}};
    CHECK(commands(damped, {0.0, 1.0})[0].command_forward == doctest::Approx(1.25 / 1.6 + 0.5).epsilon(1e-14));
    damped.shafts[2].name = "turning";
    TrainSimulation s(damped, 1e-3);
    REQUIRE(s.reset({{{"turning_speed", 1.0}}, {}}) == "");
    REQUIRE(s.motion().advance(1e-9, Values{0.0, 0.0}, Values{0.0, 0.0}) == Status::done);
    of = explain_motors(s.assembly(), point(s));
    CHECK(of[0].command_forward == doctest::Approx(1.25 / 1.6 + 0.5 - 0.3).epsilon(1e-8));
    CHECK(of[0].command_backward == doctest::Approx(-1.25 / 1.6 - 0.5 - 0.3).epsilon(1e-8));
    Train loop = chain;
    loop.gears.push_back(spring(0, 2, 8.0, TorsionCurve({}, {100.0})));
    CHECK(std::isnan(commands(loop, {0.0, 0.0})[0].command_forward));
}

}  // namespace lostmotion::model

TEST_SUITE_END();
