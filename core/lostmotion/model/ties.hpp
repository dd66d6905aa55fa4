// Which speeds the contacts at rest tie together, and which of those contacts are redundant.
//
// Each stuck contact is a linear equation between the speeds of one or two shafts, or of three where the housing of a
// gear turns. Each that does not follow from those before it makes one speed follow the others, or stop. One that does
// follow is redundant: its reaction is not determined by the motion.
#pragma once

#include <cmath>
#include <span>
#include <vector>

#include "../elements/contact_place.hpp"
#include "../elements/regime.hpp"

namespace lostmotion::model {

// Ratios in a loop agree within this share.
inline constexpr double loop_rounding = 1e-12;

// Shafts whose motion is given, in their order. Their speeds follow no other one, unless contacts at rest at one
// instant are to have no speed to the last bit: then they do where nothing else is left.
struct GivenShafts {
    std::span<const int> shafts = {};
    bool follow = false;
    std::span<const int> massless = {};  // shafts without inertia: they follow others first
};

// The speed of a contact in terms of those that are free; what cancels to within rounding is none.
Shares tied_speed(const ContactPlace& c, const Ties& t);

// Makes the last of the free shafts that the speed of a contact depends on follow the others; with the inertias of the
// shafts, the one that carries least, so that the heavy ones stay free. False if it follows from those before that its
// speed is zero, or if its speed is given.
bool stop_contact(const ContactPlace& c, Ties& t, const double* inertia = nullptr, const GivenShafts& given = {});

// A contact is at rest where its mode is 0 or there is none. Frame contacts come first, so that it is a gear or
// coupling whose torque is redundant where a shaft is held twice. Before them come rigid gears that lead to a given
// motion.
Ties tie(const std::vector<ContactPlace>& contacts, int shafts, std::span<const std::int8_t> modes,
         const double* inertia = nullptr, GivenShafts given = {});

// Is the speed of a contact kept at zero by these ties?
bool kept_at_rest(const ContactPlace& c, const Ties& t);

}  // namespace lostmotion::model
