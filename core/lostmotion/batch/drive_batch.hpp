// Many drives at once, all advanced by the same step, with inputs that are constant over it.
//
// Each drive is stepped by the table of its regime (regime_table.hpp). Where a guard may have a zero within the step,
// the step is walked through: from where a regime begins, the motion is its Taylor series over a short time; a guard is
// certain to stay positive, or certain to fall, by the Bernstein coefficients of its cubic and the sum of what lies
// beyond; its zero is found by Newton's method on the series. The regime that follows has to hold strictly: each of its
// guards is positive, or zero and rising. Whatever is not certain is left to the general solver, which repeats the step
// from where it began. A drive does not know of the others, so its bits do not depend on their number, on their order
// or on threads.
#pragma once

#include <atomic>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "../simulation/train_stepping.hpp"
#include "input.hpp"
#include "regime_table.hpp"
#include "team.hpp"

namespace lostmotion::batch {

// The parameters of drives: those of `bases`, with numbers of their own under `keys` and, if it has breaks, a torsion
// curve of its own.
struct Models {
    std::vector<model::Train> bases;
    std::vector<int> base;          // of each model
    std::vector<std::string> keys;  // as in a scenario file
    int curve_breaks = -1;          // of each torsion curve; -1: that of the base
    std::vector<double> values;     // of each model: by key, breaks, slopes

    std::size_t size() const { return base.size(); }
    std::size_t width() const {
        return keys.size() + (curve_breaks < 0 ? 0 : 2 * static_cast<std::size_t>(curve_breaks) + 1);
    }
    const double* row(std::size_t m) const { return values.data() + m * width(); }
    model::Train train(std::size_t m) const;
    // The index of a key; -1 if all models have the number of their base.
    int place(const char* key) const;
    double number(std::size_t m, int place, double of_base) const { return place < 0 ? of_base : row(m)[place]; }
};

// How many steps have been made, and how.
struct Counts {
    long steps = 0;
    long walked = 0;      // with an event, or none that was certain at once
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

// What goes on with a drive, in one line of the cache.
struct alignas(64) DriveState {
    std::array<double, D::states> x{};
    Memory memory{};
    RegimeTable* regime = nullptr;  // nullptr: the contacts have still to be found
};
static_assert(sizeof(DriveState) == 64);

class DriveBatch {
 public:
    // model_of: of each drive its model. step: [s].
    DriveBatch(Models models, std::vector<int> model_of, double step);
    ~DriveBatch();
    DriveBatch(const DriveBatch&) = delete;
    DriveBatch& operator=(const DriveBatch&) = delete;

    // What keeps a model from being stepped in a batch, or nothing.
    static std::string error(const model::Train& train);

    std::size_t size() const { return drives_.size(); }
    // Advances all drives. Those that cannot go on stay where they were; the first of them is reported.
    Failure step(const Input& command, const Input& load_torque, unsigned threads);
    // To t = 0. which: for each drive whether it is meant; nullptr: all. start: of each drive its states; nullptr:
    // rest.
    void reset(const bool* which, const double* start);

    // Of each state the values of all drives, one state after the other.
    double* states() { return states_.data(); }
    void read_output_torque(double* out) const {
        read(out, &RegimeDetails::output_torque, &RegimeTable::output_torque);
    }
    void read_motor_torque(double* out) const { read(out, &RegimeDetails::motor_torque, &RegimeTable::motor_torque); }
    // The modes of a contact: 0 stuck, +1 or -1 slipping, also where there is none.
    void read_input_contact(std::int8_t* out) const { read_contact(out, &RegimeDetails::input_contact); }
    void read_twist_contact(std::int8_t* out) const { read_contact(out, &RegimeDetails::twist_contact); }

    struct Snapshot {
        const DriveBatch* of;
        std::vector<DriveState> drives;
        std::vector<Inputs> inputs;
    };
    Snapshot snapshot() const { return {this, drives_, inputs_}; }
    void restore(const Snapshot& s);

    const Counts& counts() const { return counts_; }
    // Bytes of states, tables and parameters, without what the threads share.
    std::size_t memory() const;

 private:
    struct Worker;

    void step_range(std::size_t begin, std::size_t end, const Input& command, const Input& load_torque, Worker& worker);
    void fetch(std::size_t k, std::size_t end) const;
    bool solve(std::size_t k, const Inputs& u, Worker& worker);
    RegimeTable* find(std::size_t model, const Label& label) const;
    RegimeTable* table(std::size_t model, const Label& label, Worker& worker);
    void show(std::size_t k) {
        for (std::size_t s = 0; s < D::states; ++s) states_[s * drives_.size() + k] = drives_[k].x[s];
    }
    void read(double* out, Coefficients RegimeDetails::* form, double RegimeTable::* constant) const;
    void read_contact(std::int8_t* out, std::int8_t RegimeDetails::* contact) const;

    Models models_;
    std::vector<int> model_of_;
    double step_;
    std::vector<DriveState> drives_;
    std::vector<Inputs> inputs_;  // of the last step
    std::vector<double> states_;
    TableStore store_;
    std::vector<std::atomic<RegimeTable*>> tables_;  // of each model
    int rated_output_torque_, rated_input_speed_;    // places of these keys
    std::mutex adding_;
    std::vector<std::unique_ptr<Worker>> workers_;
    Team team_;
    Counts counts_;
};

}  // namespace lostmotion::batch
