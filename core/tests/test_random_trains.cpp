// Random trains by the hundreds: both solvers, the laws that every run obeys, and derivatives.
#include <doctest/doctest.h>

#include "random_sensitivities.hpp"

TEST_SUITE_BEGIN("random_trains");

namespace lostmotion::model {

TEST_CASE("exact and adaptive solver agree on random trains of all elements") {
    RandomTrains random(33);
    SolverTally tally;
    for (int n = 0; n < cases(1000); ++n) {
        CAPTURE(n);
        compare_solvers(random, 6, 0.5, tally);
    }
    MESSAGE(tally.compared << " trains compared, largest difference " << tally.worst << "; " << tally.undecided
                           << " that the adaptive solver does not settle, " << tally.forked << " with two motions, "
                           << tally.outlasted << " that the adaptive solver follows for a time, " << tally.jammed
                           << " that jam");
    CHECK(tally.compared > share(990));
    CHECK(tally.wrong == 0);
    CHECK(tally.jammed == 0);
}

TEST_CASE("a freewheel begins to carry where all its torques are zero") {
    RandomTrains random(4615, false, true, true);
    const RandomRun r(random, 6, 1.0);
    const Recorded exact(r.train, r.inputs, 1.0, 0.02), fine(r.train, r.inputs, 1.0, 0.02, 1e-10);
    REQUIRE(exact.done());
    REQUIRE(fine.done());
    CHECK(difference(exact, fine) < 1e-6);
}

TEST_CASE("both solvers agree on trains with hysteresis beside contacts at rest, of values in wide ranges") {
    SolverTally tally;
    for (const unsigned seed : {35u, 41u, 42u}) {
        RandomTrains random(seed);
        for (int n = 0; n < cases(1000); ++n) {
            CAPTURE(seed);
            CAPTURE(n);
            const Train t = random.braked(random.pick(2, 4));
            compare_solvers({t, random.signals(Assembly(named(t)), 0.5)}, {}, 0.5, tally,
                            ("braked " + std::to_string(seed) + " " + std::to_string(n)).c_str());
        }
    }
    MESSAGE(tally.compared << " trains compared, largest difference " << tally.worst << "; " << tally.undecided
                           << " that the adaptive solver does not settle, " << tally.forked << " with two motions, "
                           << tally.outlasted << " that the adaptive solver follows for a time, " << tally.jammed
                           << " that jam");
    CHECK(tally.compared > share(2990));
    CHECK(tally.wrong == 0);
    CHECK(tally.jammed == 0);
}

TEST_CASE("both solvers agree on random trains whose mesh stiffness steps over the angle, and their energies balance") {
    SolverTally tally;
    LawTally laws;
    RandomTrains random(71, false, false, true), braked(72, false, false, true);
    for (int n = 0; n < cases(600); ++n) {
        CAPTURE(n);
        compare_solvers(random, 4, 0.5, tally, ("meshes 71 " + std::to_string(n)).c_str());
        check_laws(random, 4, 0.4, laws, ("meshes 71 " + std::to_string(n)).c_str());
        const Train t = braked.braked(braked.pick(2, 3));
        compare_solvers({t, braked.signals(Assembly(named(t)), 0.5)}, {}, 0.5, tally,
                        ("meshes 72 " + std::to_string(n)).c_str());
    }
    MESSAGE(tally.compared << " trains compared, largest difference " << tally.worst << "; " << tally.undecided
                           << " that the adaptive solver does not settle, " << tally.forked << " with two motions, "
                           << tally.outlasted << " that the adaptive solver follows for a time, " << tally.jammed
                           << " that jam; largest residual " << laws.residual);
    CHECK(tally.compared > share(1150));
    CHECK(tally.failed() == 0);
    CHECK(laws.failed() == 0);
}

struct BrakedTrain {
    Train train;
    std::vector<Signal> inputs;
};

// The braked train that a seed makes as the one of this number.
BrakedTrain braked_train(unsigned seed, int number) {
    RandomTrains random(seed);
    BrakedTrain made;
    for (int n = 0; n <= number; ++n) {
        made.train = named(random.braked(random.pick(2, 4)));
        made.inputs = random.signals(Assembly(made.train), 0.5);
    }
    return made;
}

// Train 1532 of seed 35. From 0.453 s on the brake on shaft 0 gives way to its command; gear and shaft 1 are at rest,
// and the torque between them is at the limit of shaft 1. At 0.457229 s the brake has come to the torque that it holds.
// It holds on, and the gear takes what goes beyond: shaft 1 turns from one limit to the other without a motion. Shaft 0
// breaks away where the gear has reached the capacity of its hysteresis, which follows from the inputs alone.
TEST_CASE("a brake at the torque that it holds does not break away while its neighbours can take more") {
    const BrakedTrain made = braked_train(35, 1532);
    const Train& train = made.train;
    const std::vector<Signal>& inputs = made.inputs;
    const Recorded resting(train, inputs, 0.455, 0.455 / 2.0);
    REQUIRE(resting.done());
    const auto last = [&](const char* name) { return resting.channel(name)[resting.samples - 1]; };
    REQUIRE(last("shaft0_speed") == 0.0);
    REQUIRE(last("shaft1_speed") == 0.0);
    const Gearbox& gear = train.gears[0].law;
    const double d = last("gear0_twist"), h = gear.hysteresis_capacity(d);
    const auto margin = [&](double t) {
        const double holds = train.shafts[0].friction.torque +
                             train.brakes[1].breakaway_torque * std::clamp(plain_value(inputs[6], t), 0.0, 1.0);
        return holds -
               (plain_value(inputs[0], t) - plain_value(inputs[1], t) - (gear.curve.torque(d) + h) / gear.ratio);
    };
    REQUIRE(train.brakes[1].shaft == 0);
    double low = 0.455, high = 0.46;
    REQUIRE(margin(low) > 0.0);
    REQUIRE(margin(high) < 0.0);
    for (int k = 0; k < 60; ++k) (margin(0.5 * (low + high)) > 0.0 ? low : high) = 0.5 * (low + high);
    for (const double tolerance : {0.0, 1e-12}) {
        CAPTURE(tolerance);
        const Recorded run(train, inputs, 0.46, 1e-6, tolerance);
        REQUIRE(run.done());
        const double* speed = run.channel("shaft0_speed");
        std::size_t first = static_cast<std::size_t>(0.455 / 1e-6);
        while (first < run.samples && speed[first] == 0.0) ++first;
        // The first sample after it; the brake comes to what it holds 4 us before.
        CHECK(std::fabs(1e-6 * static_cast<double>(first) - low) < 1.5e-6);
    }
}

// Train 20 of seed 36. From 0.400 s on a shaft creeps on against a gear whose hysteresis is used up: its speed dies out
// and never reaches zero. The adaptive solver turns it by its error, 5 ms later with a tenth of the tolerance.
TEST_CASE("a speed that dies out is followed for longer with a smaller tolerance, and never turns") {
    const BrakedTrain made = braked_train(36, 20);
    const auto run = [&](double tolerance) { return Recorded(made.train, made.inputs, 0.5, 0.01, tolerance); };
    const Recorded exact = run(0.0), fine = run(1e-10), finer = run(1e-12), finest = run(1e-13);
    REQUIRE(exact.done());
    CHECK(follow_for_longer(exact, {&fine, &finer, &finest}));
    CHECK_FALSE(follow_for_longer(fine, {&exact, &finer, &finest}));
    CHECK(parting(exact, finest) > 0.43);
    CHECK(exact.channel("shaft3_speed")[40] > 1e-4);
    CHECK(exact.channel("shaft3_speed")[42] > 1e-12);
    SolverTally tally;
    compare_solvers({made.train, made.inputs}, {}, 0.5, tally);
    CHECK(tally.outlasted == 1);
}

// Train 73 of seed 41. From 0.479357 s on shaft 0 moves on the gear under a torque of 1.5 N·m that rises by 1 N·m/s:
// its speed is proportional to 1 - cos and touches zero, where the hysteresis is set anew. The torques that cancel are
// a thousand times what is left of them, and so is their rounding in the speed.
TEST_CASE("a speed that touches zero is seen whatever the sample interval") {
    const BrakedTrain made = braked_train(41, 73);
    const Train& train = made.train;
    const std::vector<Signal>& inputs = made.inputs;
    const Recorded adaptive(train, inputs, 0.5, 0.5, 1e-13);
    REQUIRE(adaptive.done());
    for (const double samples : {1.0, 3.0, 7.0, 20.0, 50.0, 100.0, 1000.0}) {
        CAPTURE(samples);
        const Recorded run(train, inputs, 0.5, 0.5 / samples);
        REQUIRE(run.done());
        REQUIRE(run.report.switchings.size() == adaptive.report.switchings.size());
        for (std::size_t k = 0; k < run.report.switchings.size(); ++k)
            CHECK(std::fabs(run.report.switchings[k].time - adaptive.report.switchings[k].time) < 1e-6);
    }
}

TEST_CASE("the search for modes begins anew only rarely on random trains of all elements") {
    RandomTrains random(36);
    long switchings = 0, trials = 0, fallbacks = 0, runs = 0;
    for (int n = 0; n < cases(3000); ++n) {
        const RandomRun r(random, 6, 0.3);
        const Recorded run(r.train, r.inputs, 0.3, 0.1);
        if (!run.done()) continue;
        ++runs;
        switchings += static_cast<long>(run.report.switching_count);
        trials += run.report.searches.trials;
        fallbacks += run.report.searches.fallbacks;
    }
    MESSAGE(runs << " runs, " << switchings << " switchings, " << trials << " trials, " << fallbacks << " fallbacks");
    CHECK(runs > share(2990));
    CHECK(200 * fallbacks < switchings);
    CHECK(trials < 10 * switchings);
}

TEST_CASE("the laws that every run obeys hold on random trains of all elements") {
    RandomTrains random(34);
    LawTally tally;
    for (int n = 0; n < cases(1000); ++n) {
        CAPTURE(n);
        check_laws(random, 6, 0.4, tally);
    }
    MESSAGE(tally.runs << " trains; energies balance to " << tally.residual << " of what is turned over");
    CHECK(tally.runs > share(980));
    CHECK(tally.residual < 1e-9);
    CHECK(tally.gained == 0);
    CHECK(tally.mirrored > share(400));
    CHECK(tally.unlike_mirror == 0);
    CHECK(tally.unlike_sampled == 0);
    CHECK(tally.unlike_split == 0);
}

namespace {

SensitivityTally compare_random(unsigned seed, int trains, bool closed_loop) {
    SensitivityTally tally;
    for (int n = 0; n < trains; ++n) compare_one(seed + static_cast<unsigned>(n), closed_loop, tally);
    return tally;
}

}  // namespace

// A twist breaks away with an acceleration of zero, while a shaft at its limit ends the regime within 1e-16 s.
TEST_CASE("a run may be split before a break-away that another contact at its limit cuts short") {
    RandomTrains random(3);
    for (int n = 0; n < 389; ++n) {
        const RandomRun before(random, 6, 0.4);
        random.uniform(0.1, 0.9);
    }
    LawTally tally;
    check_laws(random, 6, 0.4, tally);
    CHECK(tally.runs == 1);
    CHECK(tally.failed() == 0);
}

TEST_CASE("derivatives of random trains are those of differences of their runs") {
    const SensitivityTally open = compare_random(5000, cases(200), false),
                           closed = compare_random(7000, cases(100), true);
    const long compared = open.compared + closed.compared, switchings = open.switchings + closed.switchings;
    const double worst = std::fmax(open.worst, closed.worst);
    MESSAGE(compared << " numbers compared, " << switchings << " switchings, largest difference " << worst);
    CHECK(open.failed_runs + closed.failed_runs == 0);
    CHECK(open.wrong + closed.wrong == 0);
    CHECK(open.ended + closed.ended < 10);
    CHECK(open.compared > share(10000));
    CHECK(closed.compared > share(5000));
}

}  // namespace lostmotion::model

TEST_SUITE_END();
