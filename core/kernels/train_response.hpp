// Periodic motions and responses of a train.
#pragma once

#include "lostmotion/simulation/train_status.hpp"
#include "reset_jacobian.hpp"
#include "response.hpp"
#include "sampler.hpp"
#include "train_solving.hpp"

namespace lostmotion {

template <class D>
std::vector<NamedComponent> train_components(const model::Assembly& a) {
    const model::Places& p = a.places();
    const model::Train& t = a.train();
    const std::vector<std::string> states = model::state_names(a);
    std::vector<NamedComponent> out;
    const std::vector<bool> moves = model::moved_states(a);
    for (int k = 0; k < a.layout().coupled; ++k)
        out.push_back({states[static_cast<std::size_t>(k)], k,
                       !moves[static_cast<std::size_t>(k)] &&
                           model::place_in_tables(t, states[static_cast<std::size_t>(k)]) == t.aliases.size()});
    for (int part = 0; part < a.layout().angles; ++part)
        if (p.shafts[p.last_shaft[part]].angle == model::nowhere)
            out.push_back({model::angle_of(t, static_cast<std::size_t>(p.last_shaft[part])), D::coupled + part, true});
    int free = a.layout().memory;  // for what has an alias, but no place
    const auto add = [&](const std::string& name, int memory) {
        if (memory == model::nowhere && model::has_alias(t, name)) memory = free++;
        if (memory != model::nowhere) out.push_back({model::shown_name(t, name), D::states + memory, false});
    };
    for (std::size_t g = 0; g < t.gears.size(); ++g)
        add(model::gear_name(t, g, "hysteresis_capacity"), p.gears[g].hysteresis);
    for (std::size_t g = 0; g < t.gears.size(); ++g)
        if (p.gears[g].contact == model::nowhere) add(model::gear_name(t, g, "locked_torque"), model::nowhere);
    for (const model::ContactPlace& c : p.contacts)
        if (c.kind != model::ContactPlace::shaft)
            add(c.kind == model::ContactPlace::gear
                    ? model::gear_name(t, static_cast<std::size_t>(c.element), "locked_torque")
                    : p.name_of(c) + "_locked_torque",
                c.locked);
    return out;
}

template <class D>
class TrainPlant {
 public:
    using System = model::TrainSystem<D>;
    using Workspace = TrainWorkspace<D>;

    explicit TrainPlant(const TrainModel& m) : model_(m), powers_(power_channels(m.assembly, m.channels)) {
        for (std::size_t c = 0; c < m.channels.size(); ++c) numbers_.push_back(static_cast<int>(c));
    }

    std::size_t channels() const { return model_.channels.size(); }
    const PowerChannels& powers() const { return powers_; }
    SamplerOf<System, TrainReader<D>> sampler(Workspace&, double interval, std::size_t count, double* out) const {
        return {model_, {interval, count}, out, numbers_};
    }
    bool spoiled(const Workspace& w) const { return w.system.overflowed(); }
    std::vector<NamedComponent> components() const { return train_components<D>(model_.assembly); }
    std::string error(const ResponseResultOf<System>& r) const {
        return train_status_text(model_.assembly, r.motion.status, r.motion.time, r.motion.contact, r.spoiled);
    }
    std::unique_ptr<Workspace> take() { return std::make_unique<Workspace>(model_.assembly); }
    void give_back(std::unique_ptr<Workspace>) {}

 private:
    const TrainModel& model_;
    const PowerChannels powers_;
    std::vector<int> numbers_;
};

template <class D>
ResponseTable respond_train_in(const TrainModel& model, const std::vector<ResponseRequest>& points,
                               const ResponseSpec& spec, unsigned threads, const Waiting& waiting) {
    TrainPlant<D> plant(model);
    const auto start = [&](const Named& named) {
        StartOf<D> s;
        for (const NamedComponent& c : plant.components())
            if (const auto given = named.find(c.name); given != named.end())
                (c.place < D::states ? s.x[c.place] : s.memory[static_cast<std::size_t>(c.place - D::states)]) =
                    given->second;
        return s;
    };
    return respond_by_name(plant, points, start, spec, threads, waiting);
}

}  // namespace lostmotion
