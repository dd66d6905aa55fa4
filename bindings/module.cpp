// Thin binding: builds core objects from Python values, runs them with the GIL released, hands arrays back.
#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>
#include <nanobind/stl/array.h>
#include <nanobind/stl/pair.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/tuple.h>
#include <nanobind/stl/vector.h>

#include <memory>
#include <mutex>

#include "lostmotion/batch.hpp"
#include "lostmotion/explain.hpp"
#include "lostmotion/response.hpp"
#include "lostmotion/run.hpp"
#include "lostmotion/simulation.hpp"

namespace nb = nanobind;
using namespace nb::literals;
using namespace lostmotion;

namespace {

using Vector = std::vector<double>;

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

bool poll_signals(void*) {
    nb::gil_scoped_acquire hold;
    return PyErr_CheckSignals() != 0;
}

const char* contact_name(Contact c) {
    return c == input_contact ? "input shaft" : c == twist_contact ? "twist of the gear" : "load bearing";
}

struct SolverError : std::runtime_error {
    using std::runtime_error::runtime_error;
};

// Why a run has no continuation.
std::string status_text(Status status, double time, Contact contact) {
    const std::string at = "at t = " + std::to_string(time) + " s";
    switch (status) {
        case Status::jammed:
            return "no combination of sticking and slipping contacts is consistent " + at +
                   ": the friction jams. Give the gearbox a compliance, or lower its losses.";
        case Status::outside:
            return "the state left the range that the loss map can be extended to " + at +
                   " (1000 times its data). The drive is unstable, or its data or inputs have a wrong unit.";
        case Status::zeno:
            return "switching instants of the contact '" + std::string(contact_name(contact)) + "' accumulate " + at +
                   ": infinitely many in finite time. The model ends here.";
        default: return "interrupted";
    }
}

// Turns a status into an exception; the signal's own exception is already set when a run was interrupted.
void check(Status status, double time, Contact contact) {
    if (status == Status::done) return;
    if (status == Status::interrupted) throw nb::python_error();
    throw SolverError(status_text(status, time, contact));
}

using Array = nb::ndarray<nb::numpy, double>;

// Hands data over to Python without a copy.
Array as_array(std::unique_ptr<double[]> data, const std::vector<std::size_t>& shape) {
    double* raw = data.release();
    nb::capsule owner(raw, [](void* p) noexcept { delete[] static_cast<double*>(p); });
    return Array(raw, shape.size(), shape.data(), owner);
}

State to_state(const std::array<double, n_states>& v) {
    State x{};
    std::copy(v.begin(), v.end(), x.begin());
    return x;
}
std::array<double, n_states> from_state(const State& x) {
    std::array<double, n_states> v;
    std::copy_n(x.begin(), n_states, v.begin());
    return v;
}

// Switching as numbers: time, kind, contact, contact modes before and after, T_2 before and after.
constexpr std::size_t switching_columns = 11;
Array switching_table(const RunReport& report) {
    const std::size_t n = report.switchings.size();
    auto data = std::make_unique<double[]>(n * switching_columns);
    for (std::size_t k = 0; k < n; ++k) {
        const Switching& s = report.switchings[k];
        double* row = &data[k * switching_columns];
        row[0] = s.time;
        row[1] = s.input_jump ? -1.0 : static_cast<double>(s.kind);
        row[2] = s.contact;
        for (int c = 0; c < n_contacts; ++c) {
            row[3 + c] = s.before.modes[c];
            row[6 + c] = s.after.modes[c];
        }
        row[9] = s.torque_before;
        row[10] = s.torque_after;
    }
    return as_array(std::move(data), {n, switching_columns});
}

// Flows, changes of the stored energies, residual, turned over; named by ENERGY in results.py.
constexpr std::size_t ledger_size = n_flows + 4;
std::array<double, ledger_size> ledger_values(const EnergyLedger& e) {
    std::array<double, ledger_size> values;
    auto to = std::copy(e.flow.begin(), e.flow.end(), values.begin());
    *to++ = e.kinetic_end - e.kinetic_begin;
    *to++ = e.elastic_end - e.elastic_begin;
    *to++ = e.residual();
    *to++ = e.turned_over;
    return values;
}

nb::tuple run(SharedDrive& shared, const Signals& signals, const std::array<double, n_states>& x, double capacity,
              double duration, double interval, std::size_t samples, bool energy, double tolerance,
              std::size_t max_switchings) {
    auto data = std::make_unique_for_overwrite<double[]>(n_channels * samples);
    RunOptions options;
    options.duration = duration;
    options.sample_interval = interval;
    options.samples = samples;
    options.energy = energy;
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

// Shape of one result and where its values lie.
template <class F>
nb::object column(const std::vector<ResponseResult>& results, std::vector<std::size_t> shape, F&& values) {
    std::size_t width = 1;
    for (const std::size_t n : shape) width *= n;
    shape.insert(shape.begin(), results.size());
    auto data = std::make_unique<double[]>(results.size() * width);
    for (std::size_t k = 0; k < results.size(); ++k) values(results[k], &data[k * width]);
    return nb::cast(as_array(std::move(data), shape));
}

// Polls for Ctrl-C and reports progress while other threads work.
class Watch {
 public:
    explicit Watch(const nb::object& progress) : progress_(progress) {}
    bool operator()(std::size_t done) {
        nb::gil_scoped_acquire hold;
        raised_ = raised_ || PyErr_CheckSignals() != 0;
        if (raised_) return false;
        if (!progress_.is_none()) progress_(done);
        return true;
    }
    void check() const {
        if (raised_) throw nb::python_error();
    }

 private:
    const nb::object& progress_;
    bool raised_ = false;
};

using Values = nb::ndarray<const double, nb::ndim<2>, nb::c_contig, nb::device::cpu>;

nb::tuple run_many(SharedDrive& drive, const Signals& signals, const std::array<double, n_states>& x, double capacity,
                   const std::vector<int>& fields, const Values& values, double duration, double interval,
                   std::size_t samples, bool energy, const std::vector<int>& channels, unsigned threads,
                   const nb::object& progress) {
    const std::size_t runs = values.shape(0);
    RunOptions options;
    options.duration = duration;
    options.sample_interval = interval;
    options.samples = samples;
    options.energy = energy;
    options.channels = channels;
    const BatchInput in{drive.drive, signals, {to_state(x), {capacity, 0.0}},
                        options,     fields,  {values.data(), runs * fields.size()},
                        runs};
    auto data = std::make_unique_for_overwrite<double[]>(runs * channels.size() * samples);
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
    return nb::make_tuple(as_array(std::move(data), {runs, channels.size(), samples}),
                          as_array(std::move(totals), {runs, width}));
}

nb::dict respond_to(SharedDrive& drive, const std::vector<Point>& asked, const ResponseSpec& spec, unsigned threads,
                    const nb::object& progress) {
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
nb::tuple linearization(const Drive& drive, const std::array<double, n_states>& x, double capacity,
                        const std::array<double, n_inputs>& u, const std::array<double, n_inputs>& slope) {
    Signals signals = ramped_inputs();
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

nb::list explain_state(const Drive& drive, const Regime& r, const State& x, const Memory& m,
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
nb::tuple explain_at(const Drive& drive, const Signals& signals, const std::array<double, n_states>& x, double capacity,
                     double time) {
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
    InputState input(signals, solver.basis());
    input.anchor(time);
    const auto u = input.values();
    const Reading reading = Reader(drive, solver.regime(), solver.memory())(solver.state(), u);
    return nb::make_tuple(std::vector<double>(reading.value.begin(), reading.value.end()),
                          explain_state(drive, solver.regime(), solver.state(), solver.memory(), u));
}

void advance(Simulation& s, double interval, double c0, double c1, double m0, double m1) {
    s.set_interrupt(poll_signals, nullptr);
    Status status;
    {
        nb::gil_scoped_release release;
        status = s.advance(interval, c0, c1, m0, m1);
    }
    if (status != Status::done) check(status, s.time(), s.stopped_at());
}

}  // namespace

NB_MODULE(CORE_MODULE, m) {
    nb::exception<SolverError>(m, "SolverError", PyExc_RuntimeError).attr("__doc__") =
        "The motion has no continuation; the message names time and contact.";

    nb::class_<Motor>(m, "Motor")
        .def(nb::init<>())
        .def_prop_rw(
            "torque_source", [](const Motor& s) { return s.kind == Motor::torque_source; },
            [](Motor& s, bool v) { s.kind = v ? Motor::torque_source : Motor::dc; })
        .def_rw("rotor_inertia", &Motor::rotor_inertia)
        .def_rw("friction_torque", &Motor::friction_torque)
        .def_rw("rated_torque", &Motor::rated_torque)
        .def_rw("rated_speed", &Motor::rated_speed)
        .def_rw("electrical_time_constant", &Motor::electrical_time_constant)
        .def_rw("armature_voltage_constant", &Motor::armature_voltage_constant)
        .def_rw("voltage_limit", &Motor::voltage_limit);
    nb::class_<Load>(m, "Load")
        .def(nb::init<>())
        .def_rw("inertia", &Load::inertia)
        .def_rw("viscous_friction", &Load::viscous_friction)
        .def_rw("friction_torque", &Load::friction_torque);
    nb::class_<TorsionCurve>(m, "TorsionCurve")
        .def(nb::init<Vector, Vector>(), "breaks"_a, "slopes"_a)
        .def("torque", &TorsionCurve::torque, "twist"_a)
        .def("energy", &TorsionCurve::energy, "twist"_a);
    nb::class_<LossMap>(m, "LossMap")
        .def(nb::init<Vector, Vector, Vector>(), "speeds"_a, "loads"_a, "values"_a)
        .def("__call__", &LossMap::operator(), "load"_a, "speed"_a);
    nb::class_<Gearbox>(m, "Gearbox")
        .def(nb::init<>())
        .def_rw("ratio", &Gearbox::ratio)
        .def_rw("inertia", &Gearbox::inertia)
        .def_rw("viscous_friction", &Gearbox::viscous_friction)
        .def_rw("hysteresis_efficiency", &Gearbox::hysteresis_efficiency)
        .def_rw("efficiency", &Gearbox::efficiency)
        .def_rw("rated_input_speed", &Gearbox::rated_input_speed)
        .def_rw("rated_output_torque", &Gearbox::rated_output_torque)
        .def(
            "set_torsion_curve",
            [](Gearbox& g, const TorsionCurve& c) {
                g.compliance = Gearbox::torsion_curve;
                g.curve = c;
            },
            "curve"_a)
        .def(
            "set_loss_map",
            [](Gearbox& g, const LossMap& map) {
                g.losses = Gearbox::loss_map;
                g.map = map;
            },
            "loss_map"_a);
    nb::class_<SharedDrive>(m, "Drive")
        .def(
            "__init__",
            [](SharedDrive* self, const Motor& motor, const Gearbox& gearbox, const Load& load) {
                new (self) SharedDrive(Drive{motor, gearbox, load});
            },
            "motor"_a, "gearbox"_a, "load"_a)
        .def("smallest_rigid_inertia", [](const SharedDrive& d) { return d.drive.smallest_rigid_inertia(); })
        .def(
            "smallest_command",
            [](const SharedDrive& d, double T_2, double M_Z, int s) { return smallest_command(d.drive, T_2, M_Z, s); },
            "output_torque"_a, "load_torque"_a, "direction"_a);

    nb::class_<Signal>(m, "Signal")
        .def(
            "__init__",
            [](Signal* self, const std::vector<std::array<double, 3>>& knots,
               const std::vector<std::array<double, 3>>& sines) {
                auto s = std::make_unique<Signal>();
                s->knots.clear();
                for (const auto& k : knots) s->knots.push_back({k[0], k[1], k[2]});
                for (const auto& a : sines) s->sines.push_back({a[0], a[1], a[2]});
                new (self) Signal(std::move(*s));
            },
            "knots"_a, "sines"_a);

    // Tuples are spelled out for the stub.
    m.def(
        "run",
        [](SharedDrive& drive, const Signal& command, const Signal& load_torque, const std::array<double, n_states>& x,
           double capacity, double duration, double interval, std::size_t samples, bool energy, double tolerance,
           std::size_t max_switchings) {
            return run(drive, Signals{command, load_torque}, x, capacity, duration, interval, samples, energy,
                       tolerance, max_switchings);
        },
        "drive"_a, "command"_a, "load_torque"_a, "state"_a, "hysteresis_capacity"_a, "duration"_a, "interval"_a,
        "samples"_a, "energy"_a, "tolerance"_a, "max_switchings"_a,
        nb::sig("def run(drive: Drive, command: Signal, load_torque: Signal, state: collections.abc.Sequence[float], "
                "hysteresis_capacity: float, duration: float, interval: float, samples: int, energy: bool, "
                "tolerance: float, max_switchings: int) -> tuple[numpy.typing.NDArray[numpy.float64], "
                "numpy.typing.NDArray[numpy.float64], "
                "int, list[float], list[float], float, float, int]"));
    m.def(
        "respond",
        [](SharedDrive& drive, const std::vector<Point>& points, std::size_t samples, int harmonics, int max_periods,
           double tolerance, bool keep_table, unsigned threads, const nb::object& progress) {
            return respond_to(drive, points, {samples, harmonics, max_periods, tolerance, keep_table}, threads,
                              progress);
        },
        "drive"_a, "points"_a, "samples"_a, "harmonics"_a, "max_periods"_a, "tolerance"_a, "keep_table"_a, "threads"_a,
        "progress"_a = nb::none(),
        nb::sig("def respond(drive: Drive, points: collections.abc.Sequence[tuple[Signal, Signal, float, "
                "collections.abc.Sequence[float], float]], samples: int, harmonics: int, max_periods: int, "
                "tolerance: float, keep_table: bool, threads: int, "
                "progress: collections.abc.Callable[[int], None] | None = None) -> "
                "dict[str, numpy.typing.NDArray[numpy.float64]]"));
    m.def(
        "status_text",
        [](int status, double time, int contact) {
            return status_text(static_cast<Status>(status), time, static_cast<Contact>(contact));
        },
        "status"_a, "time"_a, "contact"_a);
    m.def(
        "batch_fields",
        [] {
            std::vector<std::string> keys;
            for (const BatchField& f : batch_fields()) keys.emplace_back(f.key);
            return keys;
        },
        nb::sig("def batch_fields() -> list[str]"));
    m.def(
        "run_batch",
        [](SharedDrive& drive, const Signal& command, const Signal& load_torque, const std::array<double, n_states>& x,
           double capacity, const std::vector<int>& fields, const Values& values, double duration, double interval,
           std::size_t samples, bool energy, const std::vector<int>& channels, unsigned threads,
           const nb::object& progress) {
            return run_many(drive, Signals{command, load_torque}, x, capacity, fields, values, duration, interval,
                            samples, energy, channels, threads, progress);
        },
        "drive"_a, "command"_a, "load_torque"_a, "state"_a, "hysteresis_capacity"_a, "fields"_a, "values"_a,
        "duration"_a, "interval"_a, "samples"_a, "energy"_a, "channels"_a, "threads"_a, "progress"_a = nb::none(),
        nb::sig("def run_batch(drive: Drive, command: Signal, load_torque: Signal, state: "
                "collections.abc.Sequence[float], hysteresis_capacity: float, fields: collections.abc.Sequence[int], "
                "values: numpy.typing.NDArray[numpy.float64], duration: float, interval: float, samples: int, "
                "energy: bool, channels: collections.abc.Sequence[int], threads: int, "
                "progress: collections.abc.Callable[[int], None] | None = None) -> "
                "tuple[numpy.typing.NDArray[numpy.float64], numpy.typing.NDArray[numpy.float64]]"));
    m.def(
        "linearization",
        [](SharedDrive& drive, const std::array<double, n_states>& x, double capacity,
           const std::array<double, n_inputs>& inputs, const std::array<double, n_inputs>& input_rates) {
            return linearization(drive.drive, x, capacity, inputs, input_rates);
        },
        "drive"_a, "state"_a, "hysteresis_capacity"_a, "inputs"_a, "input_rates"_a,
        nb::sig("def linearization(drive: Drive, state: collections.abc.Sequence[float], hysteresis_capacity: float, "
                "inputs: collections.abc.Sequence[float], input_rates: collections.abc.Sequence[float]) -> "
                "tuple[numpy.typing.NDArray[numpy.float64], numpy.typing.NDArray[numpy.float64], list[int]]"));
    m.def(
        "explain_at",
        [](SharedDrive& drive, const Signal& command, const Signal& load_torque, const std::array<double, n_states>& x,
           double capacity,
           double time) { return explain_at(drive.drive, Signals{command, load_torque}, x, capacity, time); },
        "drive"_a, "command"_a, "load_torque"_a, "state"_a, "hysteresis_capacity"_a, "time"_a,
        nb::sig("def explain_at(drive: Drive, command: Signal, load_torque: Signal, state: "
                "collections.abc.Sequence[float], "
                "hysteresis_capacity: float, time: float) -> tuple[list[float], list[tuple[float, ...]]]"));

    nb::class_<Simulation>(m, "Simulation")
        .def(
            "__init__",
            [](Simulation* self, const SharedDrive& d, double step) { new (self) Simulation(d.drive, step); },
            "drive"_a, "step"_a)
        .def("advance", &advance, "interval"_a, "command_begin"_a, "command_end"_a, "load_begin"_a, "load_end"_a)
        .def("time", &Simulation::time)
        .def("read",
             [](Simulation& s) {
                 const Reading r = s.reading();
                 return std::vector<double>(r.value.begin(), r.value.end());
             })
        .def(
            "explain",
            [](Simulation& s) {
                const Reading r = s.reading();
                const auto& now = s.snapshot();
                return nb::make_tuple(std::vector<double>(r.value.begin(), r.value.end()),
                                      explain_state(s.drive(), s.regime(), now.x, now.memory, now.input));
            },
            nb::sig("def explain(self) -> tuple[list[float], list[tuple[float, ...]]]"))
        .def(
            "get_state",
            [](const Simulation& s) {
                const auto& n = s.snapshot();
                return nb::make_tuple(n.time, from_state(n.x), n.memory.hysteresis_capacity, n.memory.held_torque,
                                      std::array<int, 7>{n.key.modes[0], n.key.modes[1], n.key.modes[2],
                                                         n.key.amplifier, n.key.piece, n.key.cell, n.key.cell_back},
                                      n.input, n.started);
            },
            nb::sig("def get_state(self) -> tuple[float, list[float], float, float, list[int], list[float], bool]"))
        .def(
            "set_state",
            [](Simulation& s, double time, const std::array<double, n_states>& x, double capacity, double held,
               const std::array<int, 7>& k, const std::array<double, n_inputs>& input, bool started) {
                RegimeKey key;
                key.modes = {static_cast<std::int8_t>(k[0]), static_cast<std::int8_t>(k[1]),
                             static_cast<std::int8_t>(k[2])};
                key.amplifier = static_cast<std::int8_t>(k[3]);
                key.piece = static_cast<std::int16_t>(k[4]);
                key.cell = k[5];
                key.cell_back = k[6];
                s.restore({time, to_state(x), {capacity, held}, key, input, started});
            },
            "time"_a, "state"_a, "hysteresis_capacity"_a, "held_torque"_a, "regime"_a, "input"_a, "started"_a);
}
