// A drive or a train at one instant, explained and as a linear model.
#pragma once

#include "drives.hpp"
#include "interruption.hpp"
#include "lostmotion/analysis/train_explain.hpp"
#include "lostmotion/analysis/train_linear.hpp"
#include "lostmotion/simulation/reader.hpp"
#include "lostmotion/simulation/run.hpp"
#include "train.hpp"

namespace lostmotion::binding {

// --- drives ---

inline std::vector<double> values_of(const Reading& r) { return {r.value.begin(), r.value.end()}; }

// Readings; of each contact that the drive has: name, mode, speed, torque, capacity forward and backward.
inline nb::tuple explain_state(const Drive& drive, const Regime& r, const State& x, const Memory& m,
                               const InputNumbers& u) {
    nb::list contacts;
    for (const ContactName& c : contact_names) {
        const ContactReport report = explain_contact(drive, r, c.value, x, m, u);
        if (report.present)
            contacts.append(nb::make_tuple(c.text, report.mode, report.speed, report.torque, report.capacity_forward,
                                           report.capacity_backward));
    }
    return nb::make_tuple(values_of(Reader(drive, r, m)(x, u)), contacts);
}

// A form as a row: what it takes of the states, of the inputs, and its constant.
inline constexpr std::size_t row_width = n_states + n_inputs + 1;
inline void write_row(const LinearForm& form, const Memory& memory, double* to) {
    for (int c = 0; c < n_states; ++c) *to++ = form.c[c];
    for (int i = 0; i < n_inputs; ++i) *to++ = form.c[first_input + i];
    *to = constant_part(form, memory);
}

// States and inputs; rows of dx/dt, rows of torques by name, and the modes of the contacts.
inline nb::tuple linearize_state(const Drive&, const Regime& r, const State& x, const Memory& m,
                                 const InputNumbers& u) {
    const auto row = [&](const LinearForm& form) {
        auto data = std::make_unique<double[]>(row_width);
        write_row(form, m, data.get());
        return as_array(std::move(data), {row_width});
    };
    const std::vector<LinearForm> rates(r.rate.begin(), r.rate.end());
    nb::dict torques;
    torques[channel_names[ch_motor_torque].name] = row(r.source_torque);
    torques[channel_names[ch_output_torque].name] = row(r.output_torque);
    torques[channel_names[ch_input_torque].name] = row(r.input_torque);
    return nb::make_tuple(from_state(x), m.hysteresis_capacity, u,
                          column(rates, {row_width}, [&](const LinearForm& f, double* to) { write_row(f, m, to); }),
                          torques, std::array<int, n_contacts>{r.key.modes[0], r.key.modes[1], r.key.modes[2]});
}

// Runs to an instant: use(drive, regime, state, memory, inputs) there.
template <class Use>
nb::tuple at_instant(const SharedDrive& shared, const Signal& command, const Signal& load_torque, const StateNumbers& x,
                     double capacity, double time, Use&& use) {
    RunRequest request;
    request.duration = time;
    request.interrupted = poll_signals;
    DrivePoint p;
    {
        nb::gil_scoped_release release;
        p = reach(shared.drive, {command, load_torque}, {to_state(x), {capacity, 0.0}}, request);
    }
    check(p.status, p.time, p.contact);
    return use(shared.drive, p.regime, p.x, p.memory, p.input);
}

// --- trains ---

// Channels; of each contact: name, mode, speed, torque, capacity forward and backward, and by element the shares of
// these; of each motor: name, command from which on it turns forward, and backward.
inline nb::tuple explain_point(const model::Assembly& a, const TrainPoint& p) {
    nb::list contacts, motors;
    for (const TrainContactReport& c : explain_contacts(a, p)) {
        nb::list shares;
        for (const model::CapacityShare& s : c.shares) shares.append(nb::make_tuple(s.element, s.forward, s.backward));
        contacts.append(
            nb::make_tuple(c.name, c.mode, c.speed, c.torque, c.capacity_forward, c.capacity_backward, shares));
    }
    for (const MotorReport& m : explain_motors(a, p))
        motors.append(nb::make_tuple(m.name, m.command_forward, m.command_backward));
    return nb::make_tuple(p.values, contacts, motors);
}

// States and inputs at the point, by name; rows of the rates; names and rows of the outputs; the modes of the contacts
// by name.
inline nb::tuple linearize_point(const model::Assembly& a, const std::vector<TrainChannel>& channels,
                                 const TrainPoint& p) {
    const LinearRegime m = linearize(a, channels, p);
    const std::size_t width = m.states.size() + static_cast<std::size_t>(a.layout().inputs) + 1;
    const auto matrix = [&](const std::vector<std::vector<double>>& rows) {
        return column(rows, {width},
                      [](const std::vector<double>& r, double* to) { std::copy(r.begin(), r.end(), to); });
    };
    nb::dict states, inputs, modes;
    for (std::size_t k = 0; k < m.states.size(); ++k) states[m.states[k].c_str()] = m.state[k];
    const std::vector<std::string> names = model::input_names(a);
    for (std::size_t k = 0; k < names.size(); ++k) inputs[names[k].c_str()] = p.now.input[0][k];
    const model::Regime r = a.build(p.key);
    for (int c = 0; c < a.layout().contacts; ++c)
        modes[model::contact_name(a, c).c_str()] = r.at_rest[c] ? 0 : int(p.key.modes[c]);
    return nb::make_tuple(states, inputs, matrix(m.rate), m.outputs, matrix(m.output), modes);
}

// Runs to an instant: use(run, point) there.
template <class Use>
nb::tuple at_instant_of_train(const TrainDescription& description, const std::vector<Signal>& inputs,
                              const Named& start, const Named& capacities, double time, Use&& use) {
    const TrainRun run(description.train);
    TrainOptions options;
    options.duration = time;
    options.interrupted = poll_signals;
    TrainPoint point;
    TrainReport report;
    {
        nb::gil_scoped_release release;
        report = run.reach(inputs, {start, capacities}, options, point);
    }
    check_train_run(report, run.assembly());
    return use(run, point);
}

// Tuples are spelled out for the stub.
inline void bind_instants(nb::module_& m) {
    m.def(
        "explain_at",
        [](const SharedDrive& d, const Signal& command, const Signal& load, const StateNumbers& x, double capacity,
           double time) { return at_instant(d, command, load, x, capacity, time, explain_state); },
        "drive"_a, "command"_a, "load_torque"_a, "state"_a, "hysteresis_capacity"_a, "time"_a,
        nb::sig("def explain_at(drive: Drive, command: Signal, load_torque: Signal, state: "
                "collections.abc.Sequence[float], hysteresis_capacity: float, time: float) -> "
                "tuple[list[float], list[tuple[str, int, float, float, float, float]]]"));
    m.def(
        "linearize_at",
        [](const SharedDrive& d, const Signal& command, const Signal& load, const StateNumbers& x, double capacity,
           double time) { return at_instant(d, command, load, x, capacity, time, linearize_state); },
        "drive"_a, "command"_a, "load_torque"_a, "state"_a, "hysteresis_capacity"_a, "time"_a,
        nb::sig("def linearize_at(drive: Drive, command: Signal, load_torque: Signal, state: "
                "collections.abc.Sequence[float], hysteresis_capacity: float, time: float) -> "
                "tuple[list[float], float, list[float], numpy.typing.NDArray[numpy.float64], "
                "dict[str, numpy.typing.NDArray[numpy.float64]], list[int]]"));
    m.def(
        "explain_train_at",
        [](const TrainDescription& t, const std::vector<Signal>& inputs, const Named& start, const Named& capacities,
           double time) {
            return at_instant_of_train(
                t, inputs, start, capacities, time,
                [](const TrainRun& run, const TrainPoint& p) { return explain_point(run.assembly(), p); });
        },
        "train"_a, "inputs"_a, "start"_a, "hysteresis_capacities"_a, "time"_a,
        nb::sig("def explain_train_at(train: Train, inputs: collections.abc.Sequence[Signal], start: "
                "collections.abc.Mapping[str, float], hysteresis_capacities: collections.abc.Mapping[str, float], "
                "time: float) -> tuple[list[float], list[tuple[typing.Any, ...]], list[tuple[str, float, float]]]"));
    m.def(
        "linearize_train_at",
        [](const TrainDescription& t, const std::vector<Signal>& inputs, const Named& start, const Named& capacities,
           double time) {
            return at_instant_of_train(t, inputs, start, capacities, time,
                                       [](const TrainRun& run, const TrainPoint& p) {
                                           return linearize_point(run.assembly(), run.channels(), p);
                                       });
        },
        "train"_a, "inputs"_a, "start"_a, "hysteresis_capacities"_a, "time"_a,
        nb::sig("def linearize_train_at(train: Train, inputs: collections.abc.Sequence[Signal], start: "
                "collections.abc.Mapping[str, float], hysteresis_capacities: collections.abc.Mapping[str, float], "
                "time: float) -> tuple[typing.Any, ...]"));
}

}  // namespace lostmotion::binding
