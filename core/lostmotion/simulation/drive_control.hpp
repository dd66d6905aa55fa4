// Controllers of the drive.
#pragma once

#include <vector>

#include "../drive/contact.hpp"
#include "closed_loop.hpp"

namespace lostmotion {

// The input of the only motor.
inline constexpr auto only_motor = [](int) { return command - first_input; };

// Those of a drive, whose shafts are 0, the motor's, and 1, the load's. The laws must stay.
ClosedLoop<DriveDims> closed_loop_of(const Drive& drive, const Control& control,
                                     const std::vector<control::Axis>& laws);

}  // namespace lostmotion
