// Periodic motions and responses, of drives and of trains.
#pragma once

#include "lostmotion/analysis/drive_response.hpp"
#include "lostmotion/analysis/train_response.hpp"
#include "train.hpp"

namespace lostmotion::binding {

// A signal for each input, the period, components at the start by name; those left out are 0.
using Point = std::tuple<std::vector<Signal>, double, Named>;

template <class Plant, class System = typename Plant::System, class D = typename System::Dims>
nb::dict as_dict(const Plant& plant, const std::vector<ResponseResultOf<System>>& results, const ResponseSpec& spec) {
    using R = const ResponseResultOf<System>&;
    const std::vector<NamedComponent> components = plant.components();
    const std::size_t n = components.size(), channels = plant.channels();
    std::vector<std::string> errors, names;
    std::vector<int> neutral;
    for (R r : results) errors.push_back(plant.error(r));
    for (const NamedComponent& c : components) {
        names.push_back(c.name);
        neutral.push_back(c.neutral);
    }
    const auto of_each = [&](auto&& value) {
        return column(results, {n}, [&](R r, double* to) {
            for (const NamedComponent& c : components) *to++ = value(r, c.place);
        });
    };
    const auto harmonics = static_cast<std::size_t>(spec.harmonics) + 1;
    nb::dict out;
    out["components"] = names;
    out["neutral"] = neutral;
    out["error"] = errors;
    out["converged"] = numbers(results, [](R r) { return r.motion.converged; });
    out["smooth"] = numbers(results, [](R r) { return r.motion.smooth; });
    out["periods"] = numbers(results, [](R r) { return r.motion.periods; });
    out["newton_steps"] = numbers(results, [](R r) { return r.motion.newton_steps; });
    out["period"] = numbers(results, [](R r) { return r.motion.period; });
    out["residual"] = numbers(results, [](R r) { return r.motion.residual; });
    out["motor_power"] = numbers(results, [](R r) { return r.motor_power; });
    out["load_power"] = numbers(results, [](R r) { return r.load_power; });
    out["gear_loss"] = numbers(results, [](R r) { return r.gear_loss; });
    out["advance"] = of_each([](R r, int k) { return k < D::states ? r.motion.advance[k] : 0.0; });
    out["start"] = of_each([](R r, int k) {
        return k < D::states ? r.motion.start.x[k] : r.motion.start.memory[static_cast<std::size_t>(k - D::states)];
    });
    out["jacobian"] = column(results, {n, n}, [&](R r, double* to) {
        for (const NamedComponent& row : components)
            for (const NamedComponent& by : components) *to++ = r.motion.jacobian.row[row.place][by.place];
    });
    out["harmonics"] = column(results, {channels, harmonics, 2},
                              [](R r, double* to) { std::copy(r.harmonic.begin(), r.harmonic.end(), to); });
    out["mean_square"] =
        column(results, {channels}, [](R r, double* to) { std::copy(r.mean_square.begin(), r.mean_square.end(), to); });
    if (spec.keep_table)
        out["table"] = column(results, {channels, spec.samples},
                              [](R r, double* to) { std::copy(r.table.begin(), r.table.end(), to); });
    return out;
}

// start(named): what it is in the kernel's dimensions.
template <class Plant, class Start>
nb::dict respond_in(Plant& plant, const std::vector<Point>& asked, const Start& start, const ResponseSpec& spec,
                    unsigned threads, const nb::object& progress) {
    using System = typename Plant::System;
    std::vector<ResponsePointOf<System>> points;
    for (const auto& [inputs, period, named] : asked) {
        points.emplace_back();
        std::copy(inputs.begin(), inputs.end(), points.back().signals.begin());
        points.back().period = period;
        points.back().start = start(named);
    }
    std::vector<ResponseResultOf<System>> results;
    Watch watch(progress);
    {
        nb::gil_scoped_release release;
        results = respond_all(plant, points, spec, threads, std::ref(watch));
    }
    watch.check();
    return as_dict(plant, results, spec);
}

inline nb::dict respond_drive(SharedDrive& drive, const std::vector<Point>& points, std::size_t samples, int harmonics,
                              int max_periods, double tolerance, bool keep_table, bool limit_cycle, unsigned threads,
                              const nb::object& progress) {
    DrivePlant plant(drive);
    const auto start = [&](const Named& named) {
        Start s;
        for (const NamedComponent& c : plant.components()) {
            const auto given = named.find(c.name);
            if (given == named.end()) continue;
            if (c.place < n_states)
                s.x[c.place] = given->second;
            else if (c.place == hysteresis_component)
                s.memory.hysteresis_capacity = given->second;
            else
                s.memory.locked_torque = given->second;
        }
        return s;
    };
    return respond_in(plant, points, start, {samples, harmonics, max_periods, tolerance, keep_table, limit_cycle},
                      threads, progress);
}

inline nb::dict respond_train(const TrainDescription& description, const std::vector<Point>& points,
                              std::size_t samples, int harmonics, int max_periods, double tolerance, bool keep_table,
                              bool limit_cycle, unsigned threads, const nb::object& progress) {
    const TrainRun run(description.train);
    return run.in_kernel([&]<class D>(const typename TrainReader<D>::Model& model) {
        TrainPlant<D> plant(model);
        const auto start = [&](const Named& named) {
            StartOf<D> s;
            for (const NamedComponent& c : plant.components())
                if (const auto given = named.find(c.name); given != named.end())
                    (c.place < D::states ? s.x[c.place] : s.memory[static_cast<std::size_t>(c.place - D::states)]) =
                        given->second;
            return s;
        };
        return respond_in(plant, points, start, {samples, harmonics, max_periods, tolerance, keep_table, limit_cycle},
                          threads, progress);
    });
}

inline void bind_responses(nb::module_& m) {
    static const std::string arguments =
        ", points: collections.abc.Sequence[tuple[collections.abc.Sequence[Signal], float, "
        "collections.abc.Mapping[str, float]]], samples: int, harmonics: int, max_periods: int, tolerance: float, "
        "keep_table: bool, limit_cycle: bool, threads: int, progress: collections.abc.Callable[[int], None] | None = "
        "None) -> "
        "dict[str, typing.Any]";
    static const std::string drive = "def respond(drive: Drive" + arguments,
                             train = "def respond(train: Train" + arguments;
    m.def("respond", &respond_drive, "drive"_a, "points"_a, "samples"_a, "harmonics"_a, "max_periods"_a, "tolerance"_a,
          "keep_table"_a, "limit_cycle"_a, "threads"_a, "progress"_a = nb::none(), nb::sig(drive.c_str()));
    m.def("respond", &respond_train, "train"_a, "points"_a, "samples"_a, "harmonics"_a, "max_periods"_a, "tolerance"_a,
          "keep_table"_a, "limit_cycle"_a, "threads"_a, "progress"_a = nb::none(), nb::sig(train.c_str()));
}

}  // namespace lostmotion::binding
