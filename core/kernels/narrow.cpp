#include "solving.hpp"

namespace lostmotion {
LOSTMOTION_SOLVING(template, model::Narrow)
namespace {
const KernelIn<model::Narrow> kernel("narrow");
}
}  // namespace lostmotion
