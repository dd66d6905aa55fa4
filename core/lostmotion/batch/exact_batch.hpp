// Many drives at once, each by the general solver: those that controllers turn, or whose load has a given motion.
#pragma once

#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "../scenario/simulation.hpp"
#include "input.hpp"
#include "team.hpp"

namespace lostmotion::batch {

class ExactBatch {
 public:
    // kind_of: of each drive its scenario; all have inputs and variables of the same names. step: [s].
    ExactBatch(const std::vector<Scenario>& kinds, std::span<const int> kind_of, double step);

    std::size_t size() const { return drives_.size(); }
    const std::vector<std::string>& inputs() const { return drives_[0]->names().inputs; }
    const Variables& variables() const { return drives_[0]->variables(); }

    // At the end of a step, of the shaft whose motion is given.
    struct Motion {
        Input speed;
        std::optional<Input> angle, acceleration;
    };
    // Advances all drives with constant inputs, in the order of their names. Those that cannot go on stay where they
    // were; the first of them is reported. answers: of each drive how this shaft of it answers its load torque.
    struct Answers {
        int shaft;
        LoadAnswer* of;
    };
    Failure step(std::span<const Input> inputs, const std::optional<Motion>& motion, unsigned threads,
                 const std::optional<Answers>& answers = {});
    // Nothing: the shaft has no load torque, or others are joined to it.
    std::optional<LoadShaft> load_shaft(std::size_t k, int shaft) const {
        return drives_[k]->train().load_shaft(shaft);
    }
    // Gives a drive other parameters; it goes on from the state that it is in. False: it has other states.
    bool replace(std::size_t k, const Scenario& scenario);
    // To t = 0. which: for each drive whether it is meant; nullptr: all. start: of each drive its states, in the order
    // of their names, and the speed of a load whose motion is given. Returns what is wrong with it, or nothing.
    std::string reset(const bool* which, const double* start);
    const std::vector<std::string>& states() const { return drives_[0]->names().states; }

    // Of each variable the values of all drives, one variable after the other; each step writes them anew.
    double* values() { return values_.data(); }

    struct Snapshot {
        const ExactBatch* of;
        std::vector<MotionState> drives;
        std::vector<double> values;
    };
    Snapshot snapshot() const;
    void restore(const Snapshot& s);

    // Bytes, without what the solvers keep of the regimes that they have met.
    std::size_t memory() const;

 private:
    struct Worker {
        std::vector<double> inputs, values;
        Failure failure;
    };
    void step_one(std::size_t k, std::span<const Input> inputs, const std::optional<Motion>& motion,
                  const std::optional<Answers>& answers, Worker& worker);

    double step_;
    std::vector<std::unique_ptr<ScenarioSimulation>> drives_;
    std::optional<ScenarioSimulation::GivenShaft> given_;
    std::vector<double> values_;
    std::vector<Worker> workers_;
    Team team_;
};

}  // namespace lostmotion::batch
