// Why a scenario stands still at an instant: what holds each contact, and the commands from which on the motors turn.
#pragma once

#include <algorithm>
#include <string>
#include <vector>

#include "../analysis/train_explain.hpp"
#include "../simulation/run.hpp"
#include "scenario.hpp"

namespace lostmotion {

struct NamedContact : ContactReport {
    std::string name;
};
struct Explanation {
    std::string error;  // why the motion does not reach the instant, or empty
    std::vector<NamedContact> contacts;
    std::vector<MotorReport> motors;  // of a drive: what moves its load
};

namespace explanation {

inline Explanation of_drive(const Scenario& s, double time) {
    Explanation out;
    const Signals signals{s.inputs[0], s.inputs[1]};
    RunOptions options;
    options.duration = time;
    options.sample_interval = s.sample_interval;
    options.control = s.control;
    StartOf<DriveDims> start;
    std::copy(s.start.begin(), s.start.end(), start.x.begin());
    start.memory.hysteresis_capacity = s.hysteresis_capacities[0];
    const SwitchedDrive system(s.drive);
    ExactSolver<SwitchedDrive> solver(system, with_ramps(signals, s.control, only_motor), s.sample_interval,
                                      s.drive.balanced_scale());
    NoObserver nothing;
    const Status status = run_recorded(solver, start, options, nothing,
                                       [&](const auto& laws) { return closed_loop_of(s.drive, s.control, laws); });
    out.error = status_text(status, solver.time(), solver.stopped_at());
    if (!out.error.empty()) return out;
    const Regime& r = solver.regime();
    const auto u = inputs_at_end(solver, signals, s.control);
    for (const ContactName& c : contact_names) {
        const ContactReport report = explain_contact(s.drive, r, c.value, solver.state(), solver.memory(), u);
        if (report.present) out.contacts.push_back({report, c.text});
    }
    const double T_2 = evaluate(r.output_torque, solver.state(), solver.memory(), u), M_Z = u[1];
    out.motors.push_back({"motor", smallest_command(s.drive, T_2, M_Z, +1), smallest_command(s.drive, T_2, M_Z, -1)});
    return out;
}

inline Explanation of_train(const Scenario& s, double time) {
    Explanation out;
    TrainOptions options;
    options.duration = time;
    options.sample_interval = s.sample_interval;
    options.control = s.control;
    const TrainRun run(s.train);
    const model::Assembly& a = run.assembly();
    TrainPoint point;
    out.error = error_text(run.reach(s.inputs, train_start(a, s.start, s.hysteresis_capacities), options, point), a);
    if (!out.error.empty()) return out;
    for (const TrainContactReport& c : explain_contacts(a, point)) out.contacts.push_back({c, c.name});
    out.motors = explain_motors(a, point);
    return out;
}

}  // namespace explanation

// The scenario has passed its check; time is not negative.
inline Explanation explain(const Scenario& s, double time) {
    if constexpr (holds(Kernel::drive))
        if (s.is_of_drive()) return explanation::of_drive(s, time);
    if constexpr (holds_trains)
        if (!s.is_of_drive()) return explanation::of_train(s, time);
    return {};
}

}  // namespace lostmotion
