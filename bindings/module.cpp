// Thin binding: the core as a Python module.
#include "runs.hpp"

using namespace lostmotion;
using namespace lostmotion::binding;
using namespace nb::literals;
using Vector = std::vector<double>;

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
           std::size_t samples, bool energy, const std::vector<int>& channels,
           const std::vector<std::pair<std::size_t, int>>& kept, unsigned threads, const nb::object& progress) {
            return run_many(drive, Signals{command, load_torque}, x, capacity, fields, values, duration, interval,
                            samples, energy, channels, kept, threads, progress);
        },
        "drive"_a, "command"_a, "load_torque"_a, "state"_a, "hysteresis_capacity"_a, "fields"_a, "values"_a,
        "duration"_a, "interval"_a, "samples"_a, "energy"_a, "channels"_a, "kept"_a, "threads"_a,
        "progress"_a = nb::none(),
        nb::sig("def run_batch(drive: Drive, command: Signal, load_torque: Signal, state: "
                "collections.abc.Sequence[float], hysteresis_capacity: float, fields: collections.abc.Sequence[int], "
                "values: numpy.typing.NDArray[numpy.float64], duration: float, interval: float, samples: int, "
                "energy: bool, channels: collections.abc.Sequence[int], kept: "
                "collections.abc.Sequence[tuple[int, int]], threads: int, "
                "progress: collections.abc.Callable[[int], None] | None = None) -> "
                "tuple[numpy.typing.NDArray[numpy.float64], numpy.typing.NDArray[numpy.float64]]"));
    m.def(
        "reductions", [] { return std::vector<std::string>(reduction_names.begin(), reduction_names.end()); },
        nb::sig("def reductions() -> list[str]"));
    m.def("reduce_rows", &reduce_rows, "how"_a, "values"_a,
          nb::sig("def reduce_rows(how: int, values: numpy.typing.NDArray[numpy.float64]) -> "
                  "numpy.typing.NDArray[numpy.float64]"));
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
                                      n.input, n.started, from_course(n.course, n.steady));
            },
            nb::sig("def get_state(self) -> tuple[float, list[float], float, float, list[int], list[float], bool, "
                    "list[float]]"))
        .def(
            "set_state",
            [](Simulation& s, double time, const std::array<double, n_states>& x, double capacity, double held,
               const std::array<int, 7>& k, const std::array<double, n_inputs>& input, bool started,
               const CourseNumbers& course) {
                RegimeKey key;
                key.modes = {static_cast<std::int8_t>(k[0]), static_cast<std::int8_t>(k[1]),
                             static_cast<std::int8_t>(k[2])};
                key.amplifier = static_cast<std::int8_t>(k[3]);
                key.piece = static_cast<std::int16_t>(k[4]);
                key.cell = k[5];
                key.cell_back = k[6];
                s.restore({time,
                           to_state(x),
                           {capacity, held},
                           key,
                           input,
                           started,
                           course.back() != 0.0,
                           to_course(course)});
            },
            "time"_a, "state"_a, "hysteresis_capacity"_a, "held_torque"_a, "regime"_a, "input"_a, "started"_a,
            "course"_a = CourseNumbers{});
}
