// Laws and numbers of the drives of a batch, made of trains.
#pragma once

#include <string>
#include <vector>

#include "../model/train.hpp"

namespace lostmotion::batch {

inline constexpr double ROUNDING = 0x1p-52;
#include "drive_lane.hpp"
#include "drive_series.hpp"
#include "drive_walk.hpp"

// What drives of a kind share: their train, and its laws as the walk reads them.
class DriveKind {
 public:
    explicit DriveKind(const model::Train& train);
    DriveKind(DriveKind&&) = delete;

    const model::Train& train() const { return train_; }
    const DriveLaws& laws() const { return laws_; }
    // The play of its flanks, half of it on each side [rad].
    double half_gap() const { return laws_.half_gap; }

 private:
    model::Train train_;
    std::vector<double> lower_, upper_, slope_, offset_, root_, reach_;
    DriveLaws laws_{};
};

// What keeps the walk from stepping a train that is one motor, one gear and a load, or nothing.
std::string not_walked(const model::Train& train);

// The data sheet of a drive, with half of its gap on each side [rad].
DriveSheet sheet_of(const model::Train& train, double half_gap);
inline DriveNumbers numbers_of(const DriveKind& kind, const model::Train& train, double half_gap) {
    return sheet_of(train, half_gap).numbers(kind.laws());
}

}  // namespace lostmotion::batch
