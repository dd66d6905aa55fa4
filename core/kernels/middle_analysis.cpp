#include "analyses.hpp"

namespace lostmotion {
LOSTMOTION_SOLVING(extern template, model::Middle)
namespace {
const AdaptiveKernelIn<model::Middle> adaptive("middle");
const AnalysesIn<model::Middle> analyses("middle");
}  // namespace
}  // namespace lostmotion
