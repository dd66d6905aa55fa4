// How the start of a run depends on parameters.
#pragma once

#include "reset_tangent.hpp"

namespace lostmotion {

// Adds the derivatives of the states and of the memory at the start, by the places of w. The memory there.
std::vector<double> set_start(const VariedTrain& trains, const std::vector<Variation>& variations,
                              const TrainStart& start, double* derivative);

// Whether a contact at rest begins to slip beside the value of a parameter.
bool sets_in_motion(const VariedTrain& trains, const FormTangent& form, int contact, const double* w,
                    const double* derivative);

}  // namespace lostmotion
