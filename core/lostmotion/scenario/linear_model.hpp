// How rates and variables of a simulation change with its states and inputs, in the present regime.
#pragma once

#include <algorithm>
#include <string>
#include <vector>

#include "../analysis/train_linear.hpp"
#include "simulation.hpp"

namespace lostmotion {

// Derivatives in the direction (states, inputs), by the names of the simulation; a direction or a result may be
// nullptr. What sampled controllers give and show stays.
Status directional_derivative(ScenarioSimulation& s, const double* states, const double* inputs, double* rates,
                              double* variables);

}  // namespace lostmotion
