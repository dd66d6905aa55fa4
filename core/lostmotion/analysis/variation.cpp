#include "variation.hpp"

namespace lostmotion {

VariedTrain::VariedTrain(const TrainRun& base, const std::vector<Variation>& all) : base_(base) {
    for (std::size_t p = 0; p < all.size(); ++p)
        for (const Neighbour& n : all[p].neighbours) add(static_cast<int>(p), all[p].name, n);
}

void VariedTrain::add(int parameter, const std::string& name, const Neighbour& n) {
    if (!n.train || !fault_.empty()) return;
    if (!n.train->error().empty()) {
        fault_ = {name, "beside its value, " + n.train->error()};
        return;
    }
    const model::Layout &a = base().layout(), &b = n.train->assembly().layout();
    if (a.coupled != b.coupled || a.angles != b.angles || a.memory != b.memory || a.inputs != b.inputs ||
        a.contacts != b.contacts || a.branches != b.branches || !same_pieces(n.train->assembly())) {
        fault_ = {name, "beside its value the train has other states, contacts or pieces of laws"};
        return;
    }
    const auto &own = base().train().gears, &other = n.train->assembly().train().gears;
    bool other_ratios = false;
    for (std::size_t g = 0; g < own.size(); ++g) other_ratios = other_ratios || own[g].law.ratio != other[g].law.ratio;
    beside_.push_back({parameter, n.weight, n.train, other_ratios});
}

bool VariedTrain::same_pieces(const model::Assembly& other) const {
    const auto same = [](const auto& own, const auto& others) {
        return std::equal(own.begin(), own.end(), others.begin(), others.end(),
                          [](const auto& a, const auto& b) { return a->pieces() == b->pieces(); });
    };
    return same(base().places().acting, other.places().acting) &&
           same(base().places().couplings, other.places().couplings);
}

}  // namespace lostmotion
