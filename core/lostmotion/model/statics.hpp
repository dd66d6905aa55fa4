// Reactions of stuck contacts, from the condition that their speeds stay zero.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>
#include <vector>

#include "../elements/contact_place.hpp"
#include "../elements/regime.hpp"
#include "../kernel/elimination.hpp"

namespace lostmotion::model {

// Rates of the speeds of the stuck contacts that raise the rank, and the columns of their reactions.
struct StuckRows {
    std::vector<Row> rows;
    std::vector<int> unknowns;

    StuckRows(const std::vector<ContactPlace>& contacts, const Layout& layout, const Key& key, const Ties& ties,
              const std::vector<Row>& acceleration);
};

// The first shaft of those that hang together by contacts at rest, of each shaft.
std::array<int, max_shafts> parts(const std::vector<ContactPlace>& contacts, const Key& key);

// Does a torque that the gears of a rigidly tied part pass on turn it forward or, while a contact of it is at its
// limit, wind it up? Without friction the matrix of accelerations over reactions, -d(rows)/d(reactions), is positive
// definite. Friction that changes the sign of its determinant jams: no motion or several (Painleve).
bool moves_freely(const std::vector<ContactPlace>& contacts, const Layout& layout, const Key& key, const Ties& ties,
                  const std::vector<Row>& acceleration);

// f -= factor * row. What cancels to within rounding is zero: of a torque that is zero, such as that of a shaft at rest
// that nothing turns, no rounding may be left whose sign would mean something. (Of two shafts nothing is.)
void subtract(Row& f, double factor, const Row& row, bool two_shafts);

// Eliminates the reactions from the forms. False if they have no unique solution.
bool solve_reactions(const std::vector<ContactPlace>& contacts, const Layout& layout, const Key& key, const Ties& ties,
                     const std::vector<Row>& acceleration, const std::vector<Row*>& forms);

}  // namespace lostmotion::model
