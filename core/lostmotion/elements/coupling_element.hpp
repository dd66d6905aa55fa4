// What joins two shafts and is no gear: what such an element states about itself, for all that is made of a train, as
// `shaft_element.hpp` for one shaft.
//
// It may have a dry contact, which holds its shafts at one speed as long as that takes no more than its capacity, or a
// torque over the slip speed, or both. It may have a memory: a branch that follows from the one before, and the angle
// that it slips by, with the place that it has last engaged at. A new law is a file of this directory, with its
// parameters and a class that states them, and its line in `Train`.
#pragma once

#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "contact_place.hpp"
#include "regime.hpp"

namespace lostmotion::model {

// The two shafts that an element joins, in forms.
struct Between {
    const Terms& terms;
    Row slip;  // speed of the input less that of the output [rad/s]; no term is left of it while others keep it at zero
    int way = 0;  // in which its dry contact slips; 0: stuck
};

// The same at one instant.
struct CouplingInstant {
    double slip = 0.0;     // [rad/s]
    double command = 0.0;  // if the element has one
    bool sticks = false;   // its dry contact
    int mode = 0;          // its branch
};

class CouplingElement {
 public:
    CouplingElement(std::string its_name, int its_input, int its_output)
        : name(std::move(its_name)), input(its_input), output(its_output) {}
    virtual ~CouplingElement() = default;

    std::string name;
    int input, output;  // shafts
    // Where its own stand, of those that it has: given by `Places`.
    int command = nowhere;  // input
    int contact = nowhere;
    int branch = nowhere;  // of its piecewise law, or what it remembers
    int twist = nowhere;   // state: the angle of the input less that of the output, which the slip changes
    int turn = nowhere;    // memory: where that was last in step

    // What it has.
    virtual bool has_command() const { return false; }
    virtual const char* piecewise_law() const { return nullptr; }  // what its branch is a piece of
    virtual int pieces() const { return 1; }
    virtual const char* loss() const { return "coupling"; }  // what its heat is called
    virtual double pitch() const { return 0.0; }  // [rad] from one place at which it engages to the next; 0: it is one
    virtual const Ends* strikes() const { return nullptr; }  // around the place that it was last in step at

    // Its dry contact: the torque, as a magnitude, that it takes while it slips or holds at rest [N m]; of one that
    // only drives the output forward, backward.
    virtual bool is_dry() const { return false; }
    virtual bool is_one_way() const { return false; }
    virtual bool holds_more() const { return false; }  // at rest than while it slips
    virtual Row capacity(const Between&, const Key&, bool /*at_rest*/) const { return Row{}; }
    virtual double capacity(int /*way*/, const CouplingInstant&, bool /*at_rest*/) const { return 0.0; }

    // Torque that it passes on from input to output beside that [N m]; 0 without slip.
    virtual Row torque(const Between&, const Key&) const { return Row{}; }

    // The place at which it was last in step, where a run begins with this twist.
    virtual double turn_at(double twist) const { return pitch() * std::round(twist / pitch()); }

    // The branch that follows `mode` at an instant, which a law without a memory finds from that alone; in steady
    // motion; what ends the regime.
    virtual int next(int mode, const CouplingInstant&) const { return mode; }
    virtual int locate_steady(double /*slip*/) const { return 0; }
    virtual void add_guards(const Between&, const Key&, bool /*slips*/, std::vector<Guard>&) const {}

 protected:
    CouplingElement(const CouplingElement&) = default;

    int piece(const Key& key) const { return branch == nowhere ? 0 : key.branch[branch]; }
    Guard edge(const Row& form, int neighbour) const {
        Guard guard;
        guard.form = form;
        guard.kind = Guard::edge;
        guard.contact = contact;
        guard.branch = branch;
        guard.neighbour = neighbour;
        return guard;
    }
    // The guard of being in step again, behind or ahead by the way: there the place of the coupling moves on.
    Guard in_step(const Terms& terms, int way, int neighbour) const {
        Guard guard = edge(-way * (terms.state(twist) - terms.memory(turn)) + terms.one(pitch()), neighbour);
        guard.memory = turn;
        guard.shift = way * pitch();
        return guard;
    }
};

}  // namespace lostmotion::model
