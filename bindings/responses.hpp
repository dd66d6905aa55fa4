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
    Record out;
    out["components"] = t.components;
    out["neutral"] = t.neutral;
    out["error"] = t.error;
    const std::pair<const char*, const std::vector<double>*> numbers[] = {
        {"converged", &t.converged},       {"smooth", &t.smooth},         {"periods", &t.periods},
        {"newton_steps", &t.newton_steps}, {"period", &t.period},         {"residual", &t.residual},
        {"motor_power", &t.motor_power},   {"load_power", &t.load_power}, {"gear_loss", &t.gear_loss}};
    for (const auto& [name, values] : numbers) out[name] = as_array(*values, {count});
    out["advance"] = as_array(t.advance, {count, n});
    out["start"] = as_array(t.start, {count, n});
    out["jacobian"] = as_array(t.jacobian, {count, n, n});
    out["harmonics"] = as_array(t.harmonics, {count, c, static_cast<std::size_t>(spec.harmonics) + 1, 2});
    out["mean_square"] = as_array(t.mean_square, {count, c});
    if (spec.keep_table) out["table"] = as_array(t.table, {count, c, spec.samples});
    return out;
}

inline void bind_responses(nb::module_& m) {
    m.def("respond", &respond, "train"_a, "points"_a, nb::kw_only(), "samples"_a, "harmonics"_a, "max_periods"_a,
          "tolerance"_a, "keep_table"_a, "limit_cycle"_a, "threads"_a, "progress"_a = nb::none());
}

}  // namespace lostmotion::binding
