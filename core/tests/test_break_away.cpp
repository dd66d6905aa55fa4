// Contacts that hold more than they take while they slip: which of several consistent combinations of modes follows.
#include <doctest/doctest.h>

#include "paused_run.hpp"
#include "random_trains.hpp"
#include "regularised_contacts.hpp"

TEST_SUITE_BEGIN("break_away");

namespace lostmotion::model {
namespace {

// Shafts in a row that safety clutches join, all at one speed at first, under torques that jump once.
struct ClutchedShafts {
    Train train;
    std::vector<double> torque, after_jump;
    double jump = 1e9;

    void add_shaft(double inertia, double friction, double T) {
        train.shafts.push_back(shaft(inertia));
        train.shafts.back().friction.torque = friction;
        train.shafts.back().loaded = true;
        torque.push_back(T);
        after_jump.push_back(T);
    }
    void add_clutch(double T, double holding) {
        const int s = static_cast<int>(train.clutches.size());
        train.clutches.push_back({"clutch", s, s + 1, T, holding, true});
    }
    // reserve: factor of the holding torques of the clutches.
    std::vector<double> regularised(double speed, double duration, double v, double reserve = 1.0) const {
        Train t = train;
        for (Clutch& c : t.clutches) c.breakaway_torque *= reserve;
        return regularised_speeds(t, torque, after_jump, jump, std::vector<double>(torque.size(), speed), duration, v);
    }
};

struct Outcome {
    std::vector<double> speeds;
    bool open = false;  // rest has left torques open, which rigid contacts alone do not decide
    bool slips_at_once = false;
};

Outcome run_of(const ClutchedShafts& row, double speed, double duration) {
    TrainRun run(row.train);
    for (int s = 0; s < static_cast<int>(row.torque.size()); ++s) {
        const auto k = static_cast<std::size_t>(s);
        run.speed(s) = speed;
        run.inputs[run.load(s)] = lines({{0.0, -row.torque[k]}, {row.jump, -row.after_jump[k]}});
    }
    REQUIRE(run.begin());
    Outcome out;
    for (int c = 0; c < run.layout().contacts; ++c)
        if (run.assembly.places().contacts[c].kind == ContactPlace::coupling) out.slips_at_once |= run.mode(c) != 0;
    REQUIRE(run.run(duration));
    for (const auto& e : run.events) out.open |= !run.assembly.build(e.after).locked.empty();
    for (std::size_t s = 0; s < row.torque.size(); ++s) out.speeds.push_back(run.speed(static_cast<int>(s)));
    return out;
}

}  // namespace

TEST_CASE("a clutch with reserve goes on to hold where another contact stops") {
    // Friction of a reverses at the stop: (1.4 - 0.5 + 0.45)/0.2 = 6.75 rad/s^2 before, 2.25 after it, where the clutch
    // takes 1.4 - 0.18 2.25 = 0.995 N m.
    const auto ends_at = [&](double holding, double a, double b) {
        ClutchedShafts row;
        row.add_shaft(0.02, 0.45, -0.5);
        row.add_shaft(0.18, 0.0, 1.4);
        row.add_clutch(0.9, holding);
        const Outcome out = run_of(row, -1.0, 1.0);
        CHECK(out.speeds[0] == doctest::Approx(a).epsilon(1e-12));
        CHECK(out.speeds[1] == doctest::Approx(b).epsilon(1e-12));
        const std::vector<double> regularised = row.regularised(-1.0, 1.0, 0.005);
        CHECK(std::fabs(regularised[0] - a) < 0.01);
        CHECK(std::fabs(regularised[1] - b) < 0.01);
    };
    const double together = 2.25 * (1.0 - 1.0 / 6.75);
    ends_at(1.2, together, together);
    ends_at(0.99, 0.0, 0.5 / 0.18 * (1.0 - 1.0 / 6.75));  // less than 0.995: it breaks away, and a is held
}

TEST_CASE("where random clutches have reserve, regularised contacts go the same way") {
    RandomTrains random(25);
    int decided = 0, hold = 0, slip = 0;
    for (int n = 0; n < cases(1500); ++n) {
        const int shafts = random.pick(2, 4);
        ClutchedShafts row;
        for (int s = 0; s < shafts; ++s)
            row.add_shaft(random.spread(0.02, 0.2), random.coin(0.6) ? random.spread(0.2, 1.0) : 0.0,
                          random.uniform(-1.5, 1.5));
        double& most = *std::max_element(row.torque.begin(), row.torque.end());
        most = std::fabs(most) + 0.5;  // towards a stop
        row.after_jump = row.torque;
        if (random.coin()) {
            row.jump = random.uniform(0.02, 0.4);
            for (double& T : row.after_jump)
                if (random.coin()) T += random.uniform(-1.5, 1.5);
        }
        for (int s = 0; s + 1 < shafts; ++s) {
            const double T = random.spread(0.3, 1.2);
            row.add_clutch(T, random.coin(0.7) ? T * random.uniform(1.1, 2.0) : T);
        }
        CAPTURE(n);
        const Outcome out = run_of(row, -1.0, 0.5);
        if (out.open || out.slips_at_once) continue;
        // What is near to a decision goes another way with slightly other holding torques.
        const std::vector<double> coarse = row.regularised(-1.0, 0.5, 0.05, 1.01),
                                  fine = row.regularised(-1.0, 0.5, 0.0125, 0.99);
        double gap = 0.0, size = 1.0, error = 0.0;
        for (std::size_t s = 0; s < fine.size(); ++s) {
            gap = std::max(gap, std::fabs(fine[s] - coarse[s]));
            size = std::max(size, std::fabs(fine[s]));
            error = std::max(error, std::fabs(out.speeds[s] - fine[s]));
        }
        if (gap > 0.05 * size) continue;
        ++decided;
        CHECK(error < gap + 0.02 * size);
        for (std::size_t s = 0; s + 1 < fine.size(); ++s) ++(out.speeds[s] == out.speeds[s + 1] ? hold : slip);
    }
    MESSAGE(decided << " decided, " << hold << " hold, " << slip << " slip");
    CHECK(decided > share(300));
    CHECK(hold > share(350));
    CHECK(slip > share(80));
}

}  // namespace lostmotion::model

TEST_SUITE_END();
