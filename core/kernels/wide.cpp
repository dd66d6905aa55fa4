#include "kernels.hpp"

namespace lostmotion {
LOSTMOTION_TRAIN_KERNEL(template, model::Wide)
}  // namespace lostmotion
