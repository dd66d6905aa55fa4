#include "solving.hpp"

namespace lostmotion {
LOSTMOTION_SOLVING(template, Any)
namespace {
const KernelIn<Any> kernel("any");
}
}  // namespace lostmotion
