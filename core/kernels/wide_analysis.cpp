#include "lostmotion/analysis/sensitive_solving.hpp"
#include "lostmotion/analysis/train_response.hpp"
#include "lostmotion/simulation/train_adaptive.hpp"
#include "lostmotion/simulation/train_stepping.hpp"

namespace lostmotion {
LOSTMOTION_ADAPTIVE_RUNS(template, model::Wide)
LOSTMOTION_RESPONSES(template, model::Wide)
LOSTMOTION_SENSITIVITIES(template, model::Wide)
}  // namespace lostmotion
