// Runs of trains with their derivatives.
#pragma once

#include <limits>
#include <string>
#include <vector>

#include "train_sensitivity.hpp"

namespace lostmotion {

// Ticks, delays and schedules that differ beside the value of a parameter have no derivative.
inline bool acts_at_the_same_instants(const Control& a, const Control& b) {
    const auto same = [](const control::Schedule& s, const control::Schedule& t) {
        return s.every == t.every && s.phase == t.phase;
    };
    if (a.tick != b.tick || a.axes.size() != b.axes.size()) return false;
    const std::vector<control::Axis> one = a.laws(), other = b.laws();
    for (std::size_t k = 0; k < one.size(); ++k) {
        const control::Axis &s = one[k], &t = other[k];
        if (s.slots() != t.slots() || s.delay.ticks != t.delay.ticks || !same(s.speed_schedule, t.speed_schedule) ||
            !same(s.position_schedule, t.position_schedule) || !same(s.current_schedule, t.current_schedule))
            return false;
    }
    return true;
}

// By the exact solver. out: values, as TrainRun::run; output: derivatives of the same channels and instants.
// The error of the variations in the message of the report.
inline TrainReport run_with_derivatives(const TrainRun& run, const std::vector<Signal>& inputs, const TrainStart& start,
                                        const std::vector<Variation>& variations, const TrainOptions& options,
                                        double* out, SensitivityOutput& output) {
    TrainReport failed;
    for (const ControlledAxis& axis : options.control.axes) {
        if (axis.law.field_orientation)
            failed.message = "field-oriented control has no derivatives here; take a current loop of kind \"pi\"";
        if (axis.law.camera.present && axis.law.camera.step > 0.0)
            failed.message = "a camera of finite resolution has no derivative; leave its pixels out";
        for (const auto* encoder : {&axis.law.speed_sensor.encoder, &axis.law.position_sensor.encoder})
            if (encoder->resolution > 0.0 && encoder->error > 0.0)
                failed.message =
                    "an encoder with a resolution and an interpolation error has no derivatives here; leave one of "
                    "them out";
    }
    for (const Variation& v : variations)
        for (const Neighbour& n : v.neighbours)
            if (n.control && !acts_at_the_same_instants(options.control, *n.control))
                failed.message = v.name + ": changes the instants at which a controller acts, which has no derivative";
    const VariedTrain trains(run.assembly(), variations);
    const InputTangents tangents(run.assembly().layout(), inputs, variations);
    for (const std::string& error : {trains.error(), tangents.error()})
        if (!error.empty()) failed.message = error;
    if (!failed.message.empty()) return failed;
    output.interval = options.sample_interval;
    output.samples = options.samples;
    std::vector<TrainChannel> channels;
    for (const int c : output.channels) channels.push_back(run.channels()[static_cast<std::size_t>(c)]);
    const auto [x, memory] = run.in_layout(start);
    return run.in_kernel([&, &x = x, &memory = memory]<class D>(const typename TrainReader<D>::Model& model) {
        RegimeTangents regimes(trains, tangents, channels);
        TrainSensitivity<D> watcher(trains, tangents, regimes, variations, start, options.control, output);
        return run_train_exactly_in<D>(model, inputs, x, memory, options, out, &watcher);
    });
}

}  // namespace lostmotion
