// Periodic motion by shooting on random drives.
#include <doctest/doctest.h>

#include <cstdio>

#include "drive_runs.hpp"
#include "lostmotion/analysis/drive_response.hpp"

using namespace lostmotion;

TEST_SUITE("periodic") {
    TEST_CASE("200 random drives: a motion that repeats to rounding, or an honest no") {
        RandomDrives random(20260102);
        int found = 0, refused = 0;
        double worst = 0.0;
        for (int n = 0; n < 200; ++n) {
            const Drive drive = random.drive();
            const double f = random.spread(0.5, 30.0), amplitude = random.spread(0.02, 1.0);
            if (drive.rigid() && drive.min_rigid_inertia() <= 0.0) continue;
            CAPTURE(n);
            const Signals signals{sine(amplitude, f), constant(0.0)};
            Workspace workspace(drive);
            ShootingOptions options;
            options.period = 1.0 / f;
            options.max_periods = 300;
            Shooting shooting(workspace, signals, options.period / 256.0, options);
            const PeriodicMotion motion = shooting.solve({});
            REQUIRE(motion.status == Status::done);
            if (!motion.converged) {
                CHECK(motion.residual > options.tolerance);
                CHECK(motion.periods >= options.max_periods);
                ++refused;
                continue;
            }
            ++found;
            CHECK(motion.residual <= 1e-10);
            worst = std::fmax(worst, motion.residual);
            // From there a plain run of three periods comes back to the same state.
            Start start{motion.start.x, motion.start.memory};
            const Samples s = run(drive, signals, 3.0 * options.period, options.period / 64.0, start);
            REQUIRE(s.report.status == Status::done);
            bool away = false;
            double size = 0.0;
            for (const Channel c : {ch_motor_torque, ch_motor_speed, ch_load_speed, ch_twist}) {
                size = c == ch_load_speed ? size / drive.gearbox.ratio : 0.0;  // a load may be at rest but for rounding
                for (std::size_t k = 0; k < s.count; ++k) size = std::fmax(size, std::fabs(s(c, k)));
                for (std::size_t k = 0; k + 64 < s.count; ++k)
                    away = away || std::fabs(s(c, k + 64) - s(c, k)) > 1e-6 * size;
            }
            CHECK(!away);
        }
        std::printf("periodic: %d found, largest residual %.1e, %d without\n", found, worst, refused);
        CHECK(found >= 180);
    }
}
