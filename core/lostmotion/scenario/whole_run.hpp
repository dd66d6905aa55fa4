// A scenario in one go: samples of all variables, switchings, energies and the end.
#pragma once

#include <algorithm>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "simulation.hpp"

namespace lostmotion {

struct WholeRunOptions {
    bool energy = true;                   // of the exact solver
    std::size_t max_switchings = 100000;  // kept; all are counted
    bool (*interrupted)(void*) = nullptr;
    void* interrupted_context = nullptr;
};

struct WholeRun {
    Status status = Status::done;
    std::string error;
    double time = 0.0;  // [s] reached
    std::size_t samples = 0;
    std::vector<Variable> variables;
    std::vector<double> values;  // one variable after the other
    std::vector<std::string> energies, end_states;
    std::vector<double> energy, end_state;  // [J], SI
    std::vector<std::string> switching_columns;
    std::vector<double> switchings;  // one switching after the other
    std::size_t switching_count = 0;
    double left_data_at = std::numeric_limits<double>::infinity();  // [s]
};

namespace whole_run {

inline TrainOptions options_of(const Scenario& s, const WholeRunOptions& given, std::vector<double>& control) {
    TrainOptions o;
    o.duration = s.duration;
    o.sample_interval = s.sample_interval;
    o.samples = s.samples();
    o.energy = given.energy;
    o.max_switchings = given.max_switchings;
    o.interrupted = given.interrupted;
    o.interrupted_context = given.interrupted_context;
    o.control = s.control;
    if (s.control.present()) {
        control.assign(s.control.axes.size() * static_cast<std::size_t>(s.control.signals()) * o.samples, 0.0);
        o.control_out = control.data();
    }
    return o;
}

void add(std::vector<std::string>& names, std::vector<double>& values, const std::string& name, double value);

// Signals of the controllers into the rows of the variables. A motor with a winding shows the torque of its currents,
// in the place of the straight lines that the mechanics were driven by.
void add_signals(const Scenario& s, const Variables& variables, const std::vector<double>& control, WholeRun& out);

// solve(run, signals, states, memory, options, samples): by one of the solvers.
template <class Solve>
WholeRun run(const Scenario& s, const WholeRunOptions& given, Solve&& solve) {
    const Variables variables(s);
    WholeRun out;
    out.samples = s.samples();
    out.variables = variables.all();
    out.values.assign(variables.size() * out.samples, 0.0);
    std::vector<double> control;
    const TrainOptions options = options_of(s, given, control);
    const TrainRun train(s.train);
    const model::Assembly& a = train.assembly();
    const auto [x, memory] = train.in_layout(train_start(a, s.start, s.hysteresis_capacities));
    const TrainReport r = solve(train, s.inputs, x, memory, options, out.values.data());
    out.status = r.status;
    out.time = r.time;
    out.error = error_text(r, a);
    if (r.message.empty()) {
        if (options.energy)
            for (const auto& [name, energy] : named_ledger(r, a)) add(out.energies, out.energy, name, energy);
        for (const auto& [name, value] : named_end(r, a)) add(out.end_states, out.end_state, name, value);
        const SwitchingTable table(a);
        out.switching_columns = table.columns();
        out.switchings.resize(r.switchings.size() * out.switching_columns.size());
        double* to = out.switchings.data();
        for (const TrainSwitching& w : r.switchings) to = table.write(w, to);
        out.switching_count = r.switching_count;
        out.left_data_at = r.left_data_at;
    }
    if (s.control.present()) add_signals(s, variables, control, out);
    for (std::size_t k = 0; k < out.samples; ++k) variables.derive(out.values.data(), out.samples, k);
    return out;
}

}  // namespace whole_run

// By the exact solver. The scenario has passed its check.
WholeRun run_whole(const Scenario& s, const WholeRunOptions& options = {});

}  // namespace lostmotion
