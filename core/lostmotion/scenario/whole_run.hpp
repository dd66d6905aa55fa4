// A scenario in one go: samples of all variables, switchings, energies and the end.
#pragma once

#include <algorithm>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "../simulation/run.hpp"
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

template <class Options>
Options options_of(const Scenario& s, const WholeRunOptions& given, std::vector<double>& control) {
    Options o;
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

// solve(drive, signals, start, options, samples): by one of the solvers.
template <class Solve>
void of_drive(const Scenario& s, const WholeRunOptions& given, std::vector<double>& control, WholeRun& out,
              Solve&& solve) {
    const RunOptions options = options_of<RunOptions>(s, given, control);
    Start start;
    std::copy(s.start.begin(), s.start.end(), start.x.begin());
    start.memory.hysteresis_capacity = s.hysteresis_capacities[0];
    const Signals signals{s.inputs[0], s.inputs[1]};
    const RunReport r = solve(s.drive, signals, start, options, out.values.data());
    out.status = r.status;
    out.time = r.time;
    out.error = status_text(r.status, r.time, r.contact);
    if (options.energy)
        for (const EnergyEntry& e : energy_entries) add(out.energies, out.energy, e.name, e.of(r.energy));
    for (const StateName& n : state_names) add(out.end_states, out.end_state, n.name, r.x[n.value]);
    add(out.end_states, out.end_state, "hysteresis_capacity", r.memory.hysteresis_capacity);
    for (const SwitchingColumn& c : switching_columns()) out.switching_columns.push_back(c.name);
    for (const Switching& w : r.switchings)
        for (const SwitchingColumn& c : switching_columns()) out.switchings.push_back(c.value(w));
    out.switching_count = r.switching_count;
    out.left_data_at = r.left_data_at;
}

// solve(run, signals, states, memory, options, samples)
template <class Solve>
void of_train(const Scenario& s, const WholeRunOptions& given, std::vector<double>& control, WholeRun& out,
              Solve&& solve) {
    const TrainOptions options = options_of<TrainOptions>(s, given, control);
    const TrainRun run(s.train);
    const model::Assembly& a = run.assembly();
    const auto [x, memory] = run.in_layout(train_start(a, s.start, s.hysteresis_capacities));
    const TrainReport r = solve(run, s.inputs, x, memory, options, out.values.data());
    out.status = r.status;
    out.time = r.time;
    out.error = error_text(r, a);
    if (!r.message.empty()) return;
    if (options.energy)
        for (const auto& [name, energy] : named_ledger(r, a)) add(out.energies, out.energy, name, energy);
    for (const auto& [name, value] : named_end(r, a)) add(out.end_states, out.end_state, name, value);
    const int contacts = a.layout().contacts;
    out.switching_columns = {"instant", "cause"};
    for (const char* when : {"_before", "_after"})
        for (int c = 0; c < contacts; ++c) out.switching_columns.push_back(model::contact_name(a, c) + when);
    out.switchings.resize(r.switchings.size() * out.switching_columns.size());
    double* to = out.switchings.data();
    for (const TrainSwitching& w : r.switchings) to = write_switching(w, contacts, to);
    out.switching_count = r.switching_count;
    out.left_data_at = r.left_data_at;
}

// Signals of the controllers into the rows of the variables. A motor with a winding shows the torque of its currents,
// in the place of the straight lines that the mechanics were driven by.
void add_signals(const Scenario& s, const Variables& variables, const std::vector<double>& control, WholeRun& out);

template <class OfDrive, class OfTrain>
WholeRun run(const Scenario& s, const WholeRunOptions& options, OfDrive&& solve_drive, OfTrain&& solve_train) {
    const Variables variables(s);
    WholeRun out;
    out.samples = s.samples();
    out.variables = variables.all();
    out.values.assign(variables.size() * out.samples, 0.0);
    std::vector<double> control;
    if constexpr (holds(Kernel::drive))
        if (s.is_of_drive()) of_drive(s, options, control, out, solve_drive);
    if constexpr (holds_trains)
        if (!s.is_of_drive()) of_train(s, options, control, out, solve_train);
    if (s.control.present()) add_signals(s, variables, control, out);
    for (std::size_t k = 0; k < out.samples; ++k) variables.derive(out.values.data(), out.samples, k);
    return out;
}

}  // namespace whole_run

// By the exact solver. The scenario has passed its check.
WholeRun run_whole(const Scenario& s, const WholeRunOptions& options = {});

}  // namespace lostmotion
