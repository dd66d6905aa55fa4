// What solves drives.
#include "lostmotion/simulation/drive_recorder.hpp"
#include "lostmotion/simulation/hybrid.hpp"

namespace lostmotion {

template class ExactSolver<SwitchedDrive>;
template class SimulationOf<SwitchedDrive>;

namespace {

// What a run has ended with, by either solver.
template <class Solver>
void note_end(RunReport& report, const Solver& solver) {
    report.time = solver.time();
    report.contact = solver.stopped_at();
    report.x = solver.state();
    report.memory = solver.memory();
    report.switching_count = solver.switchings();
}

}  // namespace

RunReport run_exact(Workspace& workspace, const Signals& signals, const Start& start, const RunOptions& options,
                    double* out) {
    RunReport report;
    const Drive& drive = workspace.drive;
    ExactSolver<SwitchedDrive> solver(workspace.system, with_ramps(signals, options.control, only_motor),
                                      options.sample_interval, drive.balanced_scale(), &workspace.cache);
    Recorder recorder(drive, options, out, report);
    recorder.begin(start.x);
    report.status = run_recorded(solver, start, options, recorder,
                                 [&](const auto& laws) { return closed_loop_of(drive, options.control, laws); });
    recorder.end(solver.state());
    note_end(report, solver);
    report.steps = solver.event_checks();
    return report;
}

RunReport run_exact(const Drive& drive, const Signals& signals, const Start& start, const RunOptions& options,
                    double* out) {
    Workspace workspace(drive);
    return run_exact(workspace, signals, start, options, out);
}

RunReport run_adaptive(const Drive& drive, const Signals& signals, const Start& start, const RunOptions& options,
                       double relative_tolerance, double* out) {
    RunReport report;
    report.left_data_at = std::numeric_limits<double>::infinity();
    const SwitchedDrive system(drive);
    using Solver = AdaptiveSolver<SwitchedDrive>;
    Solver solver(system, with_ramps(signals, options.control, only_motor), relative_tolerance, drive.rated_scale());
    AdaptiveRecorder recorder(drive, solver, options, out, report);
    report.status = run_recorded(solver, start, options, recorder,
                                 [&](const auto& laws) { return closed_loop_of(drive, options.control, laws); });
    note_end(report, solver);
    report.steps = solver.steps();
    return report;
}

Simulation::Simulation(const Drive& drive, double step, const Control& control, const InputSines& sines)
    : OwnDrive(drive), SimulationOf(own_system, own_drive.balanced_scale(), step, SwitchedDrive::Dims::inputs, sines) {
    if (control.present())
        close_loop(control, [&](const auto& laws) { return closed_loop_of(own_drive, control, laws); });
}

DrivePoint reach(const Drive& drive, const Signals& signals, const Start& start, const RunRequest& request) {
    const SwitchedDrive system(drive);
    ExactSolver<SwitchedDrive> solver(system, with_ramps(signals, request.control, only_motor), request.sample_interval,
                                      drive.balanced_scale());
    Observer<SwitchedDrive> nothing;
    DrivePoint point;
    point.status = run_recorded(solver, start, request, nothing,
                                [&](const auto& laws) { return closed_loop_of(drive, request.control, laws); });
    point.time = solver.time();
    point.contact = solver.stopped_at();
    if (point.status != Status::done) return point;
    point.regime = solver.regime();
    point.x = solver.state();
    point.memory = solver.memory();
    point.input = inputs_at_end(solver, signals, request.control);
    return point;
}

}  // namespace lostmotion
