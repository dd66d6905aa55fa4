#include "regime_tangent.hpp"

namespace lostmotion {

std::optional<model::Row> channel_form(const model::Assembly& a, const model::Regime& r, const TrainChannel& c) {
    const auto k = static_cast<std::size_t>(c.index);
    switch (c.kind) {
        case TrainChannel::input: return model::Row::unit(a.layout().first_input + c.index);
        case TrainChannel::state: return model::Row::unit(c.index);
        case TrainChannel::motor_torque: return r.motor_torque[k];
        case TrainChannel::output_torque: return r.output_torque[k];
        case TrainChannel::input_torque: return r.input_torque[k];
        case TrainChannel::contact_torque: return r.contact_torque[k];
        case TrainChannel::drive_torque: return r.drive_torque[k];
        case TrainChannel::massless_speed: return r.massless[k].form;
        case TrainChannel::output: return a.controller_command(c.index, r.key);
        case TrainChannel::pressing_torque: return a.pressing_torque(c.index, r.key);
        case TrainChannel::field_lead: return a.field_lead(c.index);
        case TrainChannel::error: return a.controller_error(c.index);
        default: return std::nullopt;
    }
}

auto RegimeTangents::operator()(const model::Key& key) -> RegimeTangent& {
    if (last_ != nullptr && last_->regime.key == key) return *last_;
    std::unique_ptr<RegimeTangent>& t = all_[key];
    if (!t) t = compose(key);
    return *(last_ = t.get());
}

void RegimeTangents::prepare(RegimeTangent& t, double base) const {
    const model::Layout& n = layout();
    const int size = inputs_.size(), parameters = inputs_.parameters();
    std::vector<double> M(static_cast<std::size_t>(size) * static_cast<std::size_t>(size));
    Varied dM(size, size, parameters);
    inputs_.add_rates(M, dM);
    for (int r = 0; r < n.states; ++r)
        inputs_.each_term([&](int at, int term) {
            M[static_cast<std::size_t>(r * size + at)] = t.regime.rate[static_cast<std::size_t>(r)].c[term];
            std::copy_n(t.rate.at(r, term), parameters, dM.at(r, at));
        });
    while (inputs_.fastest() * base > 0.25) base *= 0.5;
    t.propagator.prepare(size, inputs_.moves() ? size : n.states, inputs_.frequency_varies() ? size : n.states,
                         std::move(M), std::move(dM), base);
}

auto RegimeTangents::compose(const model::Key& key) const -> std::unique_ptr<RegimeTangent> {
    auto t = std::make_unique<RegimeTangent>();
    trains_.base().build(key, t->regime);
    const model::Regime& r = t->regime;
    const int terms = layout().terms, parameters = inputs_.parameters();
    const auto room = [&](std::size_t rows) { return Varied(static_cast<int>(rows), terms, parameters); };
    t->rate = room(r.rate.size());
    t->guard = room(r.guards.size());
    t->output_torque = room(r.output_torque.size());
    t->contact_torque = room(r.contact_torque.size());
    t->locked = room(r.locked.size() * n_locked_forms);
    t->needs_torque = Varied(static_cast<int>(r.locked.size()), layout().contacts, parameters);
    t->channel_varied = room(channels_.size());
    t->shift = Varied(static_cast<int>(r.guards.size()), 1, parameters);
    for (const TrainChannel& c : channels_) t->channel.push_back(channel_form(trains_.base(), r, c));
    for (const VariedTrain::Beside& b : trains_.beside()) add(*t, b);
    return t;
}

void RegimeTangents::add(RegimeTangent& t, const VariedTrain::Beside& b) const {
    const model::Regime at = b.assembly().build(t.regime.key);
    const model::Regime& r = t.regime;
    const auto note = [&](Varied& to, std::size_t row, const model::Row& from, const model::Row& f) {
        for (int k = 0; k < layout().terms; ++k)
            to.at(static_cast<int>(row), k)[b.parameter] += b.weight * (f.c[k] - from.c[k]);
    };
    t.alike = t.alike && r.guards.size() == at.guards.size() && r.solvable == at.solvable &&
              r.locked.size() == at.locked.size();
    for (std::size_t k = 0; k < r.rate.size(); ++k) note(t.rate, k, r.rate[k], at.rate[k]);
    for (std::size_t g = 0; g < r.guards.size() && t.alike; ++g) {
        const model::Guard &one = r.guards[g], &other = at.guards[g];
        t.alike = one.kind == other.kind && one.contact == other.contact && one.branch == other.branch &&
                  one.neighbour == other.neighbour;
        note(t.guard, g, one.form, other.form);
        t.shift.at(static_cast<int>(g), 0)[b.parameter] += b.weight * (other.shift - one.shift);
    }
    for (std::size_t k = 0; k < r.output_torque.size(); ++k)
        note(t.output_torque, k, r.output_torque[k], at.output_torque[k]);
    for (std::size_t k = 0; k < r.contact_torque.size(); ++k)
        note(t.contact_torque, k, r.contact_torque[k], at.contact_torque[k]);
    for (std::size_t k = 0; k < r.locked.size() && t.alike; ++k) {
        const auto own = locked_forms(r.locked[k]), other = locked_forms(at.locked[k]);
        for (std::size_t f = 0; f < n_locked_forms; ++f) note(t.locked, k * n_locked_forms + f, *own[f], *other[f]);
        for (int c = 0; c < layout().contacts; ++c)
            t.needs_torque.at(static_cast<int>(k), c)[b.parameter] +=
                b.weight * (at.locked[k].needs_torque[c] - r.locked[k].needs_torque[c]);
    }
    for (std::size_t c = 0; c < channels_.size(); ++c)
        if (t.channel[c]) note(t.channel_varied, c, *t.channel[c], *channel_form(b.assembly(), at, channels_[c]));
}

}  // namespace lostmotion
