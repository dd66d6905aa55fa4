#include "sample_tangent.hpp"

namespace lostmotion {

void SampleTangent::add(std::size_t c, const RegimeTangent& r, const double* w, const double* derivative,
                        double* to) const {
    if (const auto& f = r.channel[c]; f) {
        form_.add_own(r.channel_varied, static_cast<int>(c), w, 1.0, to);
        form_.add_motion(*f, derivative, 1.0, to);
    }
    if (channels_[c].kind == TrainChannel::input_torque)
        add_shared(static_cast<std::size_t>(channels_[c].index), r, w, derivative, to);
}

void SampleTangent::add_shared(std::size_t g, const RegimeTangent& t, const double* w, const double* derivative,
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
                           (other.loss(shared.driven, 0.0).torque / other.reduction() - shared.loss);
    }
}

}  // namespace lostmotion
