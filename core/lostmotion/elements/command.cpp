#include "command.hpp"

namespace lostmotion::model {

void add_limit_guards(const Terms& terms, const Row& u, double low, double high, const Key& key, Guard guard,
                      std::vector<Guard>& guards) {
    const int at = key.branch[guard.branch];
    const auto add = [&](const Row& form, int neighbour) {
        guard.form = form;
        guard.neighbour = neighbour;
        guards.push_back(guard);
    };
    if (at <= 0) add(terms.one(at == 0 ? high : low) - u, at + 1);
    if (at >= 0) add(u - terms.one(at == 0 ? low : high), at - 1);
}

}  // namespace lostmotion::model
