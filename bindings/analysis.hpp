// Linear models, explanations.
#pragma once

#include "drives.hpp"
#include "interruption.hpp"
#include "lostmotion/analysis/explain.hpp"
#include "lostmotion/simulation/run.hpp"

namespace lostmotion::binding {

// A form as a row: what it takes of the states, of the inputs, and its constant.
inline constexpr std::size_t row_width = n_states + n_inputs + 1;
inline void write_row(const LinearForm& form, const Memory& memory, double* to) {
    for (int c = 0; c < n_states; ++c) *to++ = form.c[c];
    for (int i = 0; i < n_inputs; ++i) *to++ = form.c[first_input + i];
    *to = constant_part(form, memory);
}

// Equations of the regime that a state is in: rows of dx/dt, rows of torques by name, and the modes of the contacts.
inline nb::tuple linearization(const SharedDrive& shared, const StateNumbers& x, double capacity, const InputNumbers& u,
                               const InputNumbers& slope) {
    Signals signals = ramped_inputs<DriveDims>();
    for (int i = 0; i < n_inputs; ++i) signals[i].breakpoints[0] = {0.0, u[i], slope[i]};
    const SwitchedDrive system(shared.drive);
    ExactSolver<SwitchedDrive> solver(system, signals, 1e-3, shared.drive.balanced_scale());
    check(solver.begin(0.0, to_state(x), {capacity, 0.0}), 0.0, input_contact);
    const Regime& r = solver.regime();
    const auto row = [&](const LinearForm& form) {
        auto data = std::make_unique<double[]>(row_width);
        write_row(form, solver.memory(), data.get());
        return as_array(std::move(data), {row_width});
    };
    const std::vector<LinearForm> rates(r.rate.begin(), r.rate.end());
    nb::dict torques;
    torques[channel_names[ch_motor_torque].name] = row(r.source_torque);
    torques[channel_names[ch_output_torque].name] = row(r.output_torque);
    torques[channel_names[ch_input_torque].name] = row(r.input_torque);
    return nb::make_tuple(
        column(rates, {row_width}, [&](const LinearForm& f, double* to) { write_row(f, solver.memory(), to); }),
        torques, std::array<int, n_contacts>{r.key.modes[0], r.key.modes[1], r.key.modes[2]});
}

inline std::vector<double> values_of(const Reading& r) { return {r.value.begin(), r.value.end()}; }

// Of each contact that the drive has: name, mode, speed, torque, capacity forward and backward.
inline nb::list explain_state(const Drive& drive, const Regime& r, const State& x, const Memory& m,
                              const InputNumbers& u) {
    nb::list out;
    for (const ContactName& c : contact_names) {
        const ContactReport report = explain_contact(drive, r, c.value, x, m, u);
        if (report.present)
            out.append(nb::make_tuple(c.text, report.mode, report.speed, report.torque, report.capacity_forward,
                                      report.capacity_backward));
    }
    return out;
}

// Runs to an instant and reports on it: readings and contacts.
inline nb::tuple explain_at(const SharedDrive& shared, const Signal& command, const Signal& load_torque,
                            const StateNumbers& x, double capacity, double time) {
    const Drive& drive = shared.drive;
    const Signals signals{command, load_torque};
    const SwitchedDrive system(drive);
    ExactSolver<SwitchedDrive> solver(system, signals, 1e-3, drive.balanced_scale());
    solver.interrupted = poll_signals;
    RunReport report;
    RunOptions options;
    options.max_switchings = 0;
    options.energy = false;
    Recorder recorder(drive, options, nullptr, report);
    Status status = solver.begin(0.0, to_state(x), {capacity, 0.0});
    if (status == Status::done && time > 0.0) {
        nb::gil_scoped_release release;
        status = solver.advance(time, recorder);
    }
    check(status, solver.time(), solver.stopped_at());
    InputState<DriveDims> input(signals, solver.basis());
    input.anchor(time);
    const auto u = input.values();
    return nb::make_tuple(values_of(Reader(drive, solver.regime(), solver.memory())(solver.state(), u)),
                          explain_state(drive, solver.regime(), solver.state(), solver.memory(), u));
}

// Tuples are spelled out for the stub.
inline void bind_analysis(nb::module_& m) {
    m.def("linearization", &linearization, "drive"_a, "state"_a, "hysteresis_capacity"_a, "inputs"_a, "input_rates"_a,
          nb::sig("def linearization(drive: Drive, state: collections.abc.Sequence[float], hysteresis_capacity: "
                  "float, inputs: collections.abc.Sequence[float], input_rates: collections.abc.Sequence[float]) -> "
                  "tuple[numpy.typing.NDArray[numpy.float64], dict[str, numpy.typing.NDArray[numpy.float64]], "
                  "list[int]]"));
    m.def("explain_at", &explain_at, "drive"_a, "command"_a, "load_torque"_a, "state"_a, "hysteresis_capacity"_a,
          "time"_a,
          nb::sig("def explain_at(drive: Drive, command: Signal, load_torque: Signal, state: "
                  "collections.abc.Sequence[float], hysteresis_capacity: float, time: float) -> "
                  "tuple[list[float], list[tuple[str, int, float, float, float, float]]]"));
}

}  // namespace lostmotion::binding
