// A linear expression in what the equations of a regime depend on.
#pragma once

#include <algorithm>
#include <span>

namespace lostmotion {

// Its terms that are not zero, those of one kind together and in the order of their places. They lie in a block that
// outlives it, with those of other forms.
struct LinearForm {
    struct Term {
        int place;  // among the coupled states, the angles, the memory or the inputs
        double factor;
    };
    const Term* begin = nullptr;
    int coupled = 0, states = 0, memory = 0, inputs = 0;  // where the coupled states, the angles and the others end
    double one = 0.0;                                     // the constant

    std::span<const Term> of_coupled() const { return part(0, coupled); }
    std::span<const Term> of_angles() const { return part(coupled, states); }
    std::span<const Term> of_memory() const { return part(states, memory); }
    std::span<const Term> of_inputs() const { return part(memory, inputs); }
    // The factor of a coupled state.
    double of(int state) const {
        const auto terms = of_coupled();
        const auto at = std::ranges::lower_bound(terms, state, {}, &Term::place);
        return at != terms.end() && at->place == state ? at->factor : 0.0;
    }
    // sum value(place, factor) over the coupled states, in fours, each by its halves.
    template <class Value>
    [[gnu::always_inline]] auto sum_of_coupled(Value&& value) const {
        using Sum = decltype(value(0, 1.0));
        Sum sum{};
        for (const Term *t = begin, *end = begin + coupled; t != end;) {
            const int four = t->place / 4;
            Sum first{}, second{};
            for (; t != end && t->place / 4 == four; ++t) {
                const Sum term = value(t->place, t->factor), none{};
                const bool behind = (t->place & 2) != 0;
                first = first + (behind ? none : term);
                second = second + (behind ? term : none);
            }
            sum = sum + (first + second);
        }
        return sum;
    }

 private:
    std::span<const Term> part(int from, int to) const { return {begin + from, begin + to}; }
};

}  // namespace lostmotion
