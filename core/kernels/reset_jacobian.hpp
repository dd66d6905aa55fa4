// The components of a train's motion, and how those that a switching sets anew depend on the ones before.
#pragma once

#include "locked_torques.hpp"
#include "lostmotion/model/periodic_angles.hpp"
#include "lostmotion/solver/components.hpp"
#include "system.hpp"

namespace lostmotion {

template <class D>
class ComponentLaws<model::TrainSystem<D>> {
 public:
    using System = model::TrainSystem<D>;
    using State = StateOf<D>;
    using Memory = typename D::Memory;
    using Components = ComponentsOf<D>;
    using Locked = model::LockedTorque<LinearForm>;

    explicit ComponentLaws(const System& system)
        : assembly_(system.assembly()),
          counts_(system.counts()),
          angles_(model::periodic_angles(assembly_)),
          locked_(system) {
        each_component<D>(system.counts(), [&](int k) { neutral_[k] = true; });
        for (int k = 0; k < assembly_.layout().coupled; ++k) neutral_[k] = false;
        for (std::size_t g = 0; g < gears().size(); ++g)
            if (const int h = gears()[g].hysteresis; h != model::nowhere)
                set_torque(h, assembly_.train().gears[g].law.rated_output_torque);
        for (const model::ContactPlace& c : contacts())
            if (c.locked != model::nowhere) set_torque(c.locked, model::rated_torque(assembly_.train(), c.turned()));
    }

    // The turns of angles follow from these.
    bool neutral(int k) const { return neutral_[k] != 0; }
    bool matters(const model::Key& key, int k) const {
        for (std::size_t c = 0; c < contacts().size(); ++c)
            if (contacts()[c].locked != model::nowhere && D::states + contacts()[c].locked == k)
                return ties(key.modes).redundant[c];
        return true;
    }
    double magnitude(int k) const { return magnitude_[k - D::states]; }
    double change(int k, double from, double to) const {
        for (const model::PeriodicAngle& a : angles_)
            if (a.state == k) return a.change(from, to);
        return to - from;
    }
    void add(State& x, Memory& memory, int k, double change) const {
        if (k < D::states) {
            x[k] += change;
            return;
        }
        double& torque = memory[k - D::states];
        torque += change;
        for (const model::GearPlace& g : gears())
            if (D::states + g.hysteresis == k && g.hysteresis != model::nowhere) torque = std::fmax(0.0, torque);
    }
    void rewind(State& x, Memory& memory) const {
        for (int j = 0; j < assembly_.layout().angles; ++j) x[D::coupled + j] = 0.0;
        for (const model::PeriodicAngle& a : angles_) a.rewind(x, memory);
    }
    void direct(const State& x, model::Key& key) const {
        for (std::size_t c = 0; c < contacts().size(); ++c) {
            if (key.modes[c] == 0 || contacts()[c].one_way) continue;
            const model::Row form = assembly_.contact_speed(static_cast<int>(c));
            double speed = 0.0;
            for (int k = 0; k < assembly_.layout().coupled; ++k) speed += form.c[k] * x[k];
            if (speed != 0.0) key.modes[c] = speed > 0.0 ? +1 : -1;
        }
    }
    std::vector<Components> constraints(const model::Key& key) const {
        std::vector<Components> out;
        for (const model::Row& r : model::geometric_constraints(assembly_, key))
            out.push_back(gradient<D>(model::OwnForm(r, assembly_.layout())));
        return out;
    }

