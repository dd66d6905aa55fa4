// Break-away: whether a stuck contact whose capacity has been overcome begins to slip. Its guard is in `guards.cpp`.
#include "scales.hpp"
#include "switched_train.hpp"

namespace lostmotion::model {

// A contact whose capacity has been overcome begins to slip that way, from rest: there is nothing to decide as long as
// all others go on as they were. If the capacity itself has gone with its margin, as where a load that alone holds a
// self-locking gear reverses, the contact may as well stay stuck.
bool SwitchedTrain::breaks_away(Instant& now, const Event& event, double margin_size, double near, Key& key) {
    Key modes = key;
    modes.modes[event.contact] = static_cast<std::int8_t>(event.neighbour);
    if (margin_size <= near || at_its_limit(modes)) {
        by_trials_ = false;
        return false;
    }
    Event slipping;
    slipping.at_rest = event.at_rest;
    slipping.at_rest[event.contact] = false;
    slipping.from = event.from;
    slipping.gear = event.gear;
    slipping.coupling = event.coupling;
    const auto memory = now.memory;
    Key slips;
    if (const Trial trial = settle(now, modes, slipping, slips); trial.found == Found::yes) {
        // With a self-locking gear more torque may turn it the other way; by rounding it only seems to.
        SparseFlow along(regimes_[slips].rate, now, room_);
        const LinearForm& of = speed(event.contact);
        const Sign after = sign_after(along, of, evaluate(of, now), magnitude(of, now));
        if (!turns_the_other_way(event.neighbour, after)) {
            note(trial);
            key = slips;
            return true;
        }
        by_trials_ = false;
    } else {
        note(trial);
    }
    now.memory = memory;
    return false;
}

bool SwitchedTrain::at_its_limit(const Key& key) const {
    if (!some_redundant_) return false;
    Limit& known = limits_[hash_of(key.modes) % limits_.size()];
    if (!known.known || !(known.modes == key.modes)) known = {key.modes, true, pushes_against_rest(key)};
    return known.reached;
}

// A contact that "slips" while those that are stuck keep its speed at zero, or that would have to slip against another
// that is tied to it, does not move: it gives all that it can, and what everything at rest leaves open follows from
// that.
bool SwitchedTrain::pushes_against_rest(const Key& key) const {
    const std::vector<ContactPlace>& all = places().contacts;
    const Ties ties = places().ties(key.modes);
    std::vector<int> direction(train().shafts.size());  // of each free shaft
    for (std::size_t k = 0; k < all.size(); ++k) {
        if (key.modes[k] == 0 || all[k].gap.present()) continue;
        const ContactPlace& c = all[k];
        const Shares free = tied_speed(c, ties);
        if (free.empty()) return true;
        if (free.size() > 1) continue;
        const Share& only = *free.begin();
        const int way = key.modes[k] * (only.share > 0.0 ? 1 : -1);
        int& of_free = direction[static_cast<std::size_t>(only.shaft)];
        if (of_free * way < 0) return true;
        of_free = way;
    }
    return false;
}

}  // namespace lostmotion::model
