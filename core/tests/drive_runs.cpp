// What solves drives, for all tests: it takes long to compile.
#include "properties.hpp"

namespace lostmotion {

Samples run(const Drive& drive, const Signals& signals, double duration, double interval, const Start& start,
            double adaptive_tolerance) {
    Samples s;
    RunOptions options;
    options.duration = duration;
    options.sample_interval = interval;
    options.samples = s.count = static_cast<std::size_t>(std::floor(duration / interval * (1.0 + 1e-12))) + 1;
    s.data.resize(n_channels * s.count);
    s.report = adaptive_tolerance > 0.0
                   ? run_adaptive(drive, signals, start, options, adaptive_tolerance, s.data.data())
                   : run_exact(drive, signals, start, options, s.data.data());
    return s;
}

Splitting split_run(const Drive& drive, const Signals& signals, double duration, double at) {
    Splitting out;
    const double interval = duration / 200.0;
    const Samples whole = run(drive, signals, duration, interval);
    out.status = whole.report.status;
    out.time = whole.report.time;
    if (out.status != Status::done) return out;
    const SwitchedDrive system(drive);
    ExactSolver<SwitchedDrive> solver(system, signals, interval, drive.balanced_scale());
    Observer<SwitchedDrive> nothing;
    out.split = solver.begin(0.0, {}, {});
    if (out.split == Status::done) out.split = solver.advance(at, nothing);
    if (out.split == Status::done) out.split = solver.inputs_changed();
    if (out.split == Status::done) out.split = solver.advance(duration, nothing);
    if (out.split != Status::done) return out;
    out.gap = difference_at_end(drive, whole, solver.state());
    if (out.gap > 1e-10) {
        const Samples other = run(drive, perturbed(signals), duration, interval);
        out.amplification = other.report.status == Status::done ? difference_at_end(drive, whole, other.report.x) : 1.0;
    }
    return out;
}

}  // namespace lostmotion
