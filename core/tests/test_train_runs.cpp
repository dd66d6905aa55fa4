// Whole runs of trains: the exact solver against the drive's, the adaptive solver and the ledger.
#include <doctest/doctest.h>

#include "lostmotion/simulation/run.hpp"
#include "lostmotion/simulation/train_run.hpp"
#include "random_trains.hpp"

TEST_SUITE_BEGIN("train_runs");

namespace lostmotion::model {
namespace {

// With names of their own for all elements.
Train named(Train t) {
    const auto name = [](auto& elements, const std::string& kind) {
        for (std::size_t k = 0; k < elements.size(); ++k)
            if (elements[k].name.empty() || elements.size() > 1) elements[k].name = kind + std::to_string(k);
    };
    name(t.motors, "motor");
    name(t.gears, "gear");
    name(t.brakes, "brake");
    name(t.couplings, "coupling");
    if (t.shafts[0].name.empty()) name(t.shafts, "shaft");
    return t;
}

struct Recorded {
    lostmotion::TrainRun run;
    TrainReport report;
    std::vector<double> out;
    std::size_t samples;

    Recorded(const Train& train, const std::vector<Signal>& inputs, double duration, double interval,
             double tolerance = 0.0)
        : run(named(train)) {
        REQUIRE(run.error() == "");
        TrainOptions options;
        options.duration = duration;
        options.sample_interval = interval;
        samples = options.samples = static_cast<std::size_t>(duration / interval + 1.5);
        options.tolerance = tolerance;
        out.resize(run.channels().size() * samples);
        report = run.run(inputs, {}, {}, options, out.data());
    }
    const double* channel(const std::string& name) const {
        for (std::size_t c = 0; c < run.channels().size(); ++c)
            if (run.channels()[c].name == name) return &out[c * samples];
        FAIL("no channel " << name);
        return nullptr;
    }
};

}  // namespace

TEST_CASE("the classic drive as a train has the same samples, to the last bit") {
    RandomDrives random(31);
    int compared = 0;
    for (int n = 0; n < 200; ++n) {
        const Drive d = random.drive();
        const Signals signals = random.signals(d, 0.3);
        RunOptions options;
        options.duration = 0.3;
        options.samples = 301;
        options.energy = false;
        std::vector<double> expected(n_channels * options.samples);
        const RunReport classic = run_exact(d, signals, {}, options, expected.data());
        if (classic.status != Status::done) continue;
        const Recorded train(train_of(d), {signals[0], signals[1]}, 0.3, 1e-3);
        CAPTURE(n);
        REQUIRE(train.report.status == Status::done);
        ++compared;
        const auto same = [&](Channel classic_channel, const char* name) {
            const double *a = &expected[classic_channel * options.samples], *b = train.channel(name);
            CAPTURE(name);
            CHECK(std::equal(a, a + options.samples, b));
        };
        same(ch_motor_speed, "motor_speed");
        same(ch_load_speed, "load_speed");
        same(ch_load_angle, "load_angle");
        same(ch_output_torque, "gearbox_output_torque");
        same(ch_motor_torque, "motor_torque");
        if (!d.rigid()) same(ch_twist, "gearbox_twist");
    }
    CHECK(compared > 150);
}

TEST_CASE("the energies of random trains balance") {
    RandomTrains random(32);
    int done = 0;
    double worst = 0.0;
    for (int n = 0; n < 300; ++n) {
        const Train train = random.train(random.pick(2, 6), true);
        const Assembly a(train);
        const std::vector<Signal> inputs = random.signals(a, 2.0);
        const Recorded r(train, inputs, 2.0, 1e-2);
        CAPTURE(n);
        CHECK(!r.report.too_many_guards);
        if (r.report.status != Status::done) continue;
        ++done;
        worst = std::max(worst, std::fabs(r.report.residual()) / std::max(1e-9, r.report.turned_over));
    }
    MESSAGE(done << " trains, worst residual " << worst << " of what is turned over");
    CHECK(done > 280);
    CHECK(worst < 1e-9);
}

// Two tolerances of the adaptive solver tell how well it knows the motion: a run counts if it agrees with itself.
TEST_CASE("exact and adaptive solver agree on random trains") {
    RandomTrains random(33);
    int compared = 0, differing = 0;
    for (int n = 0; n < 90; ++n) {
        const Train train = random.train(random.pick(2, 6), true);
        const Assembly a(train);
        const std::vector<Signal> inputs = random.signals(a, 1.0);
        const Recorded exact(train, inputs, 1.0, 1e-2), coarse(train, inputs, 1.0, 1e-2, 1e-8),
            fine(train, inputs, 1.0, 1e-2, 1e-10);
        if (exact.report.status != Status::done || fine.report.status != Status::done) continue;
        const auto gap = [](const Recorded& p, const Recorded& q) {
            double worst = 0.0;
            for (std::size_t c = 0; c < p.run.channels().size(); ++c) {
                if (p.run.channels()[c].kind != TrainChannel::state) continue;
                double size = 1e-6, most = 0.0;
                for (std::size_t k = 0; k < p.samples; ++k) {
                    size = std::max(size, std::fabs(p.out[c * p.samples + k]));
                    most = std::max(most, std::fabs(p.out[c * p.samples + k] - q.out[c * p.samples + k]));
                }
                worst = std::max(worst, most / size);
            }
            return worst;
        };
        const double own = gap(coarse, fine);
        if (own > 1e-5) continue;
        ++compared;
        CAPTURE(n);
        if (gap(exact, fine) > std::max(1e-6, 2.0 * own)) {
            ++differing;
            MESSAGE("train " << n << ": " << gap(exact, fine) << ", adaptive with itself " << own);
        }
    }
    MESSAGE(compared << " trains compared");
    CHECK(compared > 40);
    CHECK(differing == 0);
}

}  // namespace lostmotion::model

TEST_SUITE_END();
