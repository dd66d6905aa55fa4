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
inline std::size_t first_reference(const model::Assembly& a) {
    const auto& all = a.places().controllers;
    return static_cast<std::size_t>(all.empty() ? a.layout().inputs : all[0].reference);
}

inline void add_controller_channels(const model::Assembly& a, int controller, std::vector<TrainChannel>& out) {
    using C = TrainChannel;
    const auto k = static_cast<std::size_t>(controller);
    const model::LinearController& c = a.train().controllers[k];
    const model::ControllerPlace& p = a.places().controllers[k];
    const std::string unit = c.compared.kind == model::LinearController::Signal::angle ? "rad" : "rad/s";
    out.push_back({C::output, controller, c.name + "_command", "", "command that the controller gives"});
    out.push_back({C::input, p.reference, c.name + "_reference", unit, "reference of the controller"});
    out.push_back({C::error, controller, c.name + "_error", unit, "reference less what is measured"});
    if (p.reference_rate != model::nowhere)
        out.push_back({C::input, p.reference_rate, c.name + "_reference_rate", unit + (unit == "rad" ? "/s" : "^2"),
                       "rate of the reference"});
    for (std::size_t j = 0; j < c.states.size(); ++j)
        out.push_back(
            {C::state, p.first_state + static_cast<int>(j), c.name + "_" + c.states[j], "", "state of the controller"});
}

inline std::vector<TrainChannel> train_channels(const model::Assembly& a) {
    using C = TrainChannel;
    const model::Train& t = a.train();
    const model::Places& p = a.places();
    std::vector<C> out;
    const auto inputs = model::input_names(a);
    for (std::size_t k = 0; k < inputs.size(); ++k) {
        if (k >= first_reference(a)) break;
        const bool load = inputs[k].ends_with("_load_torque");
        out.push_back({C::input, static_cast<int>(k), inputs[k], load ? "N*m" : "",
                       load ? "torque against the shaft" : "command"});
    }
    for (std::size_t k = 0; k < t.controllers.size(); ++k) add_controller_channels(a, static_cast<int>(k), out);
    for (std::size_t k = 0; k < t.motors.size(); ++k)
        out.push_back(
            {C::motor_torque, static_cast<int>(k), t.motors[k].name + "_torque", "N*m", "torque of the motor"});
    for (std::size_t k = 0; k < t.shafts.size(); ++k)
        out.push_back({C::state, p.shafts[k].speed, t.shafts[k].name + "_speed", "rad/s", "speed of the shaft"});
    for (std::size_t k = 0; k < t.shafts.size(); ++k)
        if (p.shafts[k].angle != model::nowhere)
            out.push_back({C::state, p.shafts[k].angle, t.shafts[k].name + "_angle", "rad", "angle of the shaft"});
    for (int part = 0; part < a.layout().angles; ++part) {
        const auto last = static_cast<std::size_t>(p.last_shaft[static_cast<std::size_t>(part)]);
        if (p.shafts[last].angle == model::nowhere)
            out.push_back(
                {C::state, a.layout().coupled + part, t.shafts[last].name + "_angle", "rad", "angle of the shaft"});
    }
    for (std::size_t k = 0; k < t.gears.size(); ++k) {
        const int gear = static_cast<int>(k);
        const std::string& name = t.gears[k].name;
        if (!t.gears[k].rigid())
            out.push_back(
                {C::state, p.gears[k].twist, name + "_twist", "rad", "angle of input/ratio less that of output"});
        out.push_back({C::output_torque, gear, name + "_output_torque", "N*m", "torque on the output shaft"});
        out.push_back({C::input_torque, gear, name + "_input_torque", "N*m", "torque taken from the input shaft"});
    }
    for (int c = 0; c < a.layout().contacts; ++c) {
        const std::string name = model::contact_name(a, c);
        out.push_back({C::contact_torque, c, name + "_torque", "N*m", "what the dry contact takes"});
        out.push_back({C::contact_mode, c, name, "", "slips forward (+1) or backward (-1), or is stuck (0)"});
    }
    return out;
}

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
