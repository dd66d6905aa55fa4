// What is wrong with a train, in one line with the names of its elements; empty if nothing is.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <string>
#include <utility>
#include <vector>

#include "places.hpp"

namespace lostmotion::model {

class TrainCheck {
 public:
    explicit TrainCheck(const Train& train) : train_(train) {}

    std::string operator()() const;

 private:
    static std::string named(const char* kind, const std::string& name, std::size_t k) {
        return std::string(kind) + " '" + (name.empty() ? std::to_string(k) : name) + "'";
    }
    std::string shaft(int s) const {
        return named("shaft", train_.shafts[static_cast<std::size_t>(s)].name, static_cast<std::size_t>(s));
    }
    bool exists(int s) const { return s >= 0 && s < static_cast<int>(train_.shafts.size()); }

    std::string shafts_exist() const;

    std::string housings() const;

    std::string controllers() const;

    std::string elements() const;

    // Mass matrices: their shafts, sizes, symmetry and eigenvalues.
    std::string mass_matrices() const;
    // Rigid flanks with backlash, and what there may be beside them.
    std::string flanks(const Gear& g, const std::string& name) const;
    std::string inertias() const;

    // Shafts without inertia that no rigid gear ties to others.
    std::string massless() const;
    std::string harmless_inertia(int shaft) const;

    // Rigid gears alone: a loop either locks the train or leaves its torques undetermined.
    std::string rigid_loops() const;

    // A rigid gear between shafts whose motions are both given.
    std::string given_motions(const std::vector<ContactPlace>& rigid) const;

    // Does a motor, gear, coupling, spring or load torque act on each shaft? A part without motor and load moves
    // freely.
    std::string turned() const;

    std::string sizes() const;
    static std::string too_fine(const std::string& what, int pieces);
    static std::string too_many(const char* what, std::size_t n, int most);

    const Train& train_;
};

// Empty, or which rigid gear or freewheel the speeds contradict that the shafts begin with.
std::string check_start(const Train& train, const std::vector<double>& speed);

// Empty, or what is wrong with it. A train is checked before it is assembled.
inline std::string check(const Train& train) { return TrainCheck(train)(); }

}  // namespace lostmotion::model
