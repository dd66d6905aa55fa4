// Periodic motions and responses of a train.
#pragma once

#include "../model/components.hpp"
#include "../simulation/sampler.hpp"
#include "../simulation/train_reader.hpp"
#include "../simulation/train_status.hpp"
#include "response.hpp"

namespace lostmotion {

template <class D>
std::vector<NamedComponent> train_components(const model::Assembly& a) {
    const model::Places& p = a.places();
    const model::Train& t = a.train();
    const std::vector<std::string> states = model::state_names(a);
    std::vector<NamedComponent> out;
    const std::vector<bool> moves = model::moved_states(a);
    for (int k = 0; k < a.layout().coupled; ++k)
        out.push_back({states[static_cast<std::size_t>(k)], k, !moves[static_cast<std::size_t>(k)]});
    for (int part = 0; part < a.layout().angles; ++part)
        if (p.shafts[p.last_shaft[part]].angle == model::nowhere)
            out.push_back({t.shafts[p.last_shaft[part]].name + "_angle", D::coupled + part, true});
    for (std::size_t g = 0; g < t.gears.size(); ++g)
        if (p.gears[g].hysteresis != model::nowhere)
            out.push_back({t.gears[g].name + "_hysteresis_capacity", D::states + p.gears[g].hysteresis, false});
    for (const model::ContactPlace& c : p.contacts)
        if (c.locked != model::nowhere)
            out.push_back(
                {(c.kind == model::ContactPlace::gear ? t.gears[c.element].name : p.couplings[c.element]->name) +
                     "_locked_torque",
                 D::states + c.locked, false});
    return out;
}

inline PowerChannels power_channels(const model::Assembly& a, const std::vector<TrainChannel>& channels) {
    const model::Train& t = a.train();
    const auto channel = [&](TrainChannel::Kind kind, int index) {
        std::size_t k = 0;
        while (channels[k].kind != kind || channels[k].index != index) ++k;
        return static_cast<int>(k);
    };
    const auto speed = [&](int shaft) { return channel(TrainChannel::state, a.places().shafts[shaft].speed); };
    PowerChannels out;
    for (std::size_t m = 0; m < t.motors.size(); ++m)
        out.motors.push_back({channel(TrainChannel::motor_torque, static_cast<int>(m)), speed(t.motors[m].shaft)});
    for (std::size_t g = 0; g < t.gears.size(); ++g) {
        const model::Gear& gear = t.gears[g];
        const bool last = std::none_of(t.gears.begin(), t.gears.end(),
                                       [&](const model::Gear& other) { return other.input == gear.output; });
        out.gears.push_back({{channel(TrainChannel::input_torque, static_cast<int>(g)), speed(gear.input)},
                             {channel(TrainChannel::output_torque, static_cast<int>(g)), speed(gear.output)},
                             last,
                             gear.housing == model::nowhere ? -1 : speed(gear.housing)});
    }
    return out;
}

template <class D>
class TrainPlant {
 public:
    using System = model::TrainSystem<D>;
    struct Workspace {
        explicit Workspace(const model::Assembly& a) : system(a), cache(system) {}
        StateOf<D> balanced_scale() const { return system.balanced_scale(); }

        System system;
        RegimeCache<System> cache;
    };
    using Model = typename TrainReader<D>::Model;

    explicit TrainPlant(const Model& m) : model_(m), powers_(power_channels(m.assembly, m.channels)) {
        for (std::size_t c = 0; c < m.channels.size(); ++c) numbers_.push_back(static_cast<int>(c));
    }

    std::size_t channels() const { return model_.channels.size(); }
    const PowerChannels& powers() const { return powers_; }
    SamplerOf<System, TrainReader<D>, Model> sampler(Workspace&, double interval, std::size_t count,
                                                     double* out) const {
        return {model_, 0.0, interval, count, out, numbers_};
    }
    bool spoiled(const Workspace& w) const { return w.system.overflowed(); }
    std::vector<NamedComponent> components() const { return train_components<D>(model_.assembly); }
    std::string error(const ResponseResultOf<System>& r) const {
        return train_status_text(model_.assembly, r.motion.status, r.motion.time, r.motion.contact, r.spoiled);
    }
    std::unique_ptr<Workspace> take() { return std::make_unique<Workspace>(model_.assembly); }
    void give_back(std::unique_ptr<Workspace>) {}

 private:
    const Model& model_;
    const PowerChannels powers_;
    std::vector<int> numbers_;
};

}  // namespace lostmotion
