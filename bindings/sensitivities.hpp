// Derivatives of runs of trains with respect to parameters.
#pragma once

#include <string>
#include <vector>

#include "lostmotion/analysis/sensitive_run.hpp"
#include "train.hpp"

namespace lostmotion::binding {

// At another value of a parameter: offset, weight, and what differs there.
inline Neighbour neighbour_of(const Record& fields) {
    Neighbour n;
    NamedFields f(fields);
    f.number("offset", n.offset);
    f.number("weight", n.weight);
    if (const TrainDescription* train = nullptr; f.take("train", train)) n.train = train->run();
    if (std::vector<Signal> inputs; f.take("inputs", inputs)) n.inputs = std::move(inputs);
    if (std::pair<Named, Named> start; f.take("start", start)) n.start = {start.first, start.second};
    if (BoundControl control; f.take("control", control)) n.control = control_of(control);
    f.refuse_unknown();
    return n;
}

// A parameter with its neighbours.
using VariationNumbers = std::pair<std::string, std::vector<Record>>;

// A run with its variations. instants: those that are shown instead of the multiples of the interval, if any.
struct SensitiveRun {
    SensitiveCase core;
};

// Of each run: what is wrong with what is asked for, with the parameter, and with its motion, or empty; values,
// channels x samples; derivatives, parameters x channels x samples; what the controllers show, axes x signals x
// samples; its derivatives, both empty where `signals` is false; the end state by name; from when the derivatives do
// not exist [s], and why.
inline std::vector<Record> run_sensitive_trains(const std::vector<const SensitiveRun*>& cases,
                                                const std::vector<std::string>& channels, bool signals,
                                                unsigned threads) {
    std::vector<SensitiveCase> all;
    for (const SensitiveRun* one : cases) all.push_back(one->core);
    std::vector<SensitiveRow> rows;
    const nb::object nobody = nb::none();
    Watch watch(nobody);
    {
        nb::gil_scoped_release release;
        rows = run_sensitive(all, channels, signals, threads, std::ref(watch));
    }
    watch.check();
    std::vector<Record> out(rows.size());
    for (std::size_t k = 0; k < rows.size(); ++k) {
        SensitiveRow& r = rows[k];
        const std::size_t samples = all[k].options.times().count, parameters = all[k].variations.size();
        const std::size_t axes = signals ? all[k].options.control.axes.size() : 0, shown = control::n_axis_signals;
        out[k]["problem"] = std::pair(r.problem.parameter, r.problem.reason);
        out[k]["error"] = r.error;
        out[k]["values"] = as_array(std::move(r.values), {channels.size(), samples});
        out[k]["derivatives"] = as_array(std::move(r.derivatives), {parameters, channels.size(), samples});
        out[k]["signals"] = as_array(std::move(r.signals), {axes, shown, samples});
        out[k]["signal_derivatives"] = as_array(std::move(r.signal_derivatives), {parameters, axes, shown, samples});
        out[k]["end_state"] = in_order(r.end_state);
        out[k]["ends_at"] = r.ends_at;
        out[k]["ends_by"] = r.ends_by;
    }
    return out;
}

inline void bind_sensitivities(nb::module_& m) {
    nb::class_<SensitiveRun>(m, "SensitiveRun")
        .def(
            "__init__",
            [](SensitiveRun* self, const Case& one, const std::vector<VariationNumbers>& variations,
               const BoundControl& control, double duration, double sample_interval, std::size_t samples,
               std::vector<double> instants) {
                new (self) SensitiveRun{{one.train, one.inputs, one.start, {}, {}}};
                TrainOptions& options = self->core.options = train_options(duration, sample_interval, samples);
                options.instants = std::move(instants);
                options.control = control_of(control);
                for (const auto& [name, neighbours] : variations) {
                    Variation& v = self->core.variations.emplace_back(Variation{name, {}});
                    for (const Record& fields : neighbours) v.neighbours.push_back(neighbour_of(fields));
                }
            },
            "case"_a, nb::kw_only(), "variations"_a, "control"_a, "duration"_a, "sample_interval"_a, "samples"_a = 0,
            "instants"_a = std::vector<double>());
    m.def("run_sensitive_trains", &run_sensitive_trains, "cases"_a, "channels"_a, nb::kw_only(), "signals"_a,
          "threads"_a);
}

}  // namespace lostmotion::binding
