// A step of a robot in a multibody engine whose joints trains turn, in the arrays of the engine.
//
// The trains are advanced over the step with inertia matrix M and forces f of its middle, where the engine is taken by
// the predicted mean acceleration
//     a* = a + 3/4 (a - a_before).
// Joints without a train follow from the others: with D those that trains turn and O the others,
//     M_DD - M_DO M_OO^-1 M_OD and f_D - M_DO M_OO^-1 f_O
// are what the trains see. Over the step both run in straight lines through the middles of this step and the one
// before.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "joint_trains.hpp"

namespace lostmotion {

class RobotStep {
 public:
    // Of the engine; the inertia matrix as rows of its lower half. They must stay.
    struct Engine {
        std::span<double> position, speed, acceleration, warmstart;
        std::span<const double> force;  // all but those of drives and contacts
        std::span<const double> matrix;
        std::span<const std::int32_t> row_length, row_begin, column;
        std::vector<double> damping;               // of each speed; the engine's own force has it at the start
        std::vector<std::size_t> trained, others;  // speeds of the joints that trains turn, and the others
        std::vector<std::size_t> place;            // among the positions, of each of the first
        // Among the positions, of each speed; empty: there are joints whose positions are no integrals of their speeds,
        // and the caller integrates motion() over intervals as this would.
        std::vector<std::size_t> place_of_speed;
    };
    RobotStep(JointTrains& trains, Engine engine);

    // Of the next step what it predicts from: accelerations of this step and the one before, then the inertia matrix
    // and the forces that the trains have seen, if they count.
    struct Course {
        std::vector<double> acceleration, before, inertia, force;
        bool smooth = false;
    };
    const Course& course() const { return course_; }
    void set_course(Course c) { course_ = std::move(c); }

    // The first joint that is not where its train is, or -1.
    int away() const;
    // Positions to the middle of a step of h [s].
    void begin(double h);
    // Speeds to the middle of the step, under the predicted mean acceleration.
    void speed_at_middle(double h);
    // Takes inertia matrix and forces from the engine.
    void take(double h, std::span<const double> acceleration);
    // Advances the trains under these forces; the mean accelerations go to acceleration().
    Status advance(double h, int substeps, std::span<const double> force, bool smooth);
    // take() and advance() where the motion is smooth.
    Status advance(double h, int substeps) {
        take(h, ahead_);
        return advance(h, substeps, force_, true);
    }
    // Positions and speeds back to the begin.
    void restore();
    // To the end of the step: positions, unless the caller integrates them, then the rest.
    void integrate(double h, std::span<const double> acceleration);
    void finish(std::span<const double> acceleration);

    std::span<double> motion() { return motion_; }  // what the positions have to be integrated by
    std::span<double> mass() { return mass_; }
    std::span<double> force() { return force_; }
    std::span<double> acceleration() { return acceleration_; }

 private:
    void integrate_positions(double interval);

    JointTrains& trains_;
    Engine engine_;
    Course course_;
    std::vector<double> position_, speed_, ahead_, motion_, end_;
    std::vector<double> mass_, force_, own_, acting_, acceleration_;
    std::vector<double> factor_, across_, right_;  // of the others: L of M_OO = L L', L^-1 M_OD by columns, L^-1 f_O
    std::vector<double> mass_rate_, force_rate_;
};

}  // namespace lostmotion
