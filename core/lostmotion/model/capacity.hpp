// What the dry contacts of a train hold at one instant. As forms that end a regime the same are guards of the assembly.
#pragma once

#include <limits>
#include <string>
#include <vector>

#include "assembly.hpp"
#include "instant.hpp"

namespace lostmotion::model {

// One element's share of what a contact holds before it slips forward and backward, or takes while it does, as
// magnitudes [N m].
struct CapacityShare {
    std::string element;
    double forward, backward;
};

// Of a shaft at speed w; without the losses of its gears, T_2 = nullptr. T_2: output torques of the gears [N m].
std::vector<CapacityShare> shaft_capacity(const Assembly& a, int shaft, double w, const Instant& now,
                                          const double* T_2);

std::vector<CapacityShare> contact_capacity(const Assembly& a, int contact, const Regime& r, const Instant& now,
                                            const double* T_2);

}  // namespace lostmotion::model
