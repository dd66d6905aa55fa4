// Laws and numbers of the drives of a batch, made of trains.
#pragma once

#include <string>
#include <vector>

#include "../model/train.hpp"

namespace lostmotion::batch {

inline constexpr double EPSILON = 0x1p-52;
#include "drive_walk.hpp"

// What drives of a kind share: their train, and its laws as the walk reads them.
class DriveKind {
 public:
    explicit DriveKind(const model::Train& train);
    DriveKind(DriveKind&&) = delete;

    const model::Train& train() const { return train_; }
    const DriveLaws& laws() const { return laws_; }
    // The play of its flanks, half of it on each side [rad].
    double half_gap() const { return half_gap_; }

 private:
    model::Train train_;
    std::vector<double> lower_, upper_, slope_, offset_, root_, reach_;
    double half_gap_ = 0.0;
    DriveLaws laws_{};
};

// What keeps the walk from stepping a train that is one motor, one gear and a load, or nothing.
std::string not_walked(const model::Train& train);

// The numbers of a drive of a kind; its parameters are those of `train`, and half of its gap on each side [rad].
DriveNumbers numbers_of(const DriveKind& kind, const model::Train& train, double half_gap);

}  // namespace lostmotion::batch
