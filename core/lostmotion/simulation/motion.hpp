// A train step by step, whatever the dimensions of the kernel that solves it. All arrays are by the layout of the
// train.
#pragma once

#include <span>
#include <vector>

#include "../base/status.hpp"
#include "motion_state.hpp"
#include "train_point.hpp"

namespace lostmotion {

// A shaft with a load torque.
struct LoadShaft {
    int speed_state;
    int load;        // its load torque, among the inputs
    double inertia;  // [kg m^2]
};

// How a train answers a load torque M over an interval.
struct LoadAnswer {
    double acceleration = 0.0;  // mean a of the shaft [rad/s^2]
    double rounding = 0.0;      // of it, which is a difference of speeds
    double compliance = 0.0;    // -da/dM >= 0 [1/(kg m^2)], M shifted all over the interval; 0: the shaft is held
};

class Motion {
 public:
    Motion() = default;
    Motion(const Motion&) = delete;
    Motion& operator=(const Motion&) = delete;
    virtual ~Motion() = default;

    virtual double time() const = 0;        // [s]
    virtual double state(int k) const = 0;  // one of the states
    virtual void save(MotionState& to) const = 0;
    // A state of this train.
    virtual void restore(const MotionState& from) = 0;

    // Advances by `interval` [s] with each input running in a straight line from its first to its second value; those
    // that a controller gives are not looked at. On any status but done the state is left as it was.
    virtual Status advance(double interval, std::span<const double> begin, std::span<const double> end) = 0;
    // The same, with the answer of a shaft to its load torque.
    virtual Status answer(double interval, std::span<const double> begin, std::span<const double> end,
                          const LoadShaft& shaft, LoadAnswer& out) = 0;
    // Replaces the reference of the controller of an axis by value + rate (t - now).
    virtual void set_reference(std::size_t axis, double value, double rate) = 0;
    virtual void set_interrupt(bool (*poll)(void*), void* context) = 0;

    // The regime at the present instant, with the inputs at their last values, which all that is read needs.
    virtual Status find_regime() = 0;
    virtual TrainPoint point() = 0;
    virtual std::vector<double> values() = 0;  // of all channels
    virtual const ControlCourse& control() const = 0;
    virtual std::size_t control_slots() const = 0;  // how many numbers the controllers remember
    // The signals of the controllers, axis by axis; those of a winding follow those of its axis.
    virtual std::vector<double> control_signals() const = 0;
    // Why the last step has not ended well: as TrainReport.
    virtual int stopped_at() const = 0;
    virtual bool too_many_guards() const = 0;
    virtual std::size_t memory() const = 0;  // bytes, without the regimes that it keeps

    // --- as a hybrid system, which an integrator of the caller's own solves. Not with windings. ---

    // At a time, a state and inputs, in the regime that it is in.
    virtual void place(double time, std::span<const double> x, std::span<const double> input) = 0;
    virtual void rates(double* out) = 0;
    // The guards, each over its natural magnitude; 1 beyond the last. One that falls below zero ends the regime.
    virtual std::size_t guard_count() const = 0;
    virtual void guards(double* out) = 0;
    // The ticks that are due, and the regime that follows where guards have fallen or inputs have changed.
    virtual Status settle() = 0;
    virtual double next_tick() const = 0;  // [s], infinity without controllers
    // After a step of the integrator: whether the regime has to be settled, since inputs take a torque at rest along.
    virtual bool accept() = 0;
};

}  // namespace lostmotion
