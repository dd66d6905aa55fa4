#include "part_fields.hpp"

namespace lostmotion {

bool rising(const std::vector<double>& v) {
    for (std::size_t k = 1; k < v.size(); ++k)
        if (!(v[k] > v[k - 1])) return false;
    return true;
}

}  // namespace lostmotion
