// The published drive, against the two end states that two unlike methods agree on.
#include <doctest/doctest.h>

#include "drive_runs.hpp"

namespace lostmotion::test {

namespace {

struct EndState {
    double amplitude, m_D, w_M, w, d, phi;
    // Half a unit of the last digit printed.
    double m_D_digit, w_M_digit, w_digit, d_digit, phi_digit;
};
constexpr EndState large{1.0275, 0.700518217, -114.514141, -1.28593174, 2.29187762e-3, 0.0627650372,
                         5e-10,  5e-7,        5e-9,        5e-12,       5e-11};
constexpr EndState small{0.025,   -6.296271e-5, 0.0,   6.2675017e-3, -1.83029358e-4, -5.9571e-5,
                         5.0e-12, 1e-300,       5e-11, 6e-13,        5e-10};

void check(const EndState& expected, const std::vector<double>& x, double slack) {
    CHECK(std::fabs(x[motor_torque] / 0.521 - expected.m_D) <= slack * expected.m_D_digit);
    CHECK(std::fabs(x[motor_speed] - expected.w_M) <= slack * expected.w_M_digit);
    CHECK(std::fabs(x[load_speed] - expected.w) <= slack * expected.w_digit);
    CHECK(std::fabs(x[twist] - expected.d) <= slack * expected.d_digit);
    CHECK(std::fabs(x[load_angle] - expected.phi) <= slack * expected.phi_digit);
}

}  // namespace

TEST_SUITE("paper") {
    // Within one unit of the last digit printed, since some are cut off and not rounded; the printed d of the small
    // amplitude, -1.83029358e-4, is off by 1.2 units: both solvers here give -1.8302935917e-4.
    TEST_CASE("exact solver reaches the published end states to all printed digits") {
        const Drive drive = paper_drive(plane_map(0.02, 0.04, 0.06));
        for (const EndState& e : {large, small}) {
            const Samples s = run(drive, {sine(e.amplitude, 1.0), Signal{}}, 2.0);
            REQUIRE(s.report.status == Status::done);
            check(e, s.report.x, 2.0);
        }
    }
    TEST_CASE("adaptive solver reaches them at a tight tolerance") {
        const Drive drive = paper_drive(plane_map(0.02, 0.04, 0.06));
        for (const EndState& e : {large, small}) {
            const Samples s = run(drive, {sine(e.amplitude, 1.0), Signal{}}, 2.0, 1e-3, {}, 1e-12);
            REQUIRE(s.report.status == Status::done);
            check(e, s.report.x, 2.0);
        }
    }
    TEST_CASE("sampling more finely or more coarsely changes nothing beyond rounding") {
        const Drive drive = paper_drive(plane_map(0.02, 0.04, 0.06));
        const Signals signals{sine(1.0275, 1.0), Signal{}};
        const Samples fine = run(drive, signals, 2.0, 1e-4), coarse = run(drive, signals, 2.0, 0.05);
        for (std::size_t k = 0; k < coarse.samples; ++k)
            for (const TrainChannel& c : fine.run.channels())
                // 1e-11 of the size: some hundred switchings, each located to rounding, lie between.
                CHECK(fine.channel(c.name)[500 * k] == doctest::Approx(coarse.channel(c.name)[k])
                                                           .epsilon(1e-11)
                                                           .scale(c.name == quantity_names[motor_speed] ? 300.0 : 1.0));
    }
}

}  // namespace lostmotion::test
