#include "analyses.hpp"

namespace lostmotion {
LOSTMOTION_SOLVING(extern template, model::Narrow)
namespace {
const AdaptiveKernelIn<model::Narrow> adaptive("narrow");
const AnalysesIn<model::Narrow> analyses("narrow");
}  // namespace
}  // namespace lostmotion
