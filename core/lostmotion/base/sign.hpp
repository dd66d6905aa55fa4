// The sign that a quantity has just after an instant, and what counts as zero.
#pragma once

#include <cmath>
#include <limits>

namespace lostmotion {

// As many derivatives of the inputs are known: the value and five more.
inline constexpr int n_derivatives = 6;

// A form counts as zero within this multiple of the sum of the magnitudes of its terms. Its coefficients come from an
// elimination and carry more than one rounding.
inline constexpr double rounding = 0x1p14 * std::numeric_limits<double>::epsilon();
// Rounding of an instant, relative to the time since the start.
inline constexpr double time_rounding = 4.0 * std::numeric_limits<double>::epsilon();

// A guard that is further from zero than this share of its terms, and of what they are at rated load and speed times
// `far_from_event`, is not at zero: the rounding of the instant moves it by less. Near a zero of all its terms, the
// first share alone says nothing.
inline constexpr double clear_of_zero = 1e-3;
inline constexpr double far_from_event = 1e-6;

struct Sign {
    int sign = 0;
    int order = 0;          // of the first derivative that is not zero
    double relative = 0.0;  // to the sum of the magnitudes of its terms
};
// The sign that a form has just after now, from its value and the sum of the magnitudes of its terms: that of the first
// of its derivatives that is not zero. 0 if it stays at zero or, if asked by value alone, is zero now. What decays
// within the rounding of the instant has no derivative that is clear of it: then the first that is clear of the
// rounding of its terms decides.
template <class F, class Form>
Sign sign_after(F& flow, const Form& form, double value, double size, bool by_value_alone = false) {
    Sign unresolved;
    for (int k = 0; k + 1 < n_derivatives; ++k) {
        const double rate = flow.rate(form, k + 1);
        const Sign here{value > 0.0 ? +1 : -1, k, size > 0.0 ? value / size : 0.0};
        if (std::fabs(value) > flow.noise(size, rate)) return here;
        if (by_value_alone) return {};
        if (unresolved.sign == 0 && std::fabs(value) > flow.noise(size, 0.0)) unresolved = here;
        value = rate;
        size = flow.rate_magnitude(form, k + 1);
    }
    return unresolved;
}

}  // namespace lostmotion
