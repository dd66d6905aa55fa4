#include "analyses.hpp"

namespace lostmotion {
LOSTMOTION_SOLVING(extern template, model::Wide)
namespace {
const AdaptiveKernelIn<model::Wide> adaptive("wide");
const AnalysesIn<model::Wide> analyses("wide");
}  // namespace
}  // namespace lostmotion
