// What solves drives and trains takes minutes to compile: each kernel in a file of its own, once for all that is built
// with the same options.
#pragma once

#include "lostmotion/simulation/hybrid.hpp"
#include "lostmotion/simulation/train_stepping.hpp"

namespace lostmotion {

// TEMPLATE: `extern template` to declare, `template` to compile.
#define LOSTMOTION_TRAIN_KERNEL(TEMPLATE, D)                                                                           \
    TEMPLATE TrainReport run_train_exactly_in<D>(const typename TrainReader<D>::Model&, const std::vector<Signal>&,    \
                                                 std::span<const double>, std::span<const double>,                     \
                                                 const TrainOptions&, double*, TrainWatcher<D>*, TrainWorkspace<D>*);  \
    TEMPLATE TrainReport run_train_adaptively_in<D>(const typename TrainReader<D>::Model&, const std::vector<Signal>&, \
                                                    std::span<const double>, std::span<const double>,                  \
                                                    const TrainOptions&, double*);                                     \
    TEMPLATE TrainReport reach_train_in<D>(const typename TrainReader<D>::Model&, const std::vector<Signal>&,          \
                                           std::span<const double>, std::span<const double>, const TrainOptions&,      \
                                           TrainPoint&);                                                               \
    TEMPLATE class SimulationOf<model::TrainSystem<D>>;                                                                \
    TEMPLATE class TrainSimulationIn<D>;

// Drives step by step; their runs are compiled where they are called.
#define LOSTMOTION_DRIVE_KERNEL(TEMPLATE) TEMPLATE class SimulationOf<SwitchedDrive>;

LOSTMOTION_DRIVE_KERNEL(extern template)
LOSTMOTION_TRAIN_KERNEL(extern template, model::Narrow)
LOSTMOTION_TRAIN_KERNEL(extern template, model::Middle)
LOSTMOTION_TRAIN_KERNEL(extern template, model::Wide)

}  // namespace lostmotion
