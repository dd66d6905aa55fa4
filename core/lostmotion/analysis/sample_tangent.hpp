// How what a record shows of a train depends on parameters, at one instant.
#pragma once

#include "reset_tangent.hpp"
#include "shared_torque.hpp"

namespace lostmotion {

class SampleTangent {
 public:
    SampleTangent(const VariedTrain& trains, const FormTangent& form, const RegimeTangents& regimes)
        : trains_(trains), form_(form), channels_(regimes.channels()) {}

    // Adds the derivatives of a channel, by its place among those of the regimes.
    void add(std::size_t c, const RegimeTangent& r, const double* w, const double* derivative, double* to) const {
        if (const auto& f = r.channel[c]; f) {
            form_.add_own(r.channel_varied, static_cast<int>(c), w, 1.0, to);
            form_.add_motion(*f, derivative, 1.0, to);
        }
        if (channels_[c].kind == TrainChannel::input_torque)
            add_shared(static_cast<std::size_t>(channels_[c].index), r, w, derivative, to);
    }

 private:
    // Of an input shaft at rest. to: the derivatives of the torque on it.
    void add_shared(std::size_t g, const RegimeTangent& t, const double* w, const double* derivative,
                    double* to) const {
        const SharedTorque shared =
            shared_torque(trains_.base(), t.regime, g, [&](const model::Row& f) { return form_.value(f, w); });
        if (shared.margin == nullptr) return;
        form_.add_own(t.contact_torque, shared.margin->contact, w, shared.by_friction, to);
        form_.add_motion(*shared.friction, derivative, shared.by_friction, to);
        form_.add_own(t.output_torque, static_cast<int>(g), w, shared.by_output, to);
        form_.add_motion(*shared.output, derivative, shared.by_output, to);
        form_.add_own(t.guard, static_cast<int>(shared.margin - t.regime.guards.data()), w, shared.by_margin, to);
        form_.add_motion(shared.margin->form, derivative, shared.by_margin, to);
        for (const VariedTrain::Beside& b : trains_.beside()) {
            const model::Gear& other = b.assembly().train().gears[g];
            to[b.parameter] += b.weight * shared.held / shared.capacity *
                               (other.loss(shared.driven, 0.0).torque / other.law.ratio - shared.loss);
        }
    }

    const VariedTrain& trains_;
    const FormTangent& form_;
    const std::vector<TrainChannel>& channels_;
};

}  // namespace lostmotion
