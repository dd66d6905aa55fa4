// Step by step: splitting, restoring, agreement with whole runs.
#include <doctest/doctest.h>

#include "drive_runs.hpp"

namespace lostmotion::test {
using doctest::Approx;

namespace {

double given(int k) { return 0.05 * std::sin(0.37 * k) + 0.02 * ((k / 40) % 2); }

}  // namespace

TEST_SUITE("simulation") {
    TEST_CASE("a restored simulation continues bit for bit") {
        RandomDrives random(21);
        for (int n = 0; n < 20; ++n) {
            const Drive drive = random.drive();
            if (drive.jams()) continue;
            Simulation a(drive, 1e-3);
            for (int k = 0; k < 137; ++k) REQUIRE(a.advance(1e-3, given(k), given(k + 1), 0.0, 0.0) == Status::done);
            Simulation b(drive, 1e-3);
            restore(b.train, a.train);
            for (int k = 137; k < 300; ++k) {
                REQUIRE(a.advance(1e-3, given(k), given(k + 1), 0.0, 0.0) == Status::done);
                REQUIRE(b.advance(1e-3, given(k), given(k + 1), 0.0, 0.0) == Status::done);
                CHECK(point(a.train).values == point(b.train).values);
            }
        }
    }
    TEST_CASE("splitting an interval changes nothing beyond rounding") {
        const Drive drive = paper_drive(plane_map(0.02, 0.04, 0.06));
        Simulation whole(drive, 0.01), split(drive, 0.01);
        for (int k = 0; k < 200; ++k) {
            const double a = given(k), b = given(k + 1);
            REQUIRE(whole.advance(0.01, a, b, 0.0, 0.0) == Status::done);
            const double cuts[] = {0.0, 0.1, 0.37, 0.375, 1.0};
            for (int j = 0; j < 4; ++j)
                REQUIRE(split.advance(0.01 * (cuts[j + 1] - cuts[j]), a + (b - a) * cuts[j], a + (b - a) * cuts[j + 1],
                                      0.0, 0.0) == Status::done);
            for (const Quantity c : {motor_torque, motor_speed, load_speed, twist, output_torque})
                CHECK(whole(c) == Approx(split(c)).epsilon(1e-8).scale(c == motor_speed ? 1.0 : 1e-2));
        }
    }
    TEST_CASE("stepping with ramped inputs equals one run with the same straight lines") {
        const Drive drive = paper_drive(plane_map(0.02, 0.04, 0.06));
        std::vector<Breakpoint> breakpoints;
        for (int k = 0; k < 100; ++k) breakpoints.push_back({0.01 * k, given(k), (given(k + 1) - given(k)) / 0.01});
        const Samples s = run(drive, {lines(breakpoints), Signal{}}, 1.0, 0.01);
        Simulation stepped(drive, 0.01);
        for (int k = 0; k < 100; ++k) REQUIRE(stepped.advance(0.01, given(k), given(k + 1), 0.0, 0.0) == Status::done);
        for (int k = 0; k < n_states; ++k)
            CHECK(point(stepped.train).now.x[k] == Approx(s.report.x[k]).epsilon(1e-9).scale(1e-3));
    }
    TEST_CASE("a step that fails leaves the state as it was") {
        Drive drive = paper_drive(plane_map(0.02, 0.04, 0.06));
        Simulation sim(drive, 1e-3);
        REQUIRE(sim.advance(1e-3, 0.1, 0.1, 0.0, 0.0) == Status::done);
        const model::Instant before = point(sim.train).now;
        CHECK(sim.advance(1.0, 1e9, 1e9, 0.0, 0.0) == Status::outside);
        CHECK(point(sim.train).now.time == before.time);
        CHECK(point(sim.train).now.x == before.x);
        CHECK(sim.advance(1e-3, 0.1, 0.1, 0.0, 0.0) == Status::done);
    }
}

}  // namespace lostmotion::test
