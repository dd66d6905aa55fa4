#include "row.hpp"

#include "../kernel/vec.hpp"

namespace lostmotion::model {

using Four = Pack<4>;

void Layout::arrange() {
    states = coupled + angles;
    one = states;
    first_memory = one + 1;
    first_input = first_memory + memory;
    terms = first_input + inputs;
}

auto Row::unit(int term, double factor) -> Row {
    Row f;
    f.c[term] = factor;
    return f;
}

// Calls use(k) for each four of the coefficients.
template <class Use>
static void each_four(std::size_t size, Use&& use) {
    for (std::size_t k = 0; k < size; k += 4) use(k);
}

auto Row::operator+=(const Row& o) -> Row& {
    c.reach(o.c.size());
    double* to = c.data();
    const double* from = o.c.begin();
    each_four(o.c.size(), [&](std::size_t k) { (Four::load(to + k) + Four::load(from + k)).store(to + k); });
    return *this;
}

auto Row::operator-=(const Row& o) -> Row& {
    c.reach(o.c.size());
    double* to = c.data();
    const double* from = o.c.begin();
    each_four(o.c.size(), [&](std::size_t k) { (Four::load(to + k) + -1.0 * Four::load(from + k)).store(to + k); });
    return *this;
}

auto Row::operator*=(double a) -> Row& {
    double* to = c.data();
    each_four(c.size(), [&](std::size_t k) { (a * Four::load(to + k)).store(to + k); });
    return *this;
}

}  // namespace lostmotion::model
