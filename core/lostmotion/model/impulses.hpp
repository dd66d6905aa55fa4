// Impulses of rigid flanks at one instant: Newton's law in sequence (docs/theory.md, impacts).
//
// Let u be the approach speed of the flanks of a gear, the rate at which its gap closes. Impulses P >= 0 change all of
// these by -W P, W = G M^-1 G^T: M is the mass matrix of the speeds that rigid gears leave free, G the approach speeds
// by these. Torques of friction, clutches, springs and motors are finite and have no impulse.
//
// A round takes flanks that approach each other and flanks that touch. It leaves u+ <= -e u- with equality where
// P > 0, and e = 0 of those that touch. Flanks without a gap that were parting approach each other after that perhaps:
// they strike in the next round.
#pragma once

#include <array>
#include <limits>
#include <vector>

#include "places.hpp"

namespace lostmotion::model {

struct Flank {
    int contact = nowhere;
    double side = 1.0;         // of the gap: +1 or -1
    double restitution = 0.0;  // speed at which they part over that at which they strike
    bool apart = false;        // they have a gap, and do not strike
    bool touches = false;      // they press or may press: no speed, and no bounce in a strike of others
    double speed = 0.0;        // u
    bool struck = false;       // there has been an impulse
    bool accumulates = false;  // joined in place of impacts that accumulate
    double loss = 0.0;         // the energy that they have taken [J]
};

class Impulses {
 public:
    using Values = std::vector<double>;

    std::vector<Flank> flanks;

    // speeds: of the shafts. Those of the flanks are found here, if they do not touch.
    Impulses(const Places& places, std::vector<Flank> flanks, const std::vector<double>& speeds);

    // The largest energy of an approach speed alone that is left.
    double approach() const;
    // One round. last: with e = 0, of all that have no gap, also of those that part.
    void strike(bool last);
    // Leaves none of these any speed, also where that takes a pull. Returns the kinetic energy of the speeds that they
    // have had.
    double join(const std::vector<bool>& some);
    // 1/W of flanks alone: what inertia a change of their speed moves.
    double inertia(std::size_t flank) const { return 1.0 / W_[flank][flank]; }
    // Changes of the speeds of the shafts up to here.
    Values changes() const;

 private:
    Values least(const Values& excess, const std::vector<bool>& some) const;
    Values solve(const std::vector<std::size_t>& of, const Values& excess) const;
    void apply(const Values& P, const std::vector<bool>& some, const Values& target);
    bool approaches(std::size_t f) const { return !flanks[f].apart && flanks[f].speed > noise(f); }
    double noise(std::size_t flank) const { return few_roundings * size_[flank]; }

    static constexpr double few_roundings = 8.0 * std::numeric_limits<double>::epsilon();
    static constexpr double dependent = 64.0 * std::numeric_limits<double>::epsilon();

    std::size_t shafts_;
    std::vector<Values> W_;
    std::vector<Values> per_impulse_;  // by shaft and flank: minus the change of the speed
    Values size_;                      // of each approach speed: the sum of the magnitudes of its terms
    Values total_;                     // impulses up to here
};

}  // namespace lostmotion::model
