#include "train.hpp"

namespace lostmotion::model {

ShaftElements shaft_elements(const Train& train) {
    ShaftElements all;
    Train::each_kind(train, [&](const char*, const char*, const auto& elements) {
        for (const auto& e : elements) all.push_back(on_shaft(e));
    });
    for (std::size_t s = 0; s < train.shafts.size(); ++s)
        if (const Shaft& shaft = train.shafts[s]; shaft.has_drag())
            all.push_back(std::make_unique<DragOnShaft>(shaft.name, static_cast<int>(s), shaft.drag));
    return all;
}

CouplingElements coupling_elements(const Train& train) {
    CouplingElements all;
    Train::each_coupling_kind(train, [&](const char*, const char*, const auto& elements) {
        for (const auto& e : elements) all.push_back(between_shafts(e));
    });
    return all;
}

}  // namespace lostmotion::model
