// Periodic motions and responses.
#pragma once

#include "lostmotion/analysis/respond.hpp"
#include "train.hpp"

namespace lostmotion::binding {

// A signal for each input, the period, components at the start by name; those left out are 0.
using Point = std::tuple<std::vector<Signal>, double, Named>;

inline Record respond(const TrainDescription& train, const std::vector<Point>& asked, std::size_t samples,
                      int harmonics, int max_periods, double tolerance, bool keep_table, bool limit_cycle,
                      unsigned threads, const nb::object& progress) {
    const ResponseSpec spec{samples, harmonics, max_periods, tolerance, keep_table, limit_cycle};
    std::vector<ResponseRequest> points;
    for (const auto& [inputs, period, start] : asked) points.push_back({inputs, period, start});
    ResponseTable t;
    Watch watch(progress);
    {
        nb::gil_scoped_release release;
        t = respond_train(*train.run(), points, spec, threads, std::ref(watch));
    }
    watch.check();
    const std::size_t count = points.size(), n = t.components.size(), c = t.channels;
    const auto array = [](const std::vector<double>& values, const std::vector<std::size_t>& shape) {
        auto data = std::make_unique_for_overwrite<double[]>(values.size());
        std::copy(values.begin(), values.end(), data.get());
        return as_array(std::move(data), shape);
    };
    Record out;
    out["components"] = t.components;
    out["neutral"] = t.neutral;
    out["error"] = t.error;
    const std::pair<const char*, const std::vector<double>*> numbers[] = {
        {"converged", &t.converged},       {"smooth", &t.smooth},         {"periods", &t.periods},
        {"newton_steps", &t.newton_steps}, {"period", &t.period},         {"residual", &t.residual},
        {"motor_power", &t.motor_power},   {"load_power", &t.load_power}, {"gear_loss", &t.gear_loss}};
    for (const auto& [name, values] : numbers) out[name] = array(*values, {count});
    out["advance"] = array(t.advance, {count, n});
    out["start"] = array(t.start, {count, n});
    out["jacobian"] = array(t.jacobian, {count, n, n});
    out["harmonics"] = array(t.harmonics, {count, c, static_cast<std::size_t>(spec.harmonics) + 1, 2});
    out["mean_square"] = array(t.mean_square, {count, c});
    if (spec.keep_table) out["table"] = array(t.table, {count, c, spec.samples});
    return out;
}

inline void bind_responses(nb::module_& m) {
    m.def("respond", &respond, "train"_a, "points"_a, nb::kw_only(), "samples"_a, "harmonics"_a, "max_periods"_a,
          "tolerance"_a, "keep_table"_a, "limit_cycle"_a, "threads"_a, "progress"_a = nb::none());
}

}  // namespace lostmotion::binding
