// The channels of a train, as a kernel reads them.
#pragma once

#include <algorithm>
#include <array>
#include <vector>

#include "lostmotion/kernel/stride.hpp"
#include "lostmotion/simulation/train_point.hpp"
#include "system.hpp"

namespace lostmotion {

// Reads the channels in one regime, as many instants at once as the instruction set holds numbers.
template <class D>
class TrainReader {
 public:
    using Memory = typename D::Memory;
    using Instants = InstantsOf<D>;

    TrainReader(const TrainModel& m, const model::SparseRegime& r, const Memory& memory)
        : model_(m), regime_(r), memory_(memory) {}

    // A channel at the first n instants, rounded up to whole vectors.
    template <class Instants>
    void read(int channel, const Instants& at, int n, double* out) const {
        const TrainChannel& c = model_.channels[static_cast<std::size_t>(channel)];
        const auto index = static_cast<std::size_t>(c.index);
        const auto each = [&](auto&& value) {
            for (int k = 0; k < n; k += vec_width) store(value(k), out + k);
        };
        const auto column = [&](const auto& numbers) { each([&](int k) { return load(&numbers[k]); }); };
        const auto form = [&](const LinearForm& f) {
            const double constant = constant_part(f, memory_);
            each([&](int k) { return evaluate(f, constant, at, k); });
        };
        switch (c.kind) {
            case TrainChannel::input: column(at.u[index]); return;
            case TrainChannel::state: column(at.x[model::state_place<D>(model_.assembly.layout(), c.index)]); return;
            case TrainChannel::motor_torque: form(regime_.motor_torque[index]); return;
            case TrainChannel::output_torque: form(regime_.output_torque[index]); return;
            case TrainChannel::input_torque:
                form(regime_.input_torque[index]);
                if (shares(index)) {
                    const auto friction = row(model_.assembly.held_friction(gear(index).input, regime_.key));
                    each([&](int k) { return load(out + k) + shared_torque(index, friction, at, k); });
                }
                return;
            case TrainChannel::loss_coefficient:
                form(regime_.mesh_loss[index]);
                each([&](int k) { return loss_coefficient(index, load(out + k), at, k); });
                return;
            case TrainChannel::output: form(row(model_.assembly.controller_command(c.index, regime_.key))); return;
            case TrainChannel::error: form(row(model_.assembly.controller_error(c.index))); return;
            case TrainChannel::field_lead: form(row(model_.assembly.field_lead(c.index))); return;
            case TrainChannel::pressing_torque:
                form(row(model_.assembly.pressing_torque(c.index, regime_.key)));
                return;
            case TrainChannel::drive_torque: form(regime_.drive_torque[index]); return;
            case TrainChannel::massless_speed: form(regime_.massless_speed[index]); return;
            case TrainChannel::contact_torque: form(regime_.contact_torque[index]); return;
            case TrainChannel::shaft_sign: each([&](int k) { return signs(speed(c.index, at, k)); }); return;
            case TrainChannel::twist_sign: each([&](int k) { return signs(twist_rate(index, at, k)); }); return;
            default: std::fill_n(out, n, regime_.at_rest[index] ? 0.0 : static_cast<double>(regime_.key.modes[index]));
        }
    }
    // All channels of one instant.
    std::vector<double> operator()(const StateOf<D>& x, const InputsOf<D>& u) const {
        InstantsOf<D, vec_width> at;
        at.set(0, load(x), u);
        std::vector<double> out;
        for (std::size_t c = 0; c < model_.channels.size(); ++c) out.push_back(first(static_cast<int>(c), at));
        return out;
    }
    // A channel at the first instant.
    template <class Instants>
    double first(int channel, const Instants& at) const {
        std::array<double, vec_width> value;
        read(channel, at, 1, value.data());
        return value[0];
    }

 private:
    const model::Gear& gear(std::size_t k) const { return model_.assembly.train().gears[k]; }
    const model::ShaftPlace& place(int shaft) const {
        return model_.assembly.places().shafts[static_cast<std::size_t>(shaft)];
    }
    template <class Instants>
    Vec speed(int shaft, const Instants& at, int k) const {
        if (const int massless = place(shaft).massless; massless != model::nowhere)
            return evaluate(regime_.massless_speed[static_cast<std::size_t>(massless)], at, k);
        return load(&at.x[place(shaft).speed][k]);
    }
    template <class Instants>
    Vec twist_rate(std::size_t k, const Instants& at, int n) const {
        return speed(gear(k).input, at, n) / gear(k).law.ratio - speed(gear(k).output, at, n);
    }
    static Vec signs(Vec v) {
        const Vec zero{}, one = zero + 1.0;
        return chosen(v > zero, one, chosen(v < zero, -one, zero));
    }

