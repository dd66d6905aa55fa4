#include "analyses.hpp"

namespace lostmotion {
LOSTMOTION_SOLVING(extern template, model::Least)
namespace {
const AdaptiveKernelIn<model::Least> adaptive("drive");
const AnalysesIn<model::Least> analyses("drive");
}  // namespace
}  // namespace lostmotion
