// A kernel: what is called at each event, compiled for the dimensions D and registered under a name.
#pragma once

#include "train_solving.hpp"

// TEMPLATE: `template` to compile, `extern template` where another file compiles it.
#define LOSTMOTION_SOLVING(TEMPLATE, D)                                                                            \
    TEMPLATE class Propagator<D>;                                                                                  \
    TEMPLATE class Taylor<D>;                                                                                      \
    TEMPLATE class Cursor<D>;                                                                                      \
    TEMPLATE class LongStep<D>;                                                                                    \
    TEMPLATE class Stride<D>;                                                                                      \
    TEMPLATE class ExactSolver<model::TrainSystem<D>>;                                                             \
    TEMPLATE TrainReport run_train_exactly_in<D>(const TrainModel&, const RunStart&, const TrainOptions&, double*, \
                                                 TrainWatcher<D>*, std::unique_ptr<Workspace>&);
