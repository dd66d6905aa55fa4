#include "clutch.hpp"

namespace lostmotion::model {

auto ClutchBetweenShafts::capacity(const Between& shafts, const Key& key, bool at_rest) const -> Row {
    const double most = at_rest ? law_.holding() : law_.torque;
    return has_command() ? commanded(shafts.terms, most, command, piece(key)) : shafts.terms.one(most);
}

void ClutchBetweenShafts::add_guards(const Between& shafts, const Key& key, bool, std::vector<Guard>& guards) const {
    if (has_command())
        add_limit_guards(shafts.terms, shafts.terms.input(command), 0.0, 1.0, key,
                         {.kind = Guard::input_limit, .contact = contact, .branch = branch}, guards);
}

}  // namespace lostmotion::model
