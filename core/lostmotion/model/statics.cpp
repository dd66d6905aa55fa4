#include "statics.hpp"

namespace lostmotion::model {

StuckRows::StuckRows(const std::vector<ContactPlace>& contacts, const Layout& layout, const Key& key, const Ties& ties,
                     const std::vector<Row>& acceleration) {
    for (std::size_t k = 0; k < contacts.size(); ++k) {
        if (key.modes[k] != 0 || ties.redundant[k]) continue;
        const ContactPlace& c = contacts[k];
        rows.emplace_back();
        c.each_shaft([&](int s, double per) { rows.back() += per * acceleration[s]; });
        unknowns.push_back(layout.terms + static_cast<int>(k));
    }
}

std::array<int, max_shafts> parts(const std::vector<ContactPlace>& contacts, const Key& key) {
    std::array<int, max_shafts> part;
    std::iota(part.begin(), part.end(), 0);
    for (std::size_t k = 0; k < contacts.size(); ++k) {
        if (key.modes[k] != 0) continue;
        int first = part[contacts[k].a];
        contacts[k].each_shaft([&](int s, double) { first = std::min(first, part[s]); });
        contacts[k].each_shaft([&](int s, double) {
            const int from = part[s];
            std::replace(part.begin(), part.end(), from, first);
        });
    }
    return part;
}

bool moves_freely(const std::vector<ContactPlace>& contacts, const Layout& layout, const Key& key, const Ties& ties,
                  const std::vector<Row>& acceleration) {
    const StuckRows all(contacts, layout, key, ties, acceleration);
    const std::array<int, max_shafts> of = parts(contacts, key);
    std::vector<bool> done(all.rows.size());
    for (std::size_t first = 0; first < all.rows.size(); ++first) {
        const auto shaft = [&](std::size_t k) { return contacts[all.unknowns[k] - layout.terms].a; };
        if (done[first]) continue;
        std::vector<std::size_t> part;
        for (std::size_t k = first; k < all.rows.size(); ++k)
            if (of[shaft(k)] == of[shaft(first)]) {
                part.push_back(k);
                done[k] = true;
            }
        const std::size_t n = part.size();
        std::vector<std::vector<double>> K(n, std::vector<double>(n));
        for (std::size_t a = 0; a < n; ++a)
            for (std::size_t b = 0; b < n; ++b) K[a][b] = -all.rows[part[a]].c[all.unknowns[part[b]]];
        for (std::size_t k = 0; k < n; ++k) {
            std::size_t pivot = k;
            for (std::size_t row = k + 1; row < n; ++row)
                if (std::fabs(K[row][k]) > std::fabs(K[pivot][k])) pivot = row;
            if (pivot != k) {
                std::swap(K[k], K[pivot]);
                for (double& v : K[k]) v = -v;
            }
            if (K[k][k] == 0.0) return false;
            for (std::size_t row = k + 1; row < n; ++row)
                for (std::size_t col = n; col-- > k;) K[row][col] -= K[row][k] / K[k][k] * K[k][col];
        }
        double sign = 1.0;
        for (std::size_t k = 0; k < n; ++k) sign *= K[k][k] > 0.0 ? 1.0 : -1.0;
        if (sign < 0.0) return false;
    }
    return true;
}

void subtract(Row& f, double factor, const Row& row, bool two_shafts) {
    if (two_shafts) {
        f -= factor * row;
        return;
    }
    constexpr double few_roundings = 8.0 * std::numeric_limits<double>::epsilon();
    for (int k = 0; k < max_columns; ++k) {
        const double a = f.c[k], b = factor * row.c[k];
        f.c[k] = std::fabs(a - b) <= few_roundings * std::fabs(a) ? 0.0 : a - b;
    }
}

bool solve_reactions(const std::vector<ContactPlace>& contacts, const Layout& layout, const Key& key, const Ties& ties,
                     const std::vector<Row>& acceleration, const std::vector<Row*>& forms) {
    const bool free = moves_freely(contacts, layout, key, ties, acceleration);
    StuckRows stuck(contacts, layout, key, ties, acceleration);
    auto& [rows, unknowns] = stuck;
    const std::size_t n = rows.size();
    const bool two_shafts = acceleration.size() == 2;
    const auto take = [&](Row& f, double factor, const Row& row) { subtract(f, factor, row, two_shafts); };
    if (!eliminate(rows, unknowns, n, take)) return false;
    for (Row* f : forms) substitute(*f, rows, unknowns, n, take);
    return free;
}

}  // namespace lostmotion::model
