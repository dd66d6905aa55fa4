// Periodic motion by shooting on random drives.
#include <doctest/doctest.h>

#include <cstdio>

#include "drive_runs.hpp"
#include "lostmotion/analysis/respond.hpp"

namespace lostmotion::test {

TEST_SUITE("periodic") {
    TEST_CASE("200 random drives: a motion that repeats to rounding, or an honest no") {
        RandomDrives random(20260102);
        int found = 0, refused = 0;
        double worst = 0.0;
        for (int n = 0; n < 200; ++n) {
            const Drive drive = random.drive();
            const double f = random.spread(0.5, 30.0), amplitude = random.spread(0.02, 1.0);
            if (drive.jams()) continue;
            CAPTURE(n);
            const Signals signals{sine(amplitude, f), constant(0.0)};
            const double period = 1.0 / f;
            ResponseSpec spec;
            spec.samples = 256;
            spec.max_periods = 300;
            const ResponseTable motion =
                respond_train(TrainRun(train_of(drive)), {{{signals.begin(), signals.end()}, period, {}}}, spec, 1,
                              [](std::size_t) { return true; });
            REQUIRE(motion.error[0] == "");
            if (motion.converged[0] == 0.0) {
                CHECK(motion.residual[0] > spec.tolerance);
                CHECK(motion.periods[0] >= spec.max_periods);
                ++refused;
                continue;
            }
            ++found;
            CHECK(motion.residual[0] <= 1e-10);
            worst = std::fmax(worst, motion.residual[0]);
            // From there a plain run of three periods comes back to the same state.
            Start start;
            for (std::size_t k = 0; k < motion.components.size(); ++k) {
                for (int q = 0; q < n_states; ++q)
                    if (motion.components[k] == quantity_names[q]) start.x[q] = motion.start[k];
                if (motion.components[k] == "gearbox_hysteresis_capacity") start.hysteresis_capacity = motion.start[k];
            }
            const Samples s = run(drive, signals, 3.0 * period, period / 64.0, start);
            REQUIRE(s.report.status == Status::done);
            bool away = false;
            double size = 0.0;
            for (const Quantity c : {motor_torque, motor_speed, load_speed, twist}) {
                size = c == load_speed ? size / drive.gearbox.ratio : 0.0;  // a load may be at rest but for rounding
                for (std::size_t k = 0; k < s.samples; ++k) size = std::fmax(size, std::fabs(s(c, k)));
                for (std::size_t k = 0; k + 64 < s.samples; ++k)
                    away = away || std::fabs(s(c, k + 64) - s(c, k)) > 1e-6 * size;
            }
            CHECK(!away);
        }
        std::printf("periodic: %d found, largest residual %.1e, %d without\n", found, worst, refused);
        CHECK(found >= 180);
    }
}

}  // namespace lostmotion::test
