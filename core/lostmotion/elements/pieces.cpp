#include "pieces.hpp"

namespace lostmotion::model {

void add_piece_guards(const Terms& terms, const Row& variable, const TorsionCurve& curve, int branch, const Key& key,
                      std::vector<Guard>& guards) {
    const int k = branch == nowhere ? 0 : key.branch[branch];
    const auto add = [&](const Row& form, int neighbour) {
        guards.push_back({.form = form, .kind = Guard::edge, .branch = branch, .neighbour = neighbour});
    };
    if (k < curve.last_piece()) add(terms.one(curve.upper(k)) - variable, k + 1);
    if (k > curve.first_piece()) add(variable - terms.one(curve.lower(k)), k - 1);
}

void add_piece_guards(const Terms& terms, const Row& angle, const PeriodicCurve& curve, int turn, int branch,
                      const Key& key, std::vector<Guard>& guards) {
    const int n = curve.pieces(), k = key.branch[branch] % n, first = key.branch[branch] - k, last = n - 1;
    const Row within = angle - terms.memory(turn);
    const auto add = [&](const Row& form, int neighbour, double shift) {
        guards.push_back({.form = form,
                          .kind = Guard::edge,
                          .branch = branch,
                          .neighbour = first + neighbour,
                          .memory = shift == 0.0 ? nowhere : turn,
                          .shift = shift});
    };
    add(terms.one(curve.upper(k)) - within, k == last ? 0 : k + 1, k == last ? curve.period() : 0.0);
    add(within - terms.one(curve.lower(k)), k == 0 ? last : k - 1, k == 0 ? -curve.period() : 0.0);
}

}  // namespace lostmotion::model
