#include <cstring>
#include <limits>
#include <optional>

#include "lostmotion/batch/drive_batch.hpp"
#include "lostmotion/batch/exact_batch.hpp"
#include "module.hpp"
#include "train.hpp"

namespace lostmotion::binding {

namespace {

using BatchInput = nb::ndarray<const double, nb::numpy, nb::ndim<1>, nb::c_contig, nb::device::cpu>;
using BatchMask = nb::ndarray<const bool, nb::numpy, nb::ndim<1>, nb::c_contig, nb::device::cpu>;

template <class Batch>
batch::Input batch_input(const BatchInput& values, const Batch& b) {
    if (values.shape(0) != 1 && values.shape(0) != b.size()) throw nb::type_error("an input of other drives");
    return {values.data(), values.shape(0) != 1 || b.size() == 1};
}

template <class Batch>
std::vector<batch::Input> batch_inputs(const std::vector<BatchInput>& values, const Batch& b) {
    std::vector<batch::Input> out;
    for (const BatchInput& input : values) out.push_back(batch_input(input, b));
    return out;
}

// step() without the lock of the interpreter.
template <class Step>
void step_batch(Step&& step) {
    batch::Failure failure;
    {
        nb::gil_scoped_release release;
        failure = step();
    }
    if (!failure.text.empty())
        throw SolverError("drive " + std::to_string(failure.drive) + " of the batch: " + failure.text);
}

// Torque on the load, its derivative by the acceleration, and the acceleration of each drive: all means over a step.
template <class Inertia, class Load, class Step>
Array answers_of(std::size_t size, Inertia&& inertia, Load&& load, Step&& step) {
    std::vector<LoadAnswer> answers(size);
    step_batch([&] { return step(answers.data()); });
    auto data = std::make_unique_for_overwrite<double[]>(3 * size);
    for (std::size_t k = 0; k < size; ++k) {
        const LoadAnswer& a = answers[k];
        data[k] = inertia(k) * a.acceleration + load(k);
        data[size + k] =
            a.compliance > 0.0 ? inertia(k) - 1.0 / a.compliance : -std::numeric_limits<double>::infinity();
        data[2 * size + k] = a.acceleration;
    }
    return as_array(std::move(data), {3, size});
}

// One after the other, as rows of an array of the batch itself.
template <class Batch>
auto batch_rows(Batch& b, double* rows, std::size_t n) {
    return nb::ndarray<nb::numpy, double, nb::ndim<2>>(rows, {n, b.size()}, nb::find(b));
}

template <class Read>
Array read_batch(const batch::DriveBatch& b, Read&& read) {
    auto data = std::make_unique_for_overwrite<double[]>(b.size());
    read(data.get());
    return as_array(std::move(data), {b.size()});
}

template <class Read>
Array read_contacts(const batch::DriveBatch& b, Read&& read) {
    std::vector<std::int8_t> modes(b.size());
    read(modes.data());
    return numbers(modes, [](std::int8_t m) { return m; });
}

Scenario batch_scenario(const TrainDescription& train, const BoundControl& control) {
    Scenario s = stepped_scenario(train.train, control_of(control));
    if (const std::string error = check_control(model::Assembly(s.train), s.control); !error.empty())
        throw nb::value_error(error.c_str());
    return s;
}

std::vector<Scenario> batch_scenarios(const std::vector<const TrainDescription*>& trains,
                                      const std::vector<BoundControl>& controls) {
    std::vector<Scenario> kinds;
    for (std::size_t k = 0; k < trains.size(); ++k) kinds.push_back(batch_scenario(*trains[k], controls[k]));
    return kinds;
}

// What both kinds of batches have. memory: what its bytes are of.
template <class B>
nb::class_<B> bind_batch(nb::module_& m, const char* name, const char* snapshot, const char* memory) {
    nb::class_<typename B::Snapshot>(m, snapshot);
    return nb::class_<B>(m, name)
        .def(
            "__init__",
            [](B* self, const std::vector<const TrainDescription*>& trains, const std::vector<BoundControl>& controls,
               const std::vector<int>& kind_of,
               double step) { new (self) B(batch_scenarios(trains, controls), kind_of, step); },
            "trains"_a, nb::kw_only(), "controls"_a, "kind_of"_a, "step"_a)
        .def_prop_ro("variables", [](const B& b) { return each_of(b.variables().all(), &Variable::name); })
        .def("snapshot", &B::snapshot)
        .def(
            "restore",
            [](B& b, const typename B::Snapshot& s) {
                if (s.of != &b) throw nb::type_error("a snapshot of another batch");
                b.restore(s);
            },
            "snapshot"_a)
        .def_prop_ro("memory", &B::memory, memory);
}

void bind_exact_batch(nb::module_& m) {
    using B = batch::ExactBatch;
    bind_batch<B>(m, "ExactBatch", "ExactBatchSnapshot", "Bytes, without what the solvers keep of the regimes.")
        .def(
            "step",
            [](B& b, const std::vector<BatchInput>& inputs, const std::optional<BatchInput>& speed,
               const std::optional<BatchInput>& angle, const std::optional<BatchInput>& acceleration,
               unsigned threads) {
                const std::vector<batch::Input> given = batch_inputs(inputs, b);
                std::optional<B::Motion> motion;
                if (speed) motion.emplace(B::Motion{batch_input(*speed, b), {}, {}});
                if (speed && angle) motion->angle = batch_input(*angle, b);
                if (speed && acceleration) motion->acceleration = batch_input(*acceleration, b);
                step_batch([&] { return b.step(given, motion, threads); });
            },
            "inputs"_a, nb::kw_only(), "speed"_a = nb::none(), "angle"_a = nb::none(), "acceleration"_a = nb::none(),
            "threads"_a)
        .def(
            "answer",
            [](B& b, const std::vector<BatchInput>& inputs, int shaft, std::size_t load, unsigned threads) {
                const std::vector<batch::Input> given = batch_inputs(inputs, b);
                if (!b.load_shaft(0, shaft)) throw nb::value_error("the shaft has no load torque");
                return answers_of(
                    b.size(), [&](std::size_t k) { return b.load_shaft(k, shaft)->inertia; },
                    [&](std::size_t k) { return given.at(load)[k]; },
                    [&](LoadAnswer* to) { return b.step(given, {}, threads, B::Answers{shaft, to}); });
            },
            "inputs"_a, nb::kw_only(), "shaft"_a, "load"_a, "threads"_a,
            "A step, with how a shaft answers its load torque: rows of torque, derivative and acceleration.")
        .def(
            "replace",
            [](B& b, std::size_t k, const TrainDescription& train, const BoundControl& control) {
                return b.replace(k, batch_scenario(train, control));
            },
            "k"_a, "train"_a, "control"_a, "Gives a drive other parameters; false: it has other states then.")
        .def(
            "reset",
            [](B& b, const std::optional<BatchMask>& which, const Values& start) {
                if (which && which->shape(0) != b.size()) throw nb::type_error("a mask of other drives");
                if (start.shape(0) != b.size() || start.shape(1) != b.states().size() + 1)
                    throw nb::type_error("states of other drives");
                const std::string wrong = b.reset(which ? which->data() : nullptr, start.data());
                if (!wrong.empty()) throw nb::value_error(wrong.c_str());
            },
            "which"_a.none(), "start"_a)
        .def_prop_ro("inputs", &B::inputs)
        .def_prop_ro("states", &B::states)
        .def_prop_ro(
            "values", [](B& b) { return batch_rows(b, b.values(), b.variables().size()); },
            "The values of all drives, by variable; each step writes them anew.");
}

// Laws and data sheet of a drive, as a kernel for graphics processors takes them.
nb::dict laws_of_drive(const model::Train& train) {
    const batch::DriveKind kind(train);
    const batch::DriveLaws& l = kind.laws();
    const batch::DriveSheet sheet = batch::sheet_of(train, kind.half_gap());
    const auto list = [](const double* from, int n) { return std::vector<double>(from, from + n); };
    nb::dict out;
    for (const auto& [name, from] :
         {std::pair("lower", l.lower), {"upper", l.upper}, {"slope", l.slope}, {"offset", l.offset}, {"root", l.root}})
        out[name] = list(from, l.pieces);
    out["speeds"] = list(l.map.speeds, l.map.n_speeds);
    out["loads"] = list(l.map.loads, l.map.n_loads);
    out["values"] = list(l.map.values, l.map.n_speeds * l.map.n_loads);
    out["steepest"] = l.steepest;
    out["zero"] = l.zero;
    out["losses"] = l.losses;
    for (const auto& [name, is] : {std::pair("has_gap", l.has_gap),
                                   {"rigid", l.rigid},
                                   {"delays_torque", l.delays_torque},
                                   {"limits_damping", l.limits_damping},
                                   {"torque_source", l.torque_source}})
        out[name] = is;
    out["half_gap"] = kind.half_gap();
    std::vector<double> numbers(sizeof sheet / sizeof(double));
    std::memcpy(numbers.data(), &sheet, sizeof sheet);
    out["sheet"] = numbers;
    return out;
}

}  // namespace

void bind_batches(nb::module_& m) {
    bind_exact_batch(m);
    using B = batch::DriveBatch;
    bind_batch<B>(m, "DriveBatch", "BatchSnapshot", "Bytes of states and parameters.")
        .def(
            "set",
            [](B& b, const std::string& key, const BatchInput& values) {
                if (values.shape(0) != b.size()) throw nb::type_error("values of other drives");
                if (!b.set(key, values.data())) throw nb::value_error("no parameter of a drive");
            },
            "key"_a, "values"_a, "Sets a parameter of all drives, by its key in the short form.")
        .def(
            "replace", [](B& b, std::size_t k, const TrainDescription& train) { b.replace(k, train.train); }, "k"_a,
            "train"_a, "Gives a drive a train of its own.")
        .def_static(
            "error",
            [](const TrainDescription& t, const BoundControl& control) {
                return B::error(t.train, control_of(control));
            },
            "train"_a, "control"_a, "What keeps a train and its controllers from being stepped in a batch, or nothing.")
        .def_static(
            "laws", [](const TrainDescription& t) { return laws_of_drive(t.train); }, "train"_a,
            nb::sig("def laws(train: Train) -> dict[str, Any]"),
            "Laws and data sheet of a drive, by the names of the walk.")
        .def(
            "step",
            [](B& b, const BatchInput& command, const BatchInput& load_torque, unsigned threads) {
                const batch::Input first = batch_input(command, b), second = batch_input(load_torque, b);
                step_batch([&] { return b.step(first, second, threads); });
            },
            "command"_a, "load_torque"_a, "threads"_a)
        .def(
            "answer",
            [](B& b, const BatchInput& command, const BatchInput& load_torque, unsigned threads) {
                const batch::Input first = batch_input(command, b), second = batch_input(load_torque, b);
                return answers_of(
                    b.size(), [&](std::size_t k) { return b.load_inertia(k); },
                    [&](std::size_t k) { return second[k]; },
                    [&](LoadAnswer* to) { return b.step(first, second, threads, to); });
            },
            "command"_a, "load_torque"_a, "threads"_a,
            "A step, with how the load answers its load torque: rows of torque, derivative and acceleration.")
        .def(
            "reset",
            [](B& b, const std::optional<BatchMask>& which, const std::optional<Values>& start) {
                if (which && which->shape(0) != b.size()) throw nb::type_error("a mask of other drives");
                if (start && (start->shape(0) != b.size() || start->shape(1) != B::states))
                    throw nb::type_error("states of other drives");
                b.reset(which ? which->data() : nullptr, start ? start->data() : nullptr);
            },
            "which"_a.none(), "start"_a.none())
        .def_prop_ro(
            "states", [](B& b) { return batch_rows(b, b.shown(), B::states); },
            "The values of all drives, by state; each step writes them anew.")
        .def("output_torque", [](const B& b) { return read_batch(b, [&](double* out) { b.read_output_torque(out); }); })
        .def("motor_torque", [](const B& b) { return read_batch(b, [&](double* out) { b.read_motor_torque(out); }); })
        .def("input_contact",
             [](const B& b) { return read_contacts(b, [&](std::int8_t* out) { b.read_input_contact(out); }); })
        .def("twist_contact",
             [](const B& b) { return read_contacts(b, [&](std::int8_t* out) { b.read_twist_contact(out); }); })
        .def_prop_ro("inputs", [](const B& b) { return b.names().inputs; })
        .def(
            "read",
            [](B& b, std::size_t variable) {
                return read_batch(b, [&](double* out) { b.read_variable(variable, out); });
            },
            "variable"_a, "The values of a variable, by its number among the names.")
        .def(
            "carry_tangents",
            [](B& b, const std::vector<std::string>& keys) {
                if (!b.carry_tangents(keys)) throw nb::value_error("no parameter of a drive");
            },
            "keys"_a, "Carries along the derivatives of the states by parameters.")
        .def(
            "tangent",
            [](const B& b, std::size_t parameter, std::size_t state) {
                return read_batch(b, [&](double* out) { b.read_tangent(parameter, state, out); });
            },
            "parameter"_a, "state"_a)
        .def_prop_ro("counts", [](const B& b) {
            const batch::Counts& c = b.counts();
            return std::make_tuple(c.steps, c.walked, c.general, c.switchings);
        });
}

}  // namespace lostmotion::binding
