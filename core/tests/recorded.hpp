// A run of a train with all its channels, for the tests.
#pragma once

#include <string>

#include "lostmotion/simulation/train_run.hpp"
#include "train_support.hpp"

namespace lostmotion::model {

// With names of their own for all elements.
inline Train named(Train t) {
    const auto name = [](auto& elements, const std::string& kind) {
        for (std::size_t k = 0; k < elements.size(); ++k)
            if (elements[k].name.empty() || elements.size() > 1) elements[k].name = kind + std::to_string(k);
    };
    name(t.motors, "motor");
    name(t.gears, "gear");
    name(t.brakes, "brake");
    name(t.clutches, "clutch");
    name(t.freewheels, "freewheel");
    name(t.dampers, "damper");
    name(t.angle_torques, "angle_torque");
    if (t.shafts[0].name.empty()) name(t.shafts, "shaft");
    return t;
}

struct Recorded {
    lostmotion::TrainRun run;
    TrainReport report;
    std::vector<double> out, signals;  // of channels, and of the axes
    std::size_t samples;
    double interval;  // [s], of the samples

    Recorded(const Train& train, const std::vector<Signal>& inputs, double duration, double interval_of_samples,
             double tolerance = 0.0, std::span<const double> start = {}, std::span<const double> memory = {},
             const Control& control = {})
        : run(named(train)), interval(interval_of_samples) {
        TrainOptions options;
        options.duration = duration;
        options.sample_interval = interval_of_samples;
        samples = options.samples = static_cast<std::size_t>(duration / interval_of_samples * (1.0 + 1e-12)) + 1;
        options.tolerance = tolerance;
        out.resize(run.channels().size() * samples);
        options.control = control;
        signals.resize(control.axes.size() * static_cast<std::size_t>(control.signals()) * samples);
        options.control_out = signals.data();
        report = run.run(inputs, start, memory, options, out.data());
    }
    bool done() const { return report.status == Status::done && !report.too_many_guards; }
    const double* channel(const std::string& name) const {
        for (std::size_t c = 0; c < run.channels().size(); ++c)
            if (run.channels()[c].name == name) return &out[c * samples];
        return nullptr;
    }
};

}  // namespace lostmotion::model
