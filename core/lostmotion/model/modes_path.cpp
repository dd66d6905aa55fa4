// The way of the torques of contacts at rest from before an event to after it.
#include "switched_train.hpp"

namespace lostmotion::model {

// In these modes, whether they are consistent or not. What is zero to rounding is zero: the margin of a contact at its
// limit does not fail by its last bit.
bool SwitchedTrain::conditions(Instant now, const Key& modes, const Event& event, Conditions& out) {
    ++searches.trials;
    Key trial;
    trial.modes = modes.modes;
    locate(now, event.from, trial);
    locate_losses(now, event.gear, trial);
    if (some_redundant_) hold(regimes_[trial], now, event);
    trial = branches_at(regimes_[trial], trial, now);
    const SparseRegime& r = regimes_[trial];
    constexpr double none = std::numeric_limits<double>::infinity();
    out.assign(static_cast<std::size_t>(contacts()), {none, none, none});
    SparseFlow along(r.rate, now, room_);
    const auto clear = [](double value, double size) { return std::fabs(value) > rounding * size ? value : 0.0; };
    for (std::size_t g = 0; g < r.guards.size() && r.solvable; ++g) {
        const auto& guard = r.guards[g];
        if (guard.kind == Guard::capacity)
            out[guard.contact][guard.neighbour + 1] = clear(evaluate(guard.form, now), magnitude(guard.form, now));
        else if (guard.kind == Guard::set_off)
            out[guard.contact][guard.neighbour + 1] =
                clear(along.rate(guard.form, 1), along.rate_magnitude(guard.form, 1));
        else if (guard.kind == Guard::impact && event.at_rest[guard.contact] && !r.at_rest[guard.contact]) {
            // Two guards, one for each end of the gap: the flanks are at the end whose form is zero.
            if (evaluate(guard.form, now) == 0.0)
                out[guard.contact][1] = clear(along.rate(guard.form, 2), along.rate_magnitude(guard.form, 2));
        } else if (guard.kind == Guard::speed && event.at_rest[guard.contact] && !r.at_rest[guard.contact])
            out[guard.contact][1] = clear(along.rate(guard.form, 1), along.rate_magnitude(guard.form, 1));
    }
    return r.solvable && !interruption();
}

// The modes that contacts at rest come to along the way from before the event, where their modes were consistent, to
// the torques after it. On that way the torques of contacts that have stopped turn round, from what friction was to its
// opposite, until such a contact has no acceleration any more: then it is stuck. Inputs that jump go straight from
// their values before to those after. For given modes all conditions are linear over that way. The first to fail
// changes the mode of its contact: one that is stuck begins to slip where its torque reaches what it holds, one that
// slips is stuck where its acceleration falls to zero. A contact that then takes less than it held makes others follow
// at once, in the order in which their conditions fail while its torque falls.
Key SwitchedTrain::follow(const Instant& now, const Instant& before, const Event& event, const Key& from) {
    Key begin, end;
    for (int c = 0; c < contacts(); ++c) {
        const ContactPlace& p = places().contacts[c];
        if (p.bilateral) continue;
        if (!event.at_rest[c] || event.stopped[c]) begin.modes[c] = end.modes[c] = from.modes[c];
        if (event.stopped[c]) end.modes[c] = p.one_way ? std::int8_t{0} : static_cast<std::int8_t>(-from.modes[c]);
        if (event.with_guard && event.kind == Guard::capacity && event.contact == c)
            end.modes[c] = static_cast<std::int8_t>(event.neighbour);
    }
    double way = 0.0;
    Conditions before_change;
    constexpr double none = std::numeric_limits<double>::infinity();
    before_change.assign(static_cast<std::size_t>(contacts()), {none, none, none});
    for (int changes = 0; changes < most_changes * contacts(); ++changes) {
        Conditions first, last;
        if (!conditions(before, begin, event, first) || !conditions(now, end, event, last)) break;
        const Failure fails = first_failure(begin, end, first, last, before_change, way);
        if (fails.contact == nowhere) break;
        way = fails.way;
        begin.modes[fails.contact] = end.modes[fails.contact] = static_cast<std::int8_t>(fails.mode);
        for (int c = 0; c < contacts(); ++c)
            for (int m = 0; m < 3; ++m) before_change[c][m] = first[c][m] + way * (last[c][m] - first[c][m]);
    }
    // What stops may hold more than it took, or be kept at rest by what is stuck.
    const Ties ties = places().ties(end.modes);
    for (int c = 0; c < contacts(); ++c)
        if (begin.modes[c] != end.modes[c] && event.stopped[c] &&
            (holds_more_[c] || kept_at_rest(places().contacts[c], ties)))
            end.modes[c] = 0;
    return end;
}

// Where on the way, from `way` on, which condition fails first.
auto SwitchedTrain::first_failure(const Key& begin, const Key& end, Conditions& first, const Conditions& last,
                                  const Conditions& before_change, double way) const -> Failure {
    constexpr double tiny = 1e-9;
    Failure fails;
    double least_fall = std::numeric_limits<double>::infinity();  // share of the fall at the last change
    for (int c = 0; c < contacts(); ++c) {
        const bool turns = begin.modes[c] * end.modes[c] < 0;
        if (turns && !std::isfinite(first[c][1])) return {c, 0, way};  // others keep it at rest
        if (turns) first[c][1] *= -1.0;  // it slows down until its torque has turned round
        for (const int mode : {-1, 0, +1}) {
            const double low = first[c][mode + 1], high = last[c][mode + 1], value = low + way * (high - low);
            if (!std::isfinite(low) || !std::isfinite(high)) continue;
            if (value < -tiny * (std::fabs(low) + std::fabs(high))) {
                const double was = before_change[c][mode + 1];
                const double fall = std::isfinite(was) ? std::fmax(0.0, was) / (std::fmax(0.0, was) - value) : 0.0;
                if (!(fall < least_fall)) continue;
                least_fall = fall;
                fails = {c, turns && low < 0.0 ? begin.modes[c] : mode, way};
            } else if (std::isinf(least_fall) && high < low && high < 0.0) {
                const double zero = std::fmax(way, low / (low - high));
                // Of those that fail at once, to rounding, the first.
                if (zero < (fails.contact == nowhere ? 1.0 : fails.way - tiny)) fails = {c, mode, zero};
            }
        }
    }
    return fails;
}

}  // namespace lostmotion::model
