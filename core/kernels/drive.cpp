#include "lostmotion/simulation/hybrid.hpp"
#include "lostmotion/simulation/train_solving.hpp"
#include "lostmotion/simulation/train_stepping.hpp"

namespace lostmotion {
LOSTMOTION_TRAIN_RUNS(template, model::Least)
LOSTMOTION_TRAIN_STEPPING(template, model::Least)
}  // namespace lostmotion
