// How what a run is made of changes with parameters: by the cases at some values p_i of a parameter beside its own p,
//     df/dp = sum_i weight_i (f(p_i) - f(p)),
// for any f that is smooth where the modes stay the same. What differs from the case is told by each of its parts.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "../simulation/train_run.hpp"

namespace lostmotion {

// At another value of a parameter; a part that is left out is as in the case itself.
struct Neighbour {
    double offset = 0.0, weight = 0.0;  // p_i - p and weight_i, in units of the parameter and of its inverse
    std::optional<model::Train> train;
    std::optional<std::vector<Signal>> inputs;
    std::optional<TrainStart> start;
    std::optional<Control> control;
};

struct Variation {
    std::string name;
    std::vector<Neighbour> neighbours;
};

// The trains beside a train, ready to compose regimes.
class VariedTrain {
 public:
    struct Beside {
        int parameter;
        double weight;
        model::Assembly assembly;

        Beside(int p, const Neighbour& n) : parameter(p), weight(n.weight), assembly(*n.train) {}
    };

    VariedTrain(const model::Assembly& base, const std::vector<Variation>& all) : base_(base) {
        for (std::size_t p = 0; p < all.size(); ++p)
            for (const Neighbour& n : all[p].neighbours) add(static_cast<int>(p), all[p].name, n);
    }
    // Why derivatives do not exist, or empty.
    const std::string& error() const { return error_; }
    const model::Assembly& base() const { return base_; }
    const std::vector<std::unique_ptr<Beside>>& beside() const { return beside_; }

 private:
    void add(int parameter, const std::string& name, const Neighbour& n) {
        if (!n.train || !error_.empty()) return;
        error_ = model::check(*n.train);
        if (!error_.empty()) {
            error_ = "beside the value of " + name + ": " + error_;
            return;
        }
        beside_.push_back(std::make_unique<Beside>(parameter, n));
        const model::Layout &a = base_.layout(), &b = beside_.back()->assembly.layout();
        if (a.coupled != b.coupled || a.angles != b.angles || a.memory != b.memory || a.inputs != b.inputs ||
            a.contacts != b.contacts || a.branches != b.branches)
            error_ = "beside the value of " + name + " the train has other states, contacts or pieces of laws";
    }

    const model::Assembly& base_;
    std::vector<std::unique_ptr<Beside>> beside_;
    std::string error_;
};

}  // namespace lostmotion
