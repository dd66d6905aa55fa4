// A train step by step, in the smallest kernel that holds it.
#pragma once

#include <memory>
#include <optional>
#include <string>

#include "train_run.hpp"

namespace lostmotion {

class TrainSimulation {
 public:
    // The train must have passed the check, and its controllers theirs. step: the usual interval [s]; others are
    // allowed, this one is fastest. sines: added all the time to what the inputs are given, by time since 0.
    TrainSimulation(const model::Train& train, double step, const Control& control = {}, const InputSines& sines = {})
        : run_(train), motion_(run_.kernel().motion(run_.model(), step, control, sines)) {}
    const model::Assembly& assembly() const { return run_.assembly(); }
    const std::vector<TrainChannel>& channels() const { return run_.channels(); }
    Motion& motion() { return *motion_; }
    const Motion& motion() const { return *motion_; }

    // Nothing: the shaft has no load torque, or a mass matrix joins it to others.
    std::optional<LoadShaft> load_shaft(int shaft) const;
    // To t = 0, with the contacts still to be found. Returns what is wrong with the start, or nothing.
    std::string reset(const TrainStart& start);
    // False: the state is that of another train.
    bool restore(const MotionState& from);

 private:
    TrainRun run_;
    std::unique_ptr<Motion> motion_;
    MotionState scratch_;
};

}  // namespace lostmotion
