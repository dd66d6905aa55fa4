#include "train_linear.hpp"

namespace lostmotion {

LinearRegime linearize(const model::Assembly& a, const std::vector<TrainChannel>& channels, const TrainPoint& p) {
    using Channel = TrainChannel;
    const model::Layout& n = a.layout();
    const model::Regime r = a.build(p.key);
    const std::vector<bool> moves = model::moved_states(a);
    const std::vector<std::string> names = model::state_names(a);
    // The first of its name: an angle that something depends on is integrated once more beside the coupled states.
    const auto first = [&](std::size_t k) {
        return static_cast<std::size_t>(std::find(names.begin(), names.end(), names[k]) - names.begin());
    };
    const auto row = [&](const model::Row& f) {
        std::vector<double> out;
        for (int k = 0; k < n.states; ++k)
            if (moves[static_cast<std::size_t>(k)]) out.push_back(f.c[k]);
        for (int i = 0; i < n.inputs; ++i) out.push_back(f.c[n.first_input + i]);
        double constant = f.c[n.one];
        for (int m = 0; m < n.memory; ++m) constant += f.c[n.first_memory + m] * p.now.memory[m];
        out.push_back(constant);
        return out;
    };
    const auto input_torque = [&](std::size_t gear) {
        std::vector<double> total = row(r.input_torque[gear]);
        const auto value = [&](const model::Row& f) { return model::evaluate(n, f, p.now); };
        const SharedTorque shared = shared_torque(a, r, gear, value);
        if (shared.margin == nullptr) return total;
        const auto add_tangent = [&](const model::Row& f, double derivative) {
            const std::vector<double> part = row(f);
            for (std::size_t k = 0; k < total.size(); ++k) total[k] += derivative * part[k];
            total.back() -= derivative * value(f);
        };
        add_tangent(*shared.friction, shared.by_friction);
        add_tangent(*shared.output, shared.by_output);
        add_tangent(shared.margin->form, shared.by_margin);
        total.back() += shared.value();
        return total;
    };
    const auto loss_coefficient = [&](std::size_t k) {
        const model::Gear& gear = a.train().gears[k];
        const auto value = [&](const model::Row& f) { return model::evaluate(n, f, p.now); };
        const SharedTorque shared = shared_torque(a, r, k, value);
        const double rated = gear.law.rated_output_torque;
        if (shared.margin != nullptr) {  // what it holds at rest, in the direction of what the contact holds
            const model::MeshLoss loss = gear.loss(shared.driven, 0.0);
            const double slope = (shared.held >= 0.0 ? 1.0 : -1.0) * gear.sense() * loss.per_torque / rated;
            std::vector<double> total = row(slope * *shared.output);
            total.back() += loss.torque / rated - slope * value(*shared.output);
            return total;
        }
        const model::ShaftPlace& input = a.places().shafts[static_cast<std::size_t>(gear.input)];
        const double speed = input.massless == model::nowhere
                                 ? p.now.x[input.speed]
                                 : value(r.massless[static_cast<std::size_t>(input.massless)].form);
        const double way = gear.has_dry_losses() ? p.key.modes[static_cast<std::size_t>(input.contact)]
                           : speed < 0.0         ? -1.0
                                                 : 1.0;
        return row(gear.sense() * way / rated * (gear.law.ratio * r.input_torque[k] - r.output_torque[k]));
    };
    LinearRegime out;
    for (std::size_t k = 0; k < names.size(); ++k) {
        if (!moves[k]) continue;
        out.states.push_back(names[k]);
        out.state.push_back(p.now.x[k]);
        out.rate.push_back(row(r.rate[k]));
    }
    const auto add = [&](const Channel& c, const model::Row& f) {
        out.outputs.push_back(c.name);
        out.output.push_back(row(f));
    };
    for (const Channel& c : channels) {
        const auto k = static_cast<std::size_t>(c.index);
        if (c.kind == Channel::state) add(c, model::Row::unit(static_cast<int>(first(k))));
        if (c.kind == Channel::massless_speed) add(c, r.massless[k].form);
        if (c.kind == Channel::motor_torque) add(c, r.motor_torque[k]);
        if (c.kind == Channel::output_torque) add(c, r.output_torque[k]);
        if (c.kind == Channel::input_torque || c.kind == Channel::loss_coefficient) {
            out.outputs.push_back(c.name);
            out.output.push_back(c.kind == Channel::input_torque ? input_torque(k) : loss_coefficient(k));
        }
        if (c.kind == Channel::contact_torque) add(c, r.contact_torque[k]);
        if (c.kind == Channel::output) add(c, a.controller_command(c.index, p.key));
        if (c.kind == Channel::pressing_torque) add(c, a.pressing_torque(c.index, p.key));
        if (c.kind == Channel::field_lead) add(c, a.field_lead(c.index));
        if (c.kind == Channel::error) add(c, a.controller_error(c.index));
    }
    return out;
}

}  // namespace lostmotion
