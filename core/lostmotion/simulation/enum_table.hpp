// Tables that say of each value of an enumeration what it is called.
#pragma once

namespace lostmotion {

// Whether row k of a table is that of the enumeration's value k, for all of them.
template <class Table>
constexpr bool in_order(const Table& table) {
    int k = 0;
    for (const auto& row : table)
        if (row.name == nullptr || static_cast<int>(row.value) != k++) return false;
    return true;
}

}  // namespace lostmotion
