#include "linear_model.hpp"

namespace lostmotion {

namespace {

std::size_t place(const std::vector<std::string>& in, const std::string& name) {
    return static_cast<std::size_t>(std::find(in.begin(), in.end(), name) - in.begin());
}

// states, inputs: of the solver, all of them.
void along_direction(TrainSimulation& t, const TrainPoint& point, const std::vector<std::string>& state_names,
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

}  // namespace

Status directional_derivative(ScenarioSimulation& s, const double* states, const double* inputs, double* rates,
                              double* variables) {
    const Status status = s.motion().find_regime();
    if (status != Status::done) return status;
    std::vector<double> dx(s.names().states.size()), du(s.solver_inputs());
    if (states != nullptr) std::copy_n(states, dx.size(), dx.begin());
    for (std::size_t k = 0; k < s.free_inputs() && inputs != nullptr; ++k) du[s.solver_input(k)] = inputs[k];
    along_direction(s.train(), s.motion().point(), s.names().states, dx.data(), du.data(), rates, variables);
    if (variables == nullptr) return status;
    std::fill(variables + s.variables().first_shown(), variables + s.variables().size(), 0.0);
    std::vector<double> values(s.variables().size());
    s.read(values.data());
    s.variables().derive_rates(values.data(), variables);
    return status;
}

}  // namespace lostmotion
