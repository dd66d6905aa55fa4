#include "row.hpp"

namespace lostmotion::model {

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

auto Row::operator+=(const Row& o) -> Row& {
    c.reach(o.c.size());
    std::transform(o.c.begin(), o.c.end(), c.begin(), c.data(), [](double b, double a) { return a + b; });
    return *this;
}

auto Row::operator-=(const Row& o) -> Row& {
    c.reach(o.c.size());
    std::transform(o.c.begin(), o.c.end(), c.begin(), c.data(), [](double b, double a) { return a - b; });
    return *this;
}

auto Row::operator*=(double a) -> Row& {
    std::transform(c.begin(), c.end(), c.data(), [a](double v) { return v * a; });
    return *this;
}

}  // namespace lostmotion::model
