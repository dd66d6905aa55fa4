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
    for (int k = 0; k < max_columns; ++k) c[k] += o.c[k];
    return *this;
}

auto Row::operator-=(const Row& o) -> Row& {
    for (int k = 0; k < max_columns; ++k) c[k] -= o.c[k];
    return *this;
}

auto Row::operator*=(double a) -> Row& {
    for (int k = 0; k < max_columns; ++k) c[k] *= a;
    return *this;
}

}  // namespace lostmotion::model
