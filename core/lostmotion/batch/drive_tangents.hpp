// Derivatives of the state of a drive with respect to a number of its data sheet, carried along step by step.
#pragma once

#include <memory>

#include "drive_numbers.hpp"

namespace lostmotion::batch {

// Of the states as a batch shows them, and of the capacity of the hysteresis.
struct DriveTangent {
    double motor_torque, motor_speed, load_speed, twist, load_angle, hysteresis;
};

// The walk of a kind of drives with a number and its derivative in the place of each number.
class TangentWalk {
 public:
    explicit TangentWalk(const DriveKind& kind);
    ~TangentWalk();

    // Carries a tangent along a step from one state to another. by: the derivative of the data sheet. False: the walk
    // does not lead to that state, as where the general solver had to decide what the walk could not, or the derivative
    // is that of a part that the drive has not got.
    bool carry(const DriveSheet& sheet, const DriveSheet& by, const DriveState& from, double command,
               double load_torque, double step, const DriveState& to, DriveTangent& tangent) const;

 private:
    struct Laws;
    std::unique_ptr<const Laws> laws_;
};

// The derivative of the data sheet with respect to a parameter of a train, each of whose numbers is linear in it.
DriveSheet sheet_slope(const model::Train& train, const std::string& key);

}  // namespace lostmotion::batch
