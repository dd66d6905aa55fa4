#include "analyses.hpp"

namespace lostmotion {
LOSTMOTION_SOLVING(extern template, Any)
namespace {
const AdaptiveKernelIn<Any> adaptive("any");
const AnalysesIn<Any> analyses("any");
}  // namespace
}  // namespace lostmotion
