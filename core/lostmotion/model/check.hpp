// What is wrong with a train, with the names of its elements.
#pragma once

#include <algorithm>
#include <cmath>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "names.hpp"
#include "places.hpp"

namespace lostmotion::model {

// An element of a train and what is wrong with it. Without a kind it is the train as a whole.
struct Fault {
    std::string table, kind, name;
    std::string reason{};  // and the remedy; empty if nothing is wrong

    bool empty() const { return reason.empty(); }
    std::string element() const { return kind + " '" + name + "'"; }
    std::string sentence() const;

    friend Fault operator+(Fault fault, std::string_view text) {
        fault.reason += text;
        return fault;
    }
    friend Fault operator+(Fault fault, char text) { return std::move(fault) + std::string_view(&text, 1); }
    friend Fault operator+(Fault fault, const Fault& other) { return std::move(fault) + other.element(); }
};

class TrainCheck {
 public:
    explicit TrainCheck(const Train& train) : train_(train) {}

    Fault operator()() const;

 private:
    static Fault named(const char* table, const char* kind, const std::string& name, std::size_t k) {
        return {table, kind, name.empty() ? std::to_string(k) : name};
    }
    Fault shaft(int s) const {
        const bool slides = is_slide(train_, s);
        return named(slides ? "slides" : "shafts", slides ? "slide" : "shaft",
                     train_.shafts[static_cast<std::size_t>(s)].name, static_cast<std::size_t>(s));
    }
    const char* inertia(int s) const { return is_slide(train_, s) ? "mass" : "inertia"; }
    bool exists(int s) const { return s >= 0 && s < static_cast<int>(train_.shafts.size()); }

    Fault shafts_exist() const;

    Fault housings() const;

    Fault controllers() const;

    Fault elements() const;

    // Mass matrices: their shafts, sizes, symmetry and eigenvalues.
    Fault mass_matrices() const;
    Fault mesh_stiffness(const Gear& g, const Fault& name) const;
    Fault flanks(const Gear& g, const Fault& name) const;
    // What there may be beside what is rigid and strikes; rigid, it: what it has, and its word, in a sentence.
    Fault impacts(const Fault& name, const std::string& rigid, const std::string& it, double restitution) const;
    // End stops, and couplings with teeth.
    Fault what_strikes() const;
    Fault inertias() const;

    // Shafts without inertia that no rigid gear ties to others.
    Fault massless() const;
    std::string harmless_inertia(int shaft) const;

    // Rigid gears alone: a loop either locks the train or leaves its torques undetermined.
    Fault rigid_loops() const;

    // A rigid gear between shafts whose motions are both given.
    Fault given_motions(const std::vector<ContactPlace>& rigid) const;

    // Does a motor, gear, coupling, spring or load torque act on each shaft? A part without motor and load moves
    // freely.
    Fault turned() const;

    static Fault too_fine(const Fault& element, int pieces);

    const Train& train_;
};

// Empty, or which rigid gear or freewheel the speeds contradict that the shafts begin with.
std::string check_start(const Train& train, const std::vector<double>& speed);

// A train is checked before it is assembled.
inline Fault check(const Train& train) { return TrainCheck(train)(); }

}  // namespace lostmotion::model
