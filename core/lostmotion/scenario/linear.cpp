#include "linear.hpp"

namespace lostmotion::direction {

void of_drive(Simulation& s, const double* states, const double* inputs, double* rates, double* channels) {
    const Regime& r = s.regime();
    const auto along = [&](const LinearForm& f) {
        double sum = 0.0;
        for (int k = 0; k < n_states; ++k) sum += f.c[k] * states[k];
        for (int i = 0; i < n_inputs; ++i) sum += f.c[first_input + i] * inputs[i];
        return sum;
    };
    if (rates != nullptr)
        for (int k = 0; k < n_states; ++k) rates[k] = along(r.rate[static_cast<std::size_t>(k)]);
    if (channels == nullptr) return;
    std::fill(channels, channels + n_channels, 0.0);
    channels[ch_command] = inputs[0];
    channels[ch_load_torque] = inputs[1];
    channels[ch_motor_torque] = along(r.source_torque);
    channels[ch_motor_speed] = states[motor_speed];
    channels[ch_load_speed] = states[load_speed];
    channels[ch_load_angle] = states[load_angle];
    channels[ch_twist] = states[twist];
    channels[ch_output_torque] = along(r.output_torque);
    channels[ch_input_torque] = along(r.input_torque);
    const Gearbox& gearbox = s.drive().gearbox;
    if (gearbox.losses == Gearbox::loss_map && r.key.modes[input_contact] == 0) {
        // At rest the contact holds F, of which the gear takes F l/C (Reader).
        const auto value = [&](const LinearForm& f) {
            return evaluate(f, s.snapshot().x, s.snapshot().memory, s.inputs());
        };
        const double F = value(r.input_friction), T_2 = value(r.output_torque), i = gearbox.ratio;
        const int way = F >= 0.0 ? 1 : -1;
        const double mu = way * T_2 / gearbox.rated_output_torque, l = gearbox.loss_torque(T_2, 0.0, way) / i,
                     C = s.drive().input_capacity(T_2, 0.0, way);
        const double loss = way * gearbox.map.plane(gearbox.map.triangle(mu, 0.0)).per_load * along(r.output_torque);
        channels[ch_loss_coefficient] = loss / gearbox.rated_output_torque;
        if (C > 0.0)
            channels[ch_input_torque] +=
                along(r.input_friction) * l / C + F * loss / i * s.drive().motor.friction_torque / (C * C);
        return;
    }
    const double slips = static_cast<double>(r.key.modes[input_contact]);
    channels[ch_loss_coefficient] =
        (r.key.modes[input_contact] == absent ? (s.snapshot().x[motor_speed] < 0.0 ? -1.0 : 1.0) : slips) *
        along(r.loss_torque) / gearbox.rated_output_torque;
}

void of_train(TrainSimulation& t, const TrainPoint& point, const std::vector<std::string>& state_names,
              const double* states, const double* inputs, double* rates, double* channels) {
    const LinearRegime regime = linearize(t.assembly(), t.channels(), point);
    const std::vector<std::string> input_names = model::input_names(t.assembly());
    const auto along = [&](const std::vector<double>& row) {
        double sum = 0.0;
        for (std::size_t k = 0; k < regime.states.size(); ++k)
            sum += row[k] * states[place(state_names, regime.states[k])];
        for (std::size_t k = 0; k < input_names.size(); ++k) sum += row[regime.states.size() + k] * inputs[k];
        return sum;
    };
    if (rates != nullptr) {
        std::fill(rates, rates + state_names.size(), 0.0);
        for (std::size_t k = 0; k < regime.states.size(); ++k)
            rates[place(state_names, regime.states[k])] = along(regime.rate[k]);
    }
    for (std::size_t c = 0; c < t.channels().size() && channels != nullptr; ++c) {
        const std::size_t k = place(regime.outputs, t.channels()[c].name), i = place(input_names, t.channels()[c].name);
        channels[c] = k < regime.outputs.size() ? along(regime.output[k]) : i < input_names.size() ? inputs[i] : 0.0;
    }
}

}  // namespace lostmotion::direction

namespace lostmotion {

Status directional_derivative(ScenarioSimulation& s, const double* states, const double* inputs, double* rates,
                              double* variables) {
    const Status status = s.with([](auto& in) { return in.find_regime(); });
    if (status != Status::done) return status;
    std::vector<double> dx(s.names().states.size()), du(s.solver_inputs());
    if (states != nullptr) std::copy_n(states, dx.size(), dx.begin());
    for (std::size_t k = 0; k < s.free_inputs() && inputs != nullptr; ++k) du[s.solver_input(k)] = inputs[k];
    s.with([&]<class S>(S& in) {
        if constexpr (std::is_same_v<S, Simulation>)
            direction::of_drive(in, dx.data(), du.data(), rates, variables);
        else
            direction::of_train(*s.train(), in.point(), s.names().states, dx.data(), du.data(), rates, variables);
    });
    if (variables == nullptr) return status;
    std::fill(variables + s.variables().first_shown(), variables + s.variables().size(), 0.0);
    std::vector<double> values(s.variables().size());
    s.read(values.data());
    s.variables().derive_rates(values.data(), variables);
    return status;
}

}  // namespace lostmotion
