#include "brake.hpp"

namespace lostmotion::model {

void BrakeOnShaft::add_guards(const Site& on, const Key& key, bool, std::vector<Guard>& guards) const {
    add_limit_guards(on.terms, on.terms.input(command), 0.0, 1.0, key,
                     {.kind = Guard::input_limit, .contact = on.shaft.contact, .branch = branch}, guards);
}

}  // namespace lostmotion::model
