#include "kernels.hpp"

namespace lostmotion {
LOSTMOTION_TRAIN_KERNEL(template, model::Narrow)
}  // namespace lostmotion
