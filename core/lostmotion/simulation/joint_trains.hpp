// Trains as the actuators of a multibody engine: each turns one joint, and the inertia matrix of the engine joins them.
//
// The load shaft of each train carries a nominal inertia J_i and a load torque L_i that is constant over a substep.
// With its mean acceleration a_i, the mean torque that the train gives to the joint is, by its momentum and exactly,
//     tau_i = J_i a_i + L_i,    dtau_i/da_i = J_i - 1/c_i.
// The engine asks for M a = f + tau, so that the load torques have to be
//     L = (M - J) a(L) - f.
// Newton's method solves that with the exact derivatives c_i = -da_i/dL_i >= 0 (torque_response.hpp):
//     (1 + (M - J) c) dL = (M - J) a - f - L.
// c_i = 0 is a joint that is held. Between switchings a(L) is affine, so that one iteration solves it to rounding.
// Where M = J there is nothing to solve and a substep is exact, whatever its length. M and f run in straight lines over
// the step; within a substep the load torques follow them, L' = M' a - f'.
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "../elements/row.hpp"
#include "train_stepping.hpp"

namespace lostmotion {

class JointTrains {
 public:
    struct Joint {
        TrainSimulation* train;
        LoadShaft shaft;
        model::Row position;  // of the joint, a form in the states
        int command = -1;     // place of the command among the inputs; -1: a controller has a reference in its place
        double command_scale = 1.0;
        std::vector<double> inputs = {};  // the last of all inputs of the train
        double torque = 0.0;              // mean torque on the joint over the last step [N m]
        double speed = 0.0, angle = 0.0;  // of the joint, now [rad/s, rad]
        double acceleration = 0.0;        // mean over the last step [rad/s^2]
        double compliance = 0.0;          // c_i of the last substep [1/(kg m2)]
        MotionState step_begin = {}, substep_begin = {};
    };

    // Nothing: the train does not answer a torque on this shaft, or its angle does not follow from the states.
    static std::optional<Joint> joint(TrainSimulation& train, int shaft);

    // The trains must stay.
    explicit JointTrains(std::vector<Joint> joints);

    const std::vector<Joint>& joints() const { return joints_; }
    std::span<double> inputs(std::size_t joint) { return joints_[joint].inputs; }

    // Of each joint, until it is set anew.
    void set_commands(std::span<const double> values);

    // Load torque [N m] and mean acceleration [rad/s^2] of the last substep, where the next one begins its search.
    struct Guess {
        double torque, acceleration;
    };
    Guess guess(std::size_t joint) const;
    void set_guess(std::size_t joint, const Guess& g);

    // joints x joints [kg m2], and all that acts on the joints beside the trains [N m], at the middle of a step.
    struct Mechanics {
        std::span<const double> mass, force, mass_rate, force_rate;
    };
    // Over `interval` [s] in equal substeps. On any status but done the trains are left as they were.
    Status step(double interval, int substeps, const Mechanics& m);
    // Back to where the last step began.
    void go_back();
    // Speeds and angles from the trains.
    void read();

    std::size_t failed_joint() const { return failed_; }  // of the last status that is not done
    std::size_t evaluations() const { return evaluations_; }
    std::size_t unsettled() const { return unsettled_; }  // substeps in which Newton's method has not come to its end

 private:
    static constexpr int most_iterations = 30;

    // slope: of the load torque [N m/s], around its mean.
    Status respond(std::size_t joint, double interval, double slope);
    Status substep(double interval);
    bool solve();

    std::vector<Joint> joints_;
    std::vector<LoadAnswer> answer_;
    std::vector<double> begin_inputs_, end_inputs_;  // of a joint
    std::vector<double> mass_, force_, slope_;       // of a substep
    std::vector<double> residual_, best_torque_, change_, matrix_, begin_speed_;
    std::size_t failed_ = 0, evaluations_ = 0, unsettled_ = 0;
};

}  // namespace lostmotion
