// The kernel of drives, for tests of what is inside it.
#pragma once

#include "../kernels/solving.hpp"

namespace lostmotion {
LOSTMOTION_SOLVING(extern template, model::Least)
}  // namespace lostmotion
