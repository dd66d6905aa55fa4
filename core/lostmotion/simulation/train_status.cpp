#include "train_status.hpp"

namespace lostmotion {

std::string train_status_text(const model::Assembly& a, Status status, double time, int contact, bool too_many_guards) {
    if (too_many_guards && status != Status::interrupted)
        return "the train has a regime with more conditions than the solver has room for, at t = " +
               std::to_string(time) + " s; use fewer pieces in its laws";
    std::string name;
    if (contact >= 0 && contact < a.layout().contacts)
        name = "the contact '" + model::contact_name(a, contact) + "'";
    else if (const int law = -2 - contact; law >= 0 && law < a.layout().branches)
        name = "the law '" + model::branch_names(a)[static_cast<std::size_t>(law)] + "'";
    return status_text(status, time, name);
}

}  // namespace lostmotion
