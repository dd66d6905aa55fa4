#include "kernels.hpp"

namespace lostmotion {
LOSTMOTION_DRIVE_KERNEL(template)
}  // namespace lostmotion
