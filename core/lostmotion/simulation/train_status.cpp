#include "train_status.hpp"

namespace lostmotion {

std::string train_status_text(const model::Assembly& a, Status status, double time, int contact, bool too_many_guards) {
    if (too_many_guards && status != Status::interrupted)
        return "the train has a regime with more conditions than the solver has room for, at t = " +
               std::to_string(time) + " s; use fewer pieces in its laws";
    const bool known = contact >= 0 && contact < a.layout().contacts;
    return status_text(status, time, known ? model::contact_name(a, contact) : "");
}

}  // namespace lostmotion
