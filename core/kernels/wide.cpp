#include "solving.hpp"

namespace lostmotion {
LOSTMOTION_SOLVING(template, model::Wide)
namespace {
const KernelIn<model::Wide> kernel("wide");
}
}  // namespace lostmotion
