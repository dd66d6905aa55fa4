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
    std::shared_ptr<const TrainRun> train;
    std::optional<std::vector<Signal>> inputs;
    std::optional<TrainStart> start;
    std::optional<Control> control;
};

struct Variation {
    std::string name;
    std::vector<Neighbour> neighbours;
};

// Why a run has no derivatives.
struct DerivativeFault {
    std::string parameter;  // empty: whatever the parameters are
    std::string reason;     // empty: there is no fault

    bool empty() const { return reason.empty(); }
};

// The trains beside a train.
class VariedTrain {
 public:
    struct Beside {
        int parameter;
        double weight;
        std::shared_ptr<const TrainRun> run;
        bool other_ratios;  // of gears, so that what contacts at rest tie together turns otherwise

        const model::Assembly& assembly() const { return run->assembly(); }
        friend bool operator==(const Beside&, const Beside&) = default;
    };

    // base must stay.
    VariedTrain(const TrainRun& base, const std::vector<Variation>& all);
    const DerivativeFault& fault() const { return fault_; }
    const model::Assembly& base() const { return base_.assembly(); }
    const std::vector<Beside>& beside() const { return beside_; }
    friend bool operator==(const VariedTrain& a, const VariedTrain& b) {
        return &a.base_ == &b.base_ && a.beside_ == b.beside_;
    }

 private:
    void add(int parameter, const std::string& name, const Neighbour& n);

    // Of curves: how many they have follows from the error that is allowed.
    bool same_pieces(const model::Assembly& other) const;

    const TrainRun& base_;
    std::vector<Beside> beside_;
    DerivativeFault fault_;
};

}  // namespace lostmotion
