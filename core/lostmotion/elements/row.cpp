#include "row.hpp"

#include "../base/vec.hpp"

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
    constexpr std::size_t few = 20;
    if (size == few)
#pragma GCC unroll 5
        for (std::size_t k = 0; k < few; k += 4) use(k);
    else
        for (std::size_t k = 0; k < size; k += 4) use(k);
}

auto Row::operator+=(const Row& o) -> Row& {
    c.reach(o.c.size());
    double* to = c.data();
    const double* from = o.c.begin();
    each_four(o.c.size(), [&](std::size_t k) { (Four::load(to + k) + Four::load(from + k)).store(to + k); });
    return *this;
}

auto Row::operator-=(const Row& o) -> Row& { return *this += Scaled{-1.0, o}; }

auto Row::operator+=(Scaled&& o) -> Row& {
    c.reach(o.row.c.size());
    double* to = c.data();
    const double* from = o.row.c.begin();
    each_four(o.row.c.size(),
              [&](std::size_t k) { (Four::load(to + k) + o.factor * Four::load(from + k)).store(to + k); });
    return *this;
}

Row::Row(Scaled&& of) {
    double* to = c.as_many_as(of.row.c);
    const double* from = of.row.c.begin();
    each_four(c.size(), [&](std::size_t k) { (of.factor * Four::load(from + k)).store(to + k); });
}

auto Row::operator*=(double a) -> Row& {
    double* to = c.data();
    each_four(c.size(), [&](std::size_t k) { (a * Four::load(to + k)).store(to + k); });
    return *this;
}

}  // namespace lostmotion::model
