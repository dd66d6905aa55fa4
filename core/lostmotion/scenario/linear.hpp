// How rates and variables of a simulation change with its states and inputs, in the present regime.
#pragma once

#include <algorithm>
#include <string>
#include <vector>

#include "../analysis/train_linear.hpp"
#include "simulation.hpp"

namespace lostmotion {

namespace direction {

inline std::size_t place(const std::vector<std::string>& in, const std::string& name) {
    return static_cast<std::size_t>(std::find(in.begin(), in.end(), name) - in.begin());
}

// Of a drive by the forms of its regime. states, inputs: of the solver, all of them.
void of_drive(Simulation& s, const double* states, const double* inputs, double* rates, double* channels);

// Of a train by its matrices.
void of_train(TrainSimulation& t, const TrainPoint& point, const std::vector<std::string>& state_names,
              const double* states, const double* inputs, double* rates, double* channels);

}  // namespace direction

// Derivatives in the direction (states, inputs), by the names of the simulation; a direction or a result may be
// nullptr. What sampled controllers give and show stays.
Status directional_derivative(ScenarioSimulation& s, const double* states, const double* inputs, double* rates,
                              double* variables);

}  // namespace lostmotion
