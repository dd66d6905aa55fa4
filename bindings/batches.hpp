// Many drives at once.
#pragma once

#include <optional>

#include "lostmotion/batch/drive_batch.hpp"
#include "train.hpp"

namespace lostmotion::binding {

using BatchInput = nb::ndarray<const double, nb::numpy, nb::ndim<1>, nb::c_contig, nb::device::cpu>;
using BatchMask = nb::ndarray<const bool, nb::numpy, nb::ndim<1>, nb::c_contig, nb::device::cpu>;

inline batch::Input batch_input(const BatchInput& values, const batch::DriveBatch& b) {
    if (values.shape(0) != 1 && values.shape(0) != b.size()) throw nb::type_error("an input of other drives");
    return {values.data(), values.shape(0) != 1 || b.size() == 1};
}

inline void step_batch(batch::DriveBatch& b, const BatchInput& command, const BatchInput& load_torque,
                       unsigned threads) {
    const batch::Input first = batch_input(command, b), second = batch_input(load_torque, b);
    batch::Failure failure;
    {
        nb::gil_scoped_release release;
        failure = b.step(first, second, threads);
    }
    if (!failure.text.empty())
        throw SolverError("drive " + std::to_string(failure.drive) + " of the batch: " + failure.text);
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

inline void bind_batches(nb::module_& m) {
    using B = batch::DriveBatch;
    nb::class_<B::Snapshot>(m, "BatchSnapshot");
    nb::class_<B>(m, "DriveBatch")
        .def(
            "__init__",
            [](B* self, const std::vector<const TrainDescription*>& bases, std::vector<int> base,
               std::vector<std::string> keys, int curve_breaks, const Values& values, std::vector<int> model_of,
               double step) {
                batch::Models models;
                for (const TrainDescription* t : bases) models.bases.push_back(t->train);
                models.base = std::move(base);
                models.keys = std::move(keys);
                models.curve_breaks = curve_breaks;
                models.values.assign(values.data(), values.data() + values.size());
                if (values.shape(0) != models.size() || values.shape(1) != models.width())
                    throw nb::type_error("values of other models");
                new (self) B(std::move(models), std::move(model_of), step);
            },
            "bases"_a, "base"_a, "keys"_a, "curve_breaks"_a, "values"_a, "model_of"_a, "step"_a)
        .def_static(
            "error", [](const TrainDescription& t) { return B::error(t.train); }, "train"_a,
            "What keeps a train from being stepped in a batch, or nothing.")
        .def("step", &step_batch, "command"_a, "load_torque"_a, "threads"_a)
        .def(
            "reset",
            [](B& b, const std::optional<BatchMask>& which, const std::optional<Values>& start) {
                if (which && which->shape(0) != b.size()) throw nb::type_error("a mask of other drives");
                if (start && (start->shape(0) != b.size() || start->shape(1) != batch::D::states))
                    throw nb::type_error("states of other drives");
                b.reset(which ? which->data() : nullptr, start ? start->data() : nullptr);
            },
            "which"_a.none(), "start"_a.none())
        .def_prop_ro(
            "states",
            [](B& b) {
                return nb::ndarray<nb::numpy, double, nb::ndim<2>>(b.states(), {batch::D::states, b.size()},
                                                                   nb::find(b));
            },
            "The values of all drives, by state; each step writes them anew.")
        .def("output_torque", [](const B& b) { return read_batch(b, [&](double* out) { b.read_output_torque(out); }); })
        .def("motor_torque", [](const B& b) { return read_batch(b, [&](double* out) { b.read_motor_torque(out); }); })
        .def("input_contact",
             [](const B& b) { return read_contacts(b, [&](std::int8_t* out) { b.read_input_contact(out); }); })
        .def("twist_contact",
             [](const B& b) { return read_contacts(b, [&](std::int8_t* out) { b.read_twist_contact(out); }); })
        .def("snapshot", &B::snapshot)
        .def(
            "restore",
            [](B& b, const B::Snapshot& s) {
                if (s.of != &b) throw nb::type_error("a snapshot of another batch");
                b.restore(s);
            },
            "snapshot"_a)
        .def_prop_ro("counts",
                     [](const B& b) {
                         const batch::Counts& c = b.counts();
                         return std::make_tuple(c.steps, c.walked, c.general, c.switchings);
                     })
        .def_prop_ro("memory", &B::memory, "Bytes of states, tables and parameters.");
}

}  // namespace lostmotion::binding
