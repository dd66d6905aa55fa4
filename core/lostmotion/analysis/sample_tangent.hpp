// How what a record shows of a train depends on parameters, at one instant.
#pragma once

#include "reset_tangent.hpp"

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
        if (const int g = shared(channels_[c], r); g >= 0)
            add_shared(static_cast<std::size_t>(g), r, w, derivative, to);
    }

 private:
    // Of an input torque: its gear, if its input shaft is at rest and what that holds is shared by what is dry there;
    // -1.
    int shared(const TrainChannel& c, const RegimeTangent& r) const {
        if (c.kind != TrainChannel::input_torque) return -1;
        const model::Gear& gear = trains_.base().train().gears[static_cast<std::size_t>(c.index)];
        const int contact = trains_.base().places().shafts[static_cast<std::size_t>(gear.input)].contact;
        return gear.has_dry_losses() && r.regime.key.modes[static_cast<std::size_t>(contact)] == 0 ? c.index : -1;
    }
    // What the contact of the input shaft holds is shared as the capacities are, T_1 + F l/C; see TrainReader. to: the
    // derivatives of T_1.
    void add_shared(std::size_t g, const RegimeTangent& t, const double* w, const double* derivative,
                    double* to) const {
        const model::Train& train = trains_.base().train();
        const model::Gear& gear = train.gears[g];
        const model::Regime& r = t.regime;
        const int contact = trains_.base().places().shafts[static_cast<std::size_t>(gear.input)].contact;
        const model::Row &friction = r.contact_torque[static_cast<std::size_t>(contact)], &output = r.output_torque[g];
        const double F = form_.value(friction, w), T_2 = form_.value(output, w);
        const int s = F >= 0.0 ? 1 : -1;
        std::size_t margin = 0;
        while (r.guards[margin].kind != model::Guard::capacity || r.guards[margin].contact != contact ||
               (r.guards[margin].neighbour > 0) != (s > 0))
            ++margin;
        const double C = form_.value(r.guards[margin].form, w) + s * F;
        if (!(C > 0.0)) return;
        const model::MeshLoss loss = gear.loss(s * T_2, 0.0);
        const double l = loss.torque / gear.law.ratio, own = F * l / (C * C);
        const double by_friction = l / C - s * own, by_output = F * s * loss.per_torque / (gear.law.ratio * C);
        form_.add_own(t.contact_torque, contact, w, by_friction, to);
        form_.add_motion(friction, derivative, by_friction, to);
        form_.add_own(t.output_torque, static_cast<int>(g), w, by_output, to);
        form_.add_motion(output, derivative, by_output, to);
        form_.add_own(t.guard, static_cast<int>(margin), w, -own, to);
        form_.add_motion(r.guards[margin].form, derivative, -own, to);
        for (const VariedTrain::Beside& b : trains_.beside()) {
            const model::Gear& other = b.assembly().train().gears[g];
            to[b.parameter] += b.weight * F / C * (other.loss(s * T_2, 0.0).torque / other.law.ratio - l);
        }
    }

    const VariedTrain& trains_;
    const FormTangent& form_;
    const std::vector<TrainChannel>& channels_;
};

}  // namespace lostmotion