    // Of an input shaft at rest, the torque that its contact holds is shared by what is dry there as the capacities
    // are.
    bool shares(std::size_t k) const {
        return gear(k).has_dry_losses() &&
               regime_.key.modes[static_cast<std::size_t>(place(gear(k).input).contact)] == 0;
    }
    template <class Instants>
    Vec held(std::size_t k, const Instants& at, int n) const {
        return evaluate(regime_.contact_torque[static_cast<std::size_t>(place(gear(k).input).contact)], at, n);
    }
    // What is added to the torque on the gear. friction: that its input shaft holds, without gears.
    template <class Instants>
    Vec shared_torque(std::size_t index, const LinearForm& friction, const Instants& at, int k) const {
        const Vec F = held(index, at, k);
        Vec capacity = evaluate(friction, at, k), own{};
        for (std::size_t g = 0; g < model_.assembly.train().gears.size(); ++g) {
            if (gear(g).input != gear(index).input || !gear(g).has_dry_losses()) continue;
            const Vec loss = loss_at_rest(g, F, at, k) / gear(g).reduction();
            capacity += loss;
            if (g == index) own = loss;
        }
        Vec shared{};
        for (int lane = 0; lane < vec_width; ++lane)
            if (capacity[lane] > 0.0) shared[lane] = F[lane] * own[lane] / capacity[lane];
        return shared;
    }
    // What a gear at rest holds at most at its output in the direction of F, the torque that is held.
    template <class Instants>
    Vec loss_at_rest(std::size_t index, Vec F, const Instants& at, int k) const {
        Vec loss = evaluate(regime_.output_torque[index], at, k);
        for (int lane = 0; lane < vec_width; ++lane)
            loss[lane] = gear(index).loss_at_rest(gear(index).sense() * (F[lane] >= 0.0 ? loss[lane] : -loss[lane]));
        return loss;
    }
    // From the loss of a speed forward.
    template <class Instants>
    Vec loss_coefficient(std::size_t index, Vec lost, const Instants& at, int k) const {
        const int shaft = gear(index).input;
        if (shares(index))
            lost = loss_at_rest(index, held(index, at, k), at, k);
        else if (gear(index).has_dry_losses())
            lost *= static_cast<double>(regime_.key.modes[static_cast<std::size_t>(place(shaft).contact)]);
        else
            lost *= signs(speed(shaft, at, k));
        return lost / gear(index).law.rated_output_torque;
    }

    model::OwnForm row(const model::Row& r) const { return {r, model_.assembly.layout()}; }

    template <class Instants>
    Vec evaluate(const LinearForm& f, const Instants& at, int k) const {
        return evaluate(f, constant_part(f, memory_), at, k);
    }
    // None of the forms depends on an angle that follows.
    template <class Instants>
    static Vec evaluate(const LinearForm& f, double constant, const Instants& at, int k) {
        const Vec own =
            f.sum_of_coupled([&](int j, double c) { return c * load(&at.x[j][static_cast<std::size_t>(k)]); });
        Vec forced{};
        for (const auto& [i, c] : f.of_inputs())
            forced += c * load(&at.u[static_cast<std::size_t>(i)][static_cast<std::size_t>(k)]);
        return constant + own + forced;
    }

    const TrainModel& model_;
    const model::SparseRegime& regime_;
    const Memory& memory_;
};

template <class D>
TrainPoint point_of(const TrainModel& model, const model::SparseRegime& r, double time, const StateOf<D>& x,
                    const typename D::Memory& memory, const InputsOf<D>& u) {
    const model::Layout& n = model.assembly.layout();
    TrainPoint p;
    p.now.time = time;
    p.now.x.reach(static_cast<std::size_t>(n.states));
    model::unpack_state<D>(x, n, p.now.x.begin());
    for (int k = 0; k < n.memory; ++k) p.now.memory[k] = memory[k];
    for (int i = 0; i < n.inputs; ++i) p.now.input[0][i] = u[i];
    p.key = r.key;
    p.values = TrainReader<D>(model, r, memory)(x, u);
    return p;
}

}  // namespace lostmotion
