#include "solving.hpp"

namespace lostmotion {
LOSTMOTION_SOLVING(template, model::Middle)
namespace {
const KernelIn<model::Middle> kernel("middle");
}
}  // namespace lostmotion
