#include "solving.hpp"

namespace lostmotion {
LOSTMOTION_SOLVING(template, model::Least)
namespace {
const KernelIn<model::Least> kernel("drive");
}
}  // namespace lostmotion
