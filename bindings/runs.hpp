// What Python calls: runs of all kinds, with the GIL released.
#pragma once

#include <functional>
#include <memory>
#include <mutex>
#include <numeric>

#include "convert.hpp"
#include "lostmotion/analysis/batch.hpp"
#include "lostmotion/analysis/explain.hpp"
#include "lostmotion/simulation/stepping.hpp"

namespace lostmotion::binding {

// A drive and what runs of it have left for the next ones. Each run takes a workspace for itself.
class SharedDrive : public WorkspacePool {
 public:
    const Drive drive;
    explicit SharedDrive(const Drive& d) : drive(d) {}

    std::unique_ptr<Workspace> take() override {
        const std::lock_guard<std::mutex> hold(mutex_);
        if (idle_.empty()) return std::make_unique<Workspace>(drive);
        std::unique_ptr<Workspace> w = std::move(idle_.back());
        idle_.pop_back();
        return w;
    }
    void give_back(std::unique_ptr<Workspace> w) override {
        const std::lock_guard<std::mutex> hold(mutex_);
        idle_.push_back(std::move(w));
    }

 private:
    std::mutex mutex_;
    std::vector<std::unique_ptr<Workspace>> idle_;
};

// What every run is asked for.
inline RunOptions to_record(double duration, double interval, std::size_t samples, bool energy) {
    RunOptions options;
    options.duration = duration;
    options.sample_interval = interval;
    options.samples = samples;
    options.energy = energy;
    return options;
}

inline nb::tuple run(SharedDrive& shared, const Signals& signals, const std::array<double, n_states>& x,
                     double capacity, double duration, double interval, std::size_t samples, bool energy,
                     double tolerance, std::size_t max_switchings) {
    auto data = std::make_unique_for_overwrite<double[]>(n_channels * samples);
    RunOptions options = to_record(duration, interval, samples, energy);
    options.max_switchings = max_switchings;
    options.interrupted = poll_signals;
    const Start start{to_state(x), {capacity, 0.0}};
    RunReport report;
    {
        nb::gil_scoped_release release;
        if (tolerance > 0.0) {
            report = run_adaptive(shared.drive, signals, start, options, tolerance, data.get());
        } else {
            std::unique_ptr<Workspace> workspace = shared.take();
            report = run_exact(*workspace, signals, start, options, data.get());
            shared.give_back(std::move(workspace));
        }
    }
    check(report.status, report.time, report.contact);
    return nb::make_tuple(as_array(std::move(data), {n_channels, samples}), switching_table(report),
                          report.switching_count, ledger_values(report.energy), from_state(report.x),
                          report.memory.hysteresis_capacity, report.left_data_at, report.steps);
}

using Point = std::tuple<Signal, Signal, double, std::array<double, n_states>, double>;

using Values = nb::ndarray<const double, nb::ndim<2>, nb::c_contig, nb::device::cpu>;

inline nb::tuple run_many(SharedDrive& drive, const Signals& signals, const std::array<double, n_states>& x,
                          double capacity, const std::vector<int>& fields, const Values& values, double duration,
                          double interval, std::size_t samples, bool energy, const std::vector<int>& channels,
                          const std::vector<std::pair<std::size_t, int>>& kept, unsigned threads,
                          const nb::object& progress) {
    const std::size_t runs = values.shape(0);
    RunOptions options = to_record(duration, interval, samples, energy);
    options.channels = channels;
    BatchInput in{drive.drive, signals, {to_state(x), {capacity, 0.0}},
                  options,     fields,  {values.data(), runs * fields.size()},
                  runs,        {}};
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
    constexpr std::size_t width = 5 + ledger_size;
    auto totals = std::make_unique<double[]>(runs * width);
    for (std::size_t k = 0; k < runs; ++k) {
        const BatchRow& r = rows[k];
        const std::array<double, 5> head{static_cast<double>(r.status), static_cast<double>(r.contact), r.time,
                                         r.switchings, r.left_data_at};
        const auto energies = ledger_values(r.energy);
        std::copy(energies.begin(), energies.end(), std::copy(head.begin(), head.end(), &totals[k * width]));
    }
    return nb::make_tuple(as_array(std::move(data), shape), as_array(std::move(totals), {runs, width}));
}

// A reduction of each row.
inline Array reduce_rows(int how, const Values& values) {
    const std::size_t rows = values.shape(0), n = values.shape(1);
    auto data = std::make_unique_for_overwrite<double[]>(rows);
    for (std::size_t k = 0; k < rows; ++k) data[k] = reduce(static_cast<Reduction>(how), values.data() + k * n, n);
    return as_array(std::move(data), {rows});
}

inline nb::dict respond_to(SharedDrive& drive, const std::vector<Point>& asked, const ResponseSpec& spec,
                           unsigned threads, const nb::object& progress) {
    std::vector<ResponsePoint> points;
    for (const auto& [command, load_torque, period, x, capacity] : asked)
        points.push_back({Signals{command, load_torque}, period, {to_state(x), {capacity, 0.0}}});
    std::vector<ResponseResult> results;
    Watch watch(progress);
    {
        nb::gil_scoped_release release;
        results = respond_all(drive, points, spec, threads, std::ref(watch));
    }
    watch.check();
    const auto harmonics = static_cast<std::size_t>(spec.harmonics) + 1;
    nb::dict out;
    const auto number = [&](const char* name, auto&& value) {
        out[name] =
            column(results, {}, [&](const ResponseResult& r, double* to) { *to = static_cast<double>(value(r)); });
    };
    number("status", [](const ResponseResult& r) { return static_cast<int>(r.motion.status); });
    number("time", [](const ResponseResult& r) { return r.motion.time; });
    number("contact", [](const ResponseResult& r) { return static_cast<int>(r.motion.contact); });
    number("converged", [](const ResponseResult& r) { return r.motion.converged; });
    number("smooth", [](const ResponseResult& r) { return r.motion.smooth; });
    number("periods", [](const ResponseResult& r) { return r.motion.periods; });
    number("newton_steps", [](const ResponseResult& r) { return r.motion.newton_steps; });
    number("residual", [](const ResponseResult& r) { return r.motion.residual; });
    number("drift", [](const ResponseResult& r) { return r.motion.drift; });
    number("hysteresis_capacity", [](const ResponseResult& r) { return r.motion.start.memory.hysteresis_capacity; });
    number("motor_power", [](const ResponseResult& r) { return r.motor_power; });
    number("load_power", [](const ResponseResult& r) { return r.load_power; });
    number("gear_loss", [](const ResponseResult& r) { return r.gear_loss; });
    out["start"] = column(results, {n_states}, [](const ResponseResult& r, double* to) {
        std::copy_n(r.motion.start.x.begin(), n_states, to);
    });
    out["jacobian"] = column(results, {n_components, n_components}, [](const ResponseResult& r, double* to) {
        for (const Components& row : r.motion.jacobian.row) to = std::copy(row.begin(), row.end(), to);
    });
    out["harmonics"] = column(results, {n_channels, harmonics, 2}, [](const ResponseResult& r, double* to) {
        std::copy(r.harmonic.begin(), r.harmonic.end(), to);
    });
    out["mean_square"] = column(results, {n_channels}, [](const ResponseResult& r, double* to) {
        std::copy(r.mean_square.begin(), r.mean_square.end(), to);
    });
    if (spec.keep_table)
        out["table"] = column(results, {n_channels, spec.samples}, [](const ResponseResult& r, double* to) {
            std::copy(r.table.begin(), r.table.end(), to);
        });
    return out;
}

// Equations of the regime that a state is in: A, B, constant rates, and C, D, constants of M_D, T_2, T_1 and the
// friction of the input contact.
inline nb::tuple linearization(const Drive& drive, const std::array<double, n_states>& x, double capacity,
                               const std::array<double, n_inputs>& u, const std::array<double, n_inputs>& slope) {
    Signals signals = ramped_inputs<DriveDims>();
    for (int i = 0; i < n_inputs; ++i) signals[i].knots[0] = {0.0, u[i], slope[i]};
    const SwitchedDrive system(drive);
    ExactSolver<SwitchedDrive> solver(system, signals, 1e-3, drive.balanced_scale());
    check(solver.begin(0.0, to_state(x), {capacity, 0.0}), 0.0, input_contact);
    const Regime& r = solver.regime();
    const auto rows = [&](const std::vector<const LinearForm*>& forms) {
        constexpr std::size_t width = n_states + n_inputs + 1;
        auto data = std::make_unique<double[]>(forms.size() * width);
        for (std::size_t k = 0; k < forms.size(); ++k) {
            for (int c = 0; c < n_states; ++c) data[k * width + c] = forms[k]->c[c];
            for (int i = 0; i < n_inputs; ++i) data[k * width + n_states + i] = forms[k]->c[first_input + i];
            data[k * width + width - 1] = constant_part(*forms[k], solver.memory());
        }
        return as_array(std::move(data), {forms.size(), width});
    };
    std::vector<const LinearForm*> rates;
    for (const LinearForm& f : r.rate) rates.push_back(&f);
    return nb::make_tuple(rows(rates), rows({&r.source_torque, &r.output_torque, &r.input_torque}),
                          std::array<int, n_contacts>{r.key.modes[0], r.key.modes[1], r.key.modes[2]});
}

inline nb::list explain_state(const Drive& drive, const Regime& r, const State& x, const Memory& m,
                              const std::array<double, n_inputs>& u) {
    nb::list out;
    for (int c = 0; c < n_contacts; ++c) {
        const ContactReport report = explain_contact(drive, r, static_cast<Contact>(c), x, m, u);
        if (report.present)
            out.append(nb::make_tuple(c, report.mode, report.speed, report.torque, report.capacity_forward,
                                      report.capacity_backward));
    }
    return out;
}

// Runs to an instant and reports on it: readings, contacts, output torque.
inline nb::tuple explain_at(const Drive& drive, const Signals& signals, const std::array<double, n_states>& x,
                            double capacity, double time) {
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
    const Reading reading = Reader(drive, solver.regime(), solver.memory())(solver.state(), u);
    return nb::make_tuple(std::vector<double>(reading.value.begin(), reading.value.end()),
                          explain_state(drive, solver.regime(), solver.state(), solver.memory(), u));
}

inline void advance(Simulation& s, double interval, double c0, double c1, double m0, double m1) {
    s.set_interrupt(poll_signals, nullptr);
    Status status;
    {
        nb::gil_scoped_release release;
        status = s.advance(interval, c0, c1, m0, m1);
    }
    if (status != Status::done) check(status, s.time(), s.stopped_at());
}

}  // namespace lostmotion::binding
