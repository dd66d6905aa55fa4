// Many drives at once, all advanced by the same step, with inputs that are constant over it.
//
// Each drive is stepped by the walk of `drive_walk.hpp`, from one sample instant of its controller to the next. Where
// there is no controller, the series of four neighbours are made at once; each lane has the bits that it has alone.
// Whatever is not certain there is left to the general solver, which repeats the step from where it began. A drive does
// not know of the others, so its bits do not depend on their number, on their order or on threads.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "../scenario/simulation.hpp"
#include "drive_numbers.hpp"
#include "drive_tangents.hpp"
#include "input.hpp"
#include "team.hpp"

namespace lostmotion::batch {

// How many steps have been made, and how.
struct Counts {
    long steps = 0;
    long walked = 0;      // with switchings
    long general = 0;     // by the general solver
    long switchings = 0;  // of those walked
    Counts& operator+=(const Counts& o) {
        steps += o.steps;
        walked += o.walked;
        general += o.general;
        switchings += o.switchings;
        return *this;
    }
};

class DriveBatch {
 public:
    // kind_of: of each drive its kind. step: [s]. A controller stays that of the drive's kind, whatever becomes of its
    // train.
    DriveBatch(std::vector<Scenario> kinds, std::vector<int> kind_of, double step);
    ~DriveBatch();
    DriveBatch(const DriveBatch&) = delete;
    DriveBatch& operator=(const DriveBatch&) = delete;

    // What keeps a train and its controllers from being stepped in such a batch, or nothing.
    static std::string error(const model::Train& train, const Control& control);

    std::size_t size() const { return drives_.size(); }
    // Sets a parameter of all drives, by its key; it acts from the next step on. False: there is none of this key.
    bool set(const std::string& key, const double* values);
    // Gives one drive a train of its own, which `error` has passed; it goes on from the state that it is in.
    void replace(std::size_t k, const model::Train& train);
    // Advances all drives. Those that cannot go on stay where they were; the first of them is reported. command: of a
    // drive with a controller its reference. answers: of each drive how it answers its load torque, or nullptr.
    Failure step(const Input& command, const Input& load_torque, unsigned threads, LoadAnswer* answers = nullptr);
    double load_inertia(std::size_t k) const { return 1.0 / numbers(k).per_load; }
    // To t = 0. which: for each drive whether it is meant; nullptr: all. start: of each drive its states; nullptr:
    // rest.
    void reset(const bool* which, const double* start);

    // Of each state the values of all drives, one state after the other: torque and speed of the motor, speed of the
    // load, twist, angle of the load.
    static constexpr std::size_t states = 5;
    double* shown() { return shown_.data(); }
    void read_output_torque(double* out) const;
    void read_motor_torque(double* out) const;
    // The modes of a contact: 0 stuck, +1 or -1 slipping, also where there is none.
    void read_input_contact(std::int8_t* out) const;
    void read_twist_contact(std::int8_t* out) const;
    // All variables of a run, of which controllers show the last ones, and their values. Those of a train take the
    // general solver.
    const Variables& variables() const { return *variables_; }
    const ScenarioSimulation::Names& names() const { return names_; }
    void read_variable(std::size_t variable, double* out);

    // From now on, carries along the derivatives of the states with respect to these parameters. They begin at zero.
    // False: there is no parameter of one of these keys.
    bool carry_tangents(const std::vector<std::string>& keys);
    // Of a parameter and a state; NaN after a step whose tangent is not known.
    void read_tangent(std::size_t parameter, std::size_t state, double* out) const;

    struct Snapshot {
        const DriveBatch* of;
        std::vector<DriveState> drives;
        std::vector<double> inputs;
        long changes;
        std::vector<std::int64_t> instants;
        std::vector<double> times, slots;
        std::vector<DriveTangent> tangents;
    };
    Snapshot snapshot() const { return {this, drives_, inputs_, changes_, instants_, times_, slots_, tangents_}; }
    void restore(const Snapshot& s);

