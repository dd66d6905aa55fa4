// Times the paper's drive under a servo cascade: current and speed loop every 125 us, position every 1 ms, encoder on
// the motor, voltages in steps. Prints one line a case: name, ticks, switchings, event checks, best time [ms] of 1 s,
// the same of the drive alone under the same voltages on average. With a number: makes the run that often and prints
// nothing.
#include <cstdio>
#include <cstdlib>

#include "lostmotion/simulation/run.hpp"
#include "paper_run.hpp"

using namespace lostmotion;

namespace {

// resolution: of the encoder [rad], 0 for none. amplitude: of the sine of 1 Hz that the load follows [rad].
Control cascade(const Drive& drive, double resolution, double amplitude) {
    Control c;
    c.tick = 125e-6;
    ControlledAxis axis;
    control::Axis& a = axis.law;
    a.mode = control::Axis::position_mode;
    a.ratio = drive.gearbox.ratio;
    a.delay.ticks = 1;
    a.speed_sensor.encoder.resolution = resolution;
    a.position_schedule.every = 8;
    a.position_loop.gain = 10.0;
    a.position_loop.speed_feedforward = 1.0;
    a.speed_loop.gain = a.speed_loop.reference_gain = 8.29e-3;
    a.speed_loop.integral_gain = 0.1266;
    a.speed_loop.torque_limit = 1.5;
    const double k_N = drive.motor.armature_voltage_constant, tau = drive.motor.electrical_time_constant;
    control::CurrentLoop& loop = a.current_loop.emplace();
    loop.gain = 1.0 / 3.0 / (k_N * (1.0 - std::exp(-c.tick / tau)));
    loop.integral_gain = 1.0 / 3.0 / k_N;
    loop.back_emf = (k_N - 1.0) / (k_N * drive.motor.rated_speed);
    loop.rated_torque = drive.motor.rated_torque;
    a.reference.sines.push_back({amplitude, 1.0, 0.0});
    c.axes.push_back(axis);
    return c;
}

}  // namespace

int main(int argc, char** argv) {
    const PaperRun paper;
    RunOptions options;
    options.duration = 1.0;
    options.sample_interval = 1e-3;
    options.samples = 0;
    options.energy = false;
    options.max_switchings = 0;
    Workspace workspace(paper.drive);
    const auto run = [&] { return run_exact(workspace, Signals{}, {}, options, nullptr); };
    if (argc > 1) {
        options.control = cascade(paper.drive, 2.0 * std::numbers::pi / 8192.0, 0.2);
        for (int k = std::atoi(argv[1]); k > 0; --k) run();
        return 0;
    }
    struct Case {
        const char* name;
        double resolution, amplitude;
    };
    const double lines = 2.0 * std::numbers::pi / 8192.0;
    for (const Case& c : {Case{"standing still", 0.0, 0.0}, Case{"sine of 0.2 rad", 0.0, 0.2},
                          Case{"sine of 0.2 rad, encoder of 2048 lines", lines, 0.2}}) {
        options.control = cascade(paper.drive, c.resolution, c.amplitude);
        const RunReport report = run();
        if (report.status != Status::done) return 1;
        const double ms = best_ms(50, run);
        std::printf("%s|8000|%zu|%ld|%.6f\n", c.name, report.switching_count, report.steps, ms);
    }
    return 0;
}
