// What can be read of a train at an instant: the channels of a record.
#pragma once

#include <algorithm>
#include <array>
#include <string>
#include <vector>

#include "../kernel/stride.hpp"
#include "../model/names.hpp"
#include "../model/system.hpp"

namespace lostmotion {

// At a jump a channel has its right limit.
struct TrainChannel {
    enum Kind {
        input,
        state,
        motor_torque,
        output_torque,
        input_torque,
        contact_torque,
        contact_mode,
        output,
        error
    } kind;
    int index;  // of the input, state, motor, gear, contact or controller
    std::string name, unit, meaning;
};

// The inputs from this one on are those of the controllers.
std::size_t first_reference(const model::Assembly& a);

void add_controller_channels(const model::Assembly& a, int controller, std::vector<TrainChannel>& out);

std::vector<TrainChannel> train_channels(const model::Assembly& a);

// Reads the channels in one regime, as many instants at once as the instruction set holds numbers.
template <class D>
class TrainReader {
 public:
    using Memory = typename D::Memory;
    using Instants = InstantsOf<D>;
    // What a reader is made for.
    struct Model {
        const model::Assembly& assembly;
        std::vector<TrainChannel> channels;
    };

    TrainReader(const Model& m, const model::TrainRegime<D>& r, const Memory& memory)
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
        const auto form = [&](LinearFormOf<D> f) {  // by value: in registers
            const double constant = constant_part<D>(f, memory_);
            each([&](int k) { return evaluate(f, constant, at, k); });
        };
        switch (c.kind) {
            case TrainChannel::input: column(at.u[index]); return;
            case TrainChannel::state: {
                const int layout = model_.assembly.layout().coupled;
                column(at.x[c.index < layout ? index : D::coupled + index - static_cast<std::size_t>(layout)]);
                return;
            }
            case TrainChannel::motor_torque: form(row(regime_.rows.motor_torque[index])); return;
            case TrainChannel::output_torque: form(regime_.output_torque[index]); return;
            case TrainChannel::input_torque: {
                form(row(regime_.rows.input_torque[index]));
                const model::Gear& gear = model_.assembly.train().gears[index];
                const auto contact = static_cast<std::size_t>(
                    model_.assembly.places().shafts[static_cast<std::size_t>(gear.input)].contact);
                if (gear.has_dry_losses() && regime_.key.modes[contact] == 0)
                    each([&](int k) { return load(out + k) + shared_torque(gear, index, contact, at, k); });
                return;
            }
            case TrainChannel::output: form(row(model_.assembly.controller_command(c.index, regime_.key))); return;
            case TrainChannel::error: form(row(model_.assembly.controller_error(c.index))); return;
            case TrainChannel::contact_torque: form(regime_.contact_torque[index]); return;
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
    // Of an input shaft at rest, the torque that its contact holds is shared by what is dry there as the capacities
    // are: what is added to the torque on the gear.
    template <class Instants>
    Vec shared_torque(const model::Gear& gear, std::size_t index, std::size_t contact, const Instants& at,
                      int k) const {
        const Vec T_2 = evaluate(regime_.output_torque[index], at, k),
                  F = evaluate(regime_.contact_torque[contact], at, k);
        Vec margin[2];  // until it slips backward, forward
        for (int g = 0; g < regime_.n_guards; ++g)
            if (const auto& guard = regime_.guards[static_cast<std::size_t>(g)];
                guard.kind == model::Guard::capacity && guard.contact == static_cast<int>(contact))
                margin[guard.neighbour > 0] = evaluate(guard.form, at, k);
        Vec shared{};
        for (int lane = 0; lane < vec_width; ++lane) {
            const int s = F[lane] >= 0.0 ? 1 : -1;
            const double capacity = margin[s > 0][lane] + s * F[lane];
            if (capacity > 0.0)
                shared[lane] = F[lane] * gear.loss(s * T_2[lane], 0.0).torque / gear.law.ratio / capacity;
        }
        return shared;
    }

    LinearFormOf<D> row(const model::Row& r) const { return model::pack<D>(r, model_.assembly.layout()); }

    template <class Instants>
    Vec evaluate(const LinearFormOf<D>& f, const Instants& at, int k) const {
        return evaluate(f, constant_part<D>(f, memory_), at, k);
    }
    // None of the forms depends on an angle that follows.
    template <class Instants>
    static Vec evaluate(const LinearFormOf<D>& f, double constant, const Instants& at, int k) {
        const Vec own = sum_in_fours<D::coupled>([&](auto j) { return f.c[j] * load(&at.x[j][k]); });
        Vec forced = f.c[D::first_input] * load(&at.u[0][k]);
        for (int i = 1; i < D::inputs; ++i) forced += f.c[D::first_input + i] * load(&at.u[i][k]);
        return constant + own + forced;
    }

    const Model& model_;
    const model::TrainRegime<D>& regime_;
    const Memory& memory_;
};

}  // namespace lostmotion