    const Counts& counts() const { return counts_; }
    // Bytes of states and parameters.
    std::size_t memory() const;

 private:
    struct Worker;
    struct Own {
        std::string key;
        std::vector<double> values;
    };

    Worker& add_worker();
    void step_range(std::size_t begin, std::size_t end, const Input& command, const Input& load_torque,
                    LoadAnswer* answers, Worker& worker);
    void end_step(std::size_t k, double load_torque);
    void step_lanes(std::size_t first, const Input& command, const Input& load_torque, Worker& worker);
    bool walk(std::size_t k, double command, double load_torque, LoadAnswer* answer, Worker& worker);
    void keep(std::size_t k, const DriveWalk& walk, double command, Worker& worker);
    bool walk_under_control(std::size_t k, double reference, double load_torque, Worker& worker);
    control::Sampled sampled(std::size_t k, const DriveWalk& walk, double time) const;
    bool solve(std::size_t k, double command, double load_torque, LoadAnswer* answer, Worker& worker);
    ScenarioSimulation& solver(std::size_t k, Worker& worker) const;
    void give_state(std::size_t k, ScenarioSimulation& simulation, Worker& worker) const;
    model::Train train_of(std::size_t k) const;
    const Control& control(std::size_t k) const { return controls_[static_cast<std::size_t>(control_of_[k])]; }
    bool controlled() const { return slots_at_.back() > 0; }
    std::size_t slot_count(std::size_t k) const { return slots_at_[k + 1] - slots_at_[k]; }
    double half_gap_of(std::size_t k) const;
    void renew(std::size_t k);
    void spread_numbers();
    void follow_tangents(std::size_t k, const DriveState& from);
    void make_tangent_walks();
    const DriveKind& kind(std::size_t k) const { return *kinds_[static_cast<std::size_t>(kind_of_[k])]; }
    const DriveNumbers& numbers(std::size_t k) const {
        return numbers_[each_its_own_ ? k : static_cast<std::size_t>(kind_of_[k])];
    }
    double ratio(std::size_t k) const { return numbers(k).turned / numbers(k).per_ratio; }
    void show(std::size_t k);
    template <class Read>
    void read(double* out, Read&& what) const;

    std::vector<std::unique_ptr<const DriveKind>> kinds_;
    std::vector<int> kind_of_;
    double step_;
    std::vector<DriveState> drives_;
    std::vector<double> inputs_;  // of the last step: command and load torque of each drive
    std::vector<double> shown_;
    std::vector<Own> own_;  // parameters that were set
    bool each_its_own_ = false;
    std::vector<DriveNumbers> numbers_;    // of each drive, if each has its own; of each kind
    std::map<int, int> other_gap_;         // kinds with a gap in place of those without, and the other way
    long changes_ = 0;                     // of numbers
    std::map<std::size_t, int> replaced_;  // kinds of drives that have a train of their own
    std::vector<Control> controls_;        // of each kind that was given
    std::vector<int> control_of_;          // of each drive one of them
    std::vector<std::size_t> slots_at_;    // of each drive where its controller's memory begins, and the end
    std::vector<double> slots_;
    std::vector<std::int64_t> instants_;  // of each drive the next sample instant of its controller
    std::vector<double> times_;           // [s]
    std::vector<DriveSheet> slopes_;      // of the data sheet, by each parameter whose tangents are carried along
    std::vector<DriveTangent> tangents_;  // of all drives, one parameter after the other
    std::vector<DriveSheet> sheets_;      // as `numbers_`, where there are tangents
    std::vector<std::unique_ptr<const TangentWalk>> tangent_walks_;  // of each kind
    std::unique_ptr<const Variables> variables_;
    ScenarioSimulation::Names names_;
    std::vector<std::unique_ptr<Worker>> workers_;
    Team team_;
    Counts counts_;
};

}  // namespace lostmotion::batch
