// Exact against adaptive solver on random drives: two methods that share nothing but the regimes.
#include <doctest/doctest.h>

#include <cstdio>

#include "drive_runs.hpp"

namespace lostmotion::test {

namespace {

// Largest difference of the five states at the samples, in units of each state's largest magnitude (or a millionth of
// its rated size, if it hardly moves).
double difference(const Drive& drive, const Samples& a, const Samples& b) {
    double worst = 0.0;
    for (int state = 0; state < n_states; ++state) {
        const auto c = static_cast<Quantity>(state);
        double size = 1e-6 * drive.rated_scale()[state], gap = 0.0;
        for (std::size_t k = 0; k < a.samples; ++k) {
            size = std::fmax(size, std::fabs(a(c, k)));
            gap = std::fmax(gap, std::fabs(a(c, k) - b(c, k)));
        }
        worst = std::fmax(worst, gap / size);
    }
    return worst;
}

}  // namespace

TEST_SUITE("differential") {
    // The adaptive solver is run at two tolerances. How far its two results lie apart shows how much this motion
    // amplifies errors (a turning point missed by a hair sets the hysteresis anew): the exact result must lie as near
    // to the finer one as that explains. Most motions are well conditioned; their gap must be small outright.
    TEST_CASE("exact and adaptive solver agree on random drives") {
        constexpr double duration = 0.5;
        const int drives = cases(700);
        RandomDrives random(20260101);
        int compared = 0, refused = 0;
        double worst_energy = 0.0;
        std::vector<double> gaps;
        for (int n = 0; n < drives; ++n) {
            Drive drive = random.drive();
            const Signals signals = random.signals(drive, duration);
            if (n % 7 == 0) drive.motor.armature_voltage_constant = 1.0;  // no back-e.m.f., as a current loop makes it
            if (drive.jams()) {
                ++refused;
                continue;
            }
            CAPTURE(n);
            const Samples exact = run(drive, signals, duration, 5e-3);
            REQUIRE_MESSAGE(exact.report.status == Status::done, "status ", static_cast<int>(exact.report.status),
                            " at ", exact.report.time);
            const Samples coarse = run(drive, signals, duration, 5e-3, {}, 1e-8);
            const Samples fine = run(drive, signals, duration, 5e-3, {}, 1e-11);
            REQUIRE(fine.report.status == Status::done);
            const double spread = difference(drive, coarse, fine), gap = difference(drive, exact, fine);
            CHECK_MESSAGE(gap <= 2.0 * spread + 1e-9, "gap ", gap, ", spread ", spread);
            gaps.push_back(gap);
            const double balance = std::fabs(exact.report.residual()) / std::fmax(1e-300, exact.report.turned_over);
            CHECK_MESSAGE(balance <= 1e-9, "energy balance ", balance);
            worst_energy = std::fmax(worst_energy, balance);
            ++compared;
        }
        CHECK(compared >= share(500));
        std::sort(gaps.begin(), gaps.end());
        CHECK(gaps[gaps.size() * 95 / 100] < 1e-7);
        std::printf("differential: %d drives (%d jamming ones refused), median gap %.1e, largest %.1e, energy %.1e\n",
                    compared, refused, gaps[gaps.size() / 2], gaps.back(), worst_energy);
    }
}

}  // namespace lostmotion::test
