#include "whole_run.hpp"

namespace lostmotion::whole_run {

void add(std::vector<std::string>& names, std::vector<double>& values, const std::string& name, double value) {
    names.push_back(name);
    values.push_back(value);
}

void add_signals(const Scenario& s, const Variables& variables, const std::vector<double>& control, WholeRun& out) {
    const std::size_t n = out.samples, signals = static_cast<std::size_t>(s.control.signals());
    const auto recorded = [&](std::size_t axis, std::size_t signal) {
        return control.data() + (axis * signals + signal) * n;
    };
    double* to = out.values.data() + variables.first_shown() * n;
    for (const Variables::Shown& shown : variables.shown())
        to = std::copy_n(recorded(static_cast<std::size_t>(shown.axis), static_cast<std::size_t>(shown.signal)), n, to);
    for (std::size_t a = 0; a < s.control.axes.size(); ++a) {
        const ControlledAxis& axis = s.control.axes[a];
        if (!axis.law.field_orientation) continue;
        const int place = variables.place(model::motor_torque_of(s.train, static_cast<std::size_t>(axis.motor)));
        const std::size_t first = control::n_axis_signals;
        const double *i_d = recorded(a, first + control::direct_current),
                     *i_q = recorded(a, first + control::quadrature_current);
        for (std::size_t k = 0; k < n; ++k)
            out.values[static_cast<std::size_t>(place) * n + k] =
                axis.law.field_orientation->winding.torque(i_d[k], i_q[k]);
    }
}

}  // namespace lostmotion::whole_run

namespace lostmotion {

WholeRun run_whole(const Scenario& s, const WholeRunOptions& options) {
    return whole_run::run(s, options,
                          [](const TrainRun& run, const std::vector<Signal>& signals, const std::vector<double>& x,
                             const std::vector<double>& memory, const TrainOptions& o,
                             double* out) { return run.run_exactly(signals, x, memory, o, out); });
}

}  // namespace lostmotion
