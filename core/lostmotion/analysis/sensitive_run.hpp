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

// Why the controllers of a run have no derivatives, or empty.
inline std::string check_derivatives(const Control& control, const std::vector<Variation>& variations) {
    for (const ControlledAxis& axis : control.axes) {
        if (axis.law.field_orientation)
            return "field-oriented control has no derivatives here; take a current loop of kind \"pi\"";
        if (axis.law.camera.present && axis.law.camera.step > 0.0)
            return "a camera of finite resolution has no derivative; leave its pixels out";
        for (const auto* encoder : {&axis.law.speed_sensor.encoder, &axis.law.position_sensor.encoder})
            if (encoder->resolution > 0.0 && encoder->error > 0.0)
                return "an encoder with a resolution and an interpolation error has no derivatives here; leave one of "
                       "them out";
    }
    for (const Variation& v : variations)
        for (const Neighbour& n : v.neighbours)
            if (n.control && !acts_at_the_same_instants(control, *n.control))
                return v.name + ": changes the instants at which a controller acts, which has no derivative";
    return "";
}

struct SensitiveCase {
    std::shared_ptr<const TrainRun> run;
    std::vector<Signal> inputs;
    TrainStart start;
    TrainOptions options;
    std::vector<Variation> variations;
};

// Runs of one train, each with its derivatives, by the exact solver. What their regimes are is found once for all.
template <class D>
class SensitiveRuns {
 public:
    explicit SensitiveRuns(const typename TrainReader<D>::Model& model) : model_(model), workspace_(model.assembly) {}

    // out: values, as TrainRun::run; output: derivatives of the same channels and instants.
    // The error of the variations in the message of the report.
    TrainReport operator()(const SensitiveCase& c, const TrainOptions& options, double* out,
                           SensitivityOutput& output) {
        const auto [x, memory] = c.run->in_layout(c.start);
        if (c.variations.empty())
            return run_train_exactly_in<D>(model_, c.inputs, x, memory, options, out, nullptr, &workspace_);
        TrainReport failed;
        const auto trains = std::make_shared<const VariedTrain>(*c.run, c.variations);
        const auto tangents = std::make_shared<const InputTangents>(c.run->assembly().layout(), c.inputs, c.variations);
        for (const std::string& error :
             {check_derivatives(options.control, c.variations), trains->error(), tangents->error()})
            if (!error.empty()) failed.message = error;
        if (!failed.message.empty()) return failed;
        output.times = options.times();
        if (!regimes_ || !regimes_->serve(*trains, *tangents, output.channels))
            regimes_.emplace(trains, tangents, output.channels);
        TrainSensitivity<D> watcher(*trains, *tangents, *regimes_, c.variations, c.start, options.control, output);
        return run_train_exactly_in<D>(model_, c.inputs, x, memory, options, out, &watcher, &workspace_);
    }

 private:
    const typename TrainReader<D>::Model& model_;
    TrainWorkspace<D> workspace_;
    std::optional<RegimeTangents> regimes_;
};

// One run by itself.
inline TrainReport run_with_derivatives(const SensitiveCase& c, double* out, SensitivityOutput& output) {
    return c.run->in_kernel([&]<class D>(const typename TrainReader<D>::Model& model) {
        return SensitiveRuns<D>(model)(c, c.options, out, output);
    });
}

}  // namespace lostmotion