    // Speeds that stop or follow another, hysteresis at turning points, locked torques. A period that an angle begins
    // anew moves its turn by a constant.
    ResetRatesOf<D> reset(const ResetOf<System>& r, JacobianOf<D>& jump) const {
        std::vector<std::int8_t> modes(contacts().size());
        for (std::size_t c = 0; c < contacts().size(); ++c) modes[c] = r.before.at_rest[c] ? 0 : 1;
        if (r.switching.guard >= 0 && r.switching.kind == model::Guard::speed) modes[r.switching.contact] = 0;
        const model::Ties t = ties(modes), rest = ties(r.after.key.modes);
        const auto& shafts = assembly_.places().shafts;
        for (std::size_t s = 0; s < shafts.size(); ++s) {
            const int shaft = static_cast<int>(s);
            if (!t.at_rest[s] && !t.follows(shaft) && !rest.at_rest[s]) continue;
            jump.row[shafts[s].speed] = {};
            if (rest.at_rest[s]) continue;  // also where a gear has locked
            t.each_share(shaft, [&](int k, double share) { jump.row[shafts[s].speed][shafts[k].speed] = share; });
        }
        for (std::size_t g = 0; g < gears().size(); ++g) {
            const model::GearPlace& p = gears()[g];
            if (p.hysteresis == model::nowhere || r.before.at_rest[p.contact]) continue;
            if (!model::kept_at_rest(contacts()[p.contact], t)) continue;
            jump.row[D::states + p.hysteresis] = {};
            jump.row[D::states + p.hysteresis][p.twist] =
                assembly_.stiffness_factor(static_cast<int>(g), r.before.key) *
                assembly_.train().gears[g].law.hysteresis_capacity_slope(r.x[p.twist]);
        }
        ResetRatesOf<D> rates;
        bool some_locked = false;
        for (const model::ContactPlace& c : contacts()) {
            if (c.locked == model::nowhere) continue;
            jump.row[D::states + c.locked] = {};
            some_locked = true;
        }
        // Such a torque may be shown although there is none.
        if (!some_locked && !assembly_.train().aliases.empty()) jump.row[D::states + 1] = {};
        hold(r, jump, rates);
        return rates;
    }

 private:
    const std::vector<model::ContactPlace>& contacts() const { return assembly_.places().contacts; }
    const std::vector<model::GearPlace>& gears() const { return assembly_.places().gears; }
    template <class Modes>
    model::Ties ties(const Modes& modes) const {
        return assembly_.places().ties(modes);
    }
    void set_torque(int memory, double magnitude) {
        neutral_[D::states + memory] = false;
        magnitude_[memory] = magnitude;
    }

    // How the torques that rest leaves open depend on what was before.
    void hold(const ResetOf<System>& r, JacobianOf<D>& jump, ResetRatesOf<D>& rates) const {
        const auto hold = locked_.find(r);
        rates.exact = hold.has_value();
        if (!hold) return;
        Components row;
        double by_time;
        const auto add_before = [&](int contact, double share) {
            const LinearForm& was = locked_.torque(r.before, contact);
            const Components g = gradient<D>(was);
            each_component<D>(counts_, [&](int i) { row[i] += share * g[i]; });
            by_time += share * input_part(was, r.input[1]);
        };
        const auto add_now = [&](const LinearForm& form, double factor) {
            const Components g = gradient<D>(form);
            by_time += factor * input_part(form, r.input_after[1]);
            each_component<D>(counts_, [&](int j) {
                if (g[j] == 0.0) return;
                each_component<D>(counts_, [&](int i) { row[i] += factor * g[j] * jump.row[j][i]; });
                by_time += factor * g[j] * rates.by_time[j];
            });
        };
        const auto set = [&](const Locked& l, auto&& add) {
            row = {};
            by_time = 0.0;
            add();
            jump.row[D::states + l.memory] = row;
            rates.by_time[D::states + l.memory] = by_time;
        };
        const typename System::Regime& in = hold->at_limit ? *hold->at_limit : r.after;
        for (const Locked& l : in.locked) set(l, [&] { add_before(l.contact, 1.0); });
        for (std::size_t k = 0; k < in.locked.size(); ++k) {
            const Locked& l = in.locked[k];
            if (hold->bounds[k] == model::Bound::none) continue;
            set(l, [&] {
                if (!l.each_form(hold->bounds[k], add_now)) return;
                for (std::size_t c = 0; c < contacts().size(); ++c)
                    if (l.needs_torque[c] != 0.0) add_before(static_cast<int>(c), l.needs_torque[c]);
            });
        }
        locked_.each_given(*hold, r.after,
                           [&](const Locked& l) { set(l, [&] { add_now(locked_.torque(in, l.contact), 1.0); }); });
    }

    const model::Assembly& assembly_;
    const CountsOf<D> counts_;
    const std::vector<model::PeriodicAngle> angles_;
    const LockedTorques<D> locked_;
    ByComponent<D, char> neutral_{};
    Memory magnitude_{};
};

}  // namespace lostmotion
