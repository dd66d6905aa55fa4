// The angle of a shaft as a linear form of the state.
#pragma once

#include <optional>
#include <vector>

#include "assembly.hpp"

namespace lostmotion::model {

// From those angles that are states on through the gears: phi_in = i (phi_out + d). Nothing where none leads there:
// past a clutch, or a gear with a transmission error, whose law is not linear.
std::optional<Row> shaft_angle(const Assembly& a, int shaft);

}  // namespace lostmotion::model
