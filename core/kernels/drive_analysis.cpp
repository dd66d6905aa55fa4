#include "lostmotion/analysis/sensitive_solving.hpp"
#include "lostmotion/analysis/train_response.hpp"
#include "lostmotion/simulation/train_adaptive.hpp"
#include "lostmotion/simulation/train_stepping.hpp"

namespace lostmotion {
LOSTMOTION_ADAPTIVE_RUNS(template, model::Least)
LOSTMOTION_RESPONSES(template, model::Least)
LOSTMOTION_SENSITIVITIES(template, model::Least)
}  // namespace lostmotion
