// Whole runs, one and many, with the GIL released.
#pragma once

#include <numeric>

#include "control.hpp"
#include "drives.hpp"
#include "interruption.hpp"
#include "lostmotion/analysis/batch.hpp"

namespace lostmotion::binding {

// The names of the columns are those of switching_columns().
inline Array switching_table(const RunReport& report) {
    const auto& columns = switching_columns();
    return column(report.switchings, {columns.size()}, [&](const Switching& s, double* to) {
        for (const SwitchingColumn& c : columns) *to++ = c.value(s);
    });
}

inline std::vector<double> ledger_values(const EnergyLedger& e) {
    std::vector<double> values;
    for (const EnergyEntry& entry : energy_entries) values.push_back(entry.of(e));
    return values;
}

// What every run is asked for.
inline RunOptions to_record(double duration, double interval, std::size_t samples, bool energy) {
    RunOptions options;
    options.duration = duration;
    options.sample_interval = interval;
    options.samples = samples;
    options.energy = energy;
    return options;
}

inline nb::tuple run(SharedDrive& shared, const Signal& command, const Signal& load_torque, const StateNumbers& x,
                     double capacity, double duration, double interval, std::size_t samples, bool energy,
                     double tolerance, std::size_t max_switchings, const BoundControl& bound) {
    auto data = std::make_unique_for_overwrite<double[]>(n_channels * samples);
    RunOptions options = to_record(duration, interval, samples, energy);
    options.control = control_of(bound);
    auto signals = control_room(options);
    options.max_switchings = max_switchings;
    options.interrupted = poll_signals;
    const Signals inputs{command, load_torque};
    const Start start{to_state(x), {capacity, 0.0}};
    RunReport report;
    {
        nb::gil_scoped_release release;
        if (tolerance > 0.0) {
            report = run_adaptive(shared.drive, inputs, start, options, tolerance, data.get());
        } else {
            std::unique_ptr<Workspace> workspace = shared.take();
            report = run_exact(*workspace, inputs, start, options, data.get());
            shared.give_back(std::move(workspace));
        }
    }
    raise_again(bound);
    check(report.status, report.time, report.contact);
    return nb::make_tuple(as_array(std::move(data), {n_channels, samples}), switching_table(report),
                          report.switching_count, ledger_values(report.energy), from_state(report.x),
                          report.memory.hysteresis_capacity, report.left_data_at, report.steps,
                          as_array(std::move(signals), control_shape(options)));
}

// Of each run the text of its error, empty if it has none; switchings; energy, entry by entry; and the samples, or what
// is kept of them.
inline nb::tuple run_many(SharedDrive& drive, const Signal& command, const Signal& load_torque, const StateNumbers& x,
                          double capacity, const std::vector<int>& fields, const Values& values, double duration,
                          double interval, std::size_t samples, bool energy, const std::vector<int>& channels,
                          const std::vector<std::pair<std::size_t, int>>& kept, unsigned threads,
                          const nb::object& progress) {
    const std::size_t runs = values.shape(0);
    RunOptions options = to_record(duration, interval, samples, energy);
    options.channels = channels;
    BatchInput in{{drive.drive, Signals{command, load_torque}, {to_state(x), {capacity, 0.0}}},
                  options,
                  fields,
                  {values.data(), runs * fields.size()},
                  runs,
                  {}};
    for (const auto& [channel, how] : kept) in.kept.push_back({channel, static_cast<Reduction>(how)});
    std::vector<std::size_t> shape{runs, kept.size()};
    if (kept.empty()) shape = {runs, channels.size(), samples};
    const std::size_t size = std::accumulate(shape.begin(), shape.end(), std::size_t{1}, std::multiplies<>());
    auto data = std::make_unique_for_overwrite<double[]>(size);
    std::vector<BatchRow> rows;
    Watch watch(progress);
    {
        nb::gil_scoped_release release;
        rows = run_batch(drive, in, data.get(), threads, std::ref(watch));
    }
    watch.check();
    std::vector<std::string> errors;
    for (const BatchRow& r : rows) errors.push_back(status_text(r.status, r.time, r.contact));
    return nb::make_tuple(as_array(std::move(data), shape), errors,
                          numbers(rows, [](const BatchRow& r) { return r.switchings; }),
                          column(rows, {energy_entries.size()}, [](const BatchRow& r, double* to) {
                              for (const EnergyEntry& entry : energy_entries) *to++ = entry.of(r.energy);
                          }));
}

// A reduction of each row.
inline Array reduce_rows(int how, const Values& values) {
    const std::size_t rows = values.shape(0), n = values.shape(1);
    auto data = std::make_unique_for_overwrite<double[]>(rows);
    for (std::size_t k = 0; k < rows; ++k) data[k] = reduce(static_cast<Reduction>(how), values.data() + k * n, n);
    return as_array(std::move(data), {rows});
}

// Tuples are spelled out for the stub.
inline void bind_runs(nb::module_& m) {
    m.def("run", &run, "drive"_a, "command"_a, "load_torque"_a, "state"_a, "hysteresis_capacity"_a, "duration"_a,
          "interval"_a, "samples"_a, "energy"_a, "tolerance"_a, "max_switchings"_a, "control"_a,
          nb::sig("def run(drive: Drive, command: Signal, load_torque: Signal, state: "
                  "collections.abc.Sequence[float], hysteresis_capacity: float, duration: float, interval: float, "
                  "samples: int, energy: bool, tolerance: float, max_switchings: int, control: tuple[float, "
                  "collections.abc.Sequence[tuple[Axis, int, int, int, int]]]) -> "
                  "tuple[numpy.typing.NDArray[numpy.float64], numpy.typing.NDArray[numpy.float64], "
                  "int, list[float], list[float], float, float, int, numpy.typing.NDArray[numpy.float64]]"));
    m.def("run_batch", &run_many, "drive"_a, "command"_a, "load_torque"_a, "state"_a, "hysteresis_capacity"_a,
          "fields"_a, "values"_a, "duration"_a, "interval"_a, "samples"_a, "energy"_a, "channels"_a, "kept"_a,
          "threads"_a, "progress"_a = nb::none(),
          nb::sig("def run_batch(drive: Drive, command: Signal, load_torque: Signal, state: "
                  "collections.abc.Sequence[float], hysteresis_capacity: float, fields: "
                  "collections.abc.Sequence[int], values: numpy.typing.NDArray[numpy.float64], duration: float, "
                  "interval: float, samples: int, energy: bool, channels: collections.abc.Sequence[int], kept: "
                  "collections.abc.Sequence[tuple[int, int]], threads: int, "
                  "progress: collections.abc.Callable[[int], None] | None = None) -> "
                  "tuple[numpy.typing.NDArray[numpy.float64], list[str], numpy.typing.NDArray[numpy.float64], "
                  "numpy.typing.NDArray[numpy.float64]]"));
    m.def("reduce_rows", &reduce_rows, "how"_a, "values"_a,
          nb::sig("def reduce_rows(how: int, values: numpy.typing.NDArray[numpy.float64]) -> "
                  "numpy.typing.NDArray[numpy.float64]"));
}

}  // namespace lostmotion::binding
