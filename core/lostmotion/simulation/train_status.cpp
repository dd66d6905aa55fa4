#include "train_status.hpp"

#include "../model/statics.hpp"

namespace lostmotion {

namespace {

std::string shaft_in(const model::Train& t, int s) { return "'" + t.shafts[static_cast<std::size_t>(s)].name + "'"; }

// The contact, with the shafts that it acts on.
std::string contact_in(const model::Assembly& a, int contact) {
    const model::ContactPlace& c = a.places().contacts[static_cast<std::size_t>(contact)];
    std::string on = "shaft " + shaft_in(a.train(), c.a);
    if (c.b != model::nowhere) on = "the shafts " + shaft_in(a.train(), c.a) + " and " + shaft_in(a.train(), c.b);
    return "the contact '" + model::contact_name(a, contact) + "' of " + on;
}

// Why no motion is consistent with a rigid gear that may lock: the reason, the instant, what can be done.
std::string jam_text(const model::Assembly& a, double time, int contact) {
    const auto place = static_cast<std::size_t>(a.places().contacts[static_cast<std::size_t>(contact)].element);
    const model::Train& t = a.train();
    const auto shaft = [&](int s) { return shaft_in(t, s); };
    const model::Gear& gear = t.gears[place];
    const std::string name = "gear '" + gear.name + "'",
                      at = "at t = " + std::to_string(time) + " s: the friction jams. ";
    if (const int given = model::given_behind(a.places(), t, place); given != model::nowhere)
        return "the given motion of shaft " + shaft(given) + " drives the self-locking " + name +
               " by its output, and no torque turns its input shaft " + shaft(gear.input) + " that way " + at +
               "Give this gear a stiffness, or give the motion of its input.";
    return "the losses of the rigid " + name + " between the shafts " + shaft(gear.input) + " and " +
           shaft(gear.output) +
           " rise faster with its load than what accelerates them, so that no motion is consistent " + at +
           "Give this gear a compliance, or lower its losses.";
}

}  // namespace

std::string train_status_text(const model::Assembly& a, Status status, double time, int contact, bool too_many_guards) {
    if (too_many_guards && status != Status::interrupted)
        return "the train has a regime with more conditions than the solver has room for, at t = " +
               std::to_string(time) + " s; use fewer pieces in its laws";
    if (status == Status::jammed && contact >= 0 && contact < a.layout().contacts &&
        a.places().contacts[static_cast<std::size_t>(contact)].bilateral)
        return jam_text(a, time, contact);
    std::string name;
    if (contact >= 0 && contact < a.layout().contacts)
        name = contact_in(a, contact);
    else if (const int law = -2 - contact; law >= 0 && law < a.layout().branches)
        name = "the law '" + model::branch_names(a)[static_cast<std::size_t>(law)] + "'";
    return status_text(status, time, name);
}

}  // namespace lostmotion
