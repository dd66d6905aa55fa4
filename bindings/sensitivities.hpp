// Derivatives of runs of trains with respect to parameters.
#pragma once

#include <optional>
#include <string>
#include <tuple>
#include <vector>

#include "lostmotion/analysis/sensitive_run.hpp"
#include "train.hpp"

namespace lostmotion::binding {

// A train that has been composed, for any number of runs.
struct ComposedTrain {
    std::shared_ptr<const TrainRun> run;
};

// At another value of a parameter: offset, weight, and what differs there: train, inputs, states and hysteresis
// capacities at the start, controllers.
using StartNumbers = std::pair<Named, Named>;
using NeighbourNumbers = std::tuple<double, double, std::optional<ComposedTrain>, std::optional<std::vector<Signal>>,
                                    std::optional<StartNumbers>, std::optional<BoundControl>>;
using VariationNumbers = std::pair<std::string, std::vector<NeighbourNumbers>>;

inline std::vector<Variation> variations_of(const std::vector<VariationNumbers>& all) {
    std::vector<Variation> out;
    for (const auto& [name, neighbours] : all) {
        Variation& v = out.emplace_back(Variation{name, {}});
        for (const auto& [offset, weight, train, inputs, start, control] : neighbours) {
            Neighbour& n = v.neighbours.emplace_back();
            n.offset = offset;
            n.weight = weight;
            if (train) n.train = train->run;
            n.inputs = inputs;
            if (start) n.start = TrainStart{start->first, start->second};
            if (control) n.control = control_of(*control);
        }
    }
    return out;
}

// Each case: train, inputs, start, hysteresis capacities, controllers, variations, duration, sample interval, samples,
// and the instants that are shown instead of the multiples of the interval, if any.
using SensitiveNumbers = std::tuple<ComposedTrain, std::vector<Signal>, Named, Named, BoundControl,
                                    std::vector<VariationNumbers>, double, double, std::size_t, std::vector<double>>;

// Of each run: what is wrong with what is asked for, with the parameter, and with its motion, or empty; values,
// channels x samples; derivatives, parameters x channels x samples; what the controllers show, axes x signals x
// samples; its derivatives, both empty where `signals` is false; the end state by name; from when the derivatives do
// not exist [s], and why.
inline nb::list run_sensitive_trains(const std::vector<SensitiveNumbers>& cases,
                                     const std::vector<std::string>& channels, bool signals, unsigned threads) {
    std::vector<SensitiveCase> all;
    for (const auto& [train, inputs, start, capacities, control, variations, duration, interval, samples, instants] :
         cases) {
        TrainOptions options = train_options(duration, interval, samples, false, 0);
        options.instants = instants;
        options.control = control_of(control);
        all.push_back({train.run, inputs, {start, capacities}, std::move(options), variations_of(variations)});
    }
    std::vector<SensitiveRow> rows;
    const nb::object nobody = nb::none();
    Watch watch(nobody);
    {
        nb::gil_scoped_release release;
        rows = run_sensitive(all, channels, signals, threads, std::ref(watch));
    }
    watch.check();
    nb::list out;
    for (std::size_t k = 0; k < rows.size(); ++k) {
        SensitiveRow& r = rows[k];
        const std::size_t samples = all[k].options.times().count, parameters = all[k].variations.size();
        const std::size_t axes = signals ? all[k].options.control.axes.size() : 0, shown = control::n_axis_signals;
        out.append(nb::make_tuple(nb::make_tuple(r.problem.parameter, r.problem.reason), r.error,
                                  as_array(std::move(r.values), {channels.size(), samples}),
                                  as_array(std::move(r.derivatives), {parameters, channels.size(), samples}),
                                  as_array(std::move(r.signals), {axes, shown, samples}),
                                  as_array(std::move(r.signal_derivatives), {parameters, axes, shown, samples}),
                                  in_order(r.end_state), r.ends_at, r.ends_by));
    }
    return out;
}

inline void bind_sensitivities(nb::module_& m) {
    nb::class_<ComposedTrain>(m, "ComposedTrain")
        .def(
            "__init__",
            [](ComposedTrain* self, const TrainDescription& train) { new (self) ComposedTrain{train.run()}; },
            "train"_a);
    m.def("run_sensitive_trains", &run_sensitive_trains, "cases"_a, "channels"_a, "signals"_a, "threads"_a,
          nb::sig("def run_sensitive_trains(cases: collections.abc.Sequence[tuple[object, ...]], channels: "
                  "collections.abc.Sequence[str], signals: bool, threads: int) -> list[tuple[tuple[str, str], str, "
                  "numpy.typing.NDArray[numpy.float64], numpy.typing.NDArray[numpy.float64], "
                  "numpy.typing.NDArray[numpy.float64], numpy.typing.NDArray[numpy.float64], dict[str, float], float, "
                  "str]]"));
}

}  // namespace lostmotion::binding
