// What acts on one shaft: what such an element states about itself, for all that is made of a train: its equations and
// guards, the search of its modes, powers, names, explanations.
//
// A new law is a file of this directory, with its parameters and a class that states them, and its line in `Train`.
#pragma once

#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "contact_place.hpp"
#include "regime.hpp"

namespace lostmotion::model {

struct ShaftPlace {
    int speed = nowhere, angle = nowhere;  // states; the angle only if something depends on it
    int contact = nowhere, load = nowhere;
    int given_speed = nowhere, given_acceleration = nowhere;  // inputs, where the motion is given
    int massless = nowhere;                                   // number of the shaft among those without inertia
    int friction_piece = nowhere;                             // branch
    double inertia = 0.0, viscous_friction = 0.0;             // with the rotors and gears on it
    double motor_friction = 0.0;                              // [N m], of the bearings of the motors on it
};

// The shaft that an element acts on, in forms.
struct Site {
    const Terms& terms;
    const ShaftPlace& shaft;

    Row speed(double factor = 1.0) const { return terms.state(shaft.speed, factor); }
    Row angle(double factor = 1.0) const { return terms.state(shaft.angle, factor); }
};

// The same at one instant.
struct ShaftInstant {
    double speed = 0.0;    // [rad/s]
    double angle = 0.0;    // [rad], if something depends on it; what the law depends on
    double command = 0.0;  // if the element has one
    double turn = 0.0;     // [rad], if its law is periodic
};

class ShaftElement {
 public:
    ShaftElement(std::string its_name, int its_shaft) : name(std::move(its_name)), shaft(its_shaft) {}
    virtual ~ShaftElement() = default;

    std::string name;
    int shaft;
    // Where its own stand, of those that it has: given by `Places`.
    int command = nowhere;    // input
    int branch = nowhere;     // of its piecewise law
    int turn = nowhere;       // memory: the angle at which the present turn of a periodic law began
    int contact = nowhere;    // of what strikes
    int remainder = nowhere;  // input of the adaptive solver: what straight lines leave of a smooth law
    int position = nowhere;   // input: the angle that its law is relative to

    // What it has.
    virtual bool has_command() const { return false; }
    virtual const char* piecewise_law() const { return nullptr; }  // what its branch is a piece of
    virtual int pieces() const { return 1; }
    virtual bool over_angle() const { return false; }
    virtual double period() const { return 0.0; }  // [rad] of a law over the angle; 0: it has none
    virtual int motor() const { return nowhere; }  // whose torque it is, relative to the angle that is its command
    virtual bool is_smooth() const { return false; }
    virtual bool drives() const { return false; }  // it may set a train in motion
    // The angles at which the shaft strikes something rigid; and whether what it is pressed against is a result.
    virtual const Ends* strikes() const { return nullptr; }
    virtual bool is_pressed() const { return false; }

    // Torque on the shaft in the direction of its motion, beside what is dry [N m].
    virtual bool acts_at_rest() const { return true; }
    virtual Row torque(const Site&, const Key&) const { return Row{}; }
    virtual double torque(const ShaftInstant&) const { return 0.0; }
    // What its power is called, if it is one into the train, or one that is lost.
    virtual const char* source() const { return nullptr; }
    virtual const char* loss() const { return nullptr; }

    // Of dry friction, a part of what the contact of the shaft holds at rest, or takes while it slips forward [N m].
    virtual bool is_dry() const { return false; }
    virtual bool holds_more() const { return false; }  // at rest than while it slips
    virtual Row friction(const Site&, const Key&, bool /*at_rest*/) const { return Row{}; }
    virtual double friction(const ShaftInstant&, bool /*at_rest*/) const { return 0.0; }

    // The branch that follows `mode` at an instant, which a law without a memory finds from that alone; in steady
    // motion with the commands of what it holds at 0; what ends the regime.
    virtual int next(int mode, const ShaftInstant&) const { return mode; }
    virtual int locate_steady(double /*speed*/) const { return 0; }
    virtual void add_guards(const Site&, const Key&, bool /*turns*/, std::vector<Guard>&) const {}

    // What straight lines leave of a smooth law, in this branch: its value, its rate, and the size of the law.
    struct Remainder {
        double value = 0.0, rate = 0.0, magnitude = 0.0;
    };
    virtual Remainder remainder_at(const ShaftInstant&, int /*branch*/) const { return {}; }

    // The angle at which the period began that this one lies in [rad].
    double turn_at(double angle) const { return period() * std::floor(angle / period()); }
    // What its law depends on: of a motor, the angle to its field, from half a period before it on. So a period begins
    // where the rotor falls out of step.
    template <class Inputs>
    double seen(double angle, const Inputs& input) const {
        if (position == nowhere) return angle;
        return angle - input[static_cast<std::size_t>(position)] + 0.5 * period();
    }

 protected:
    ShaftElement(const ShaftElement&) = default;

    int piece(const Key& key) const { return branch == nowhere ? 0 : key.branch[branch]; }
};

}  // namespace lostmotion::model
