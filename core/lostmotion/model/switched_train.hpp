// The train as a switched linear system: which regime follows at an event (docs/theory.md, contacts).
//
// A regime holds just after t if each of its guards g is positive there. Since the flow of a regime is known, that is
// decided at t itself: by the sign of the first of g, g', g'', ... that is not zero.
//
// Which contacts at rest stick is a mixed linear complementarity problem in their torques and accelerations. Of a few
// contacts whose problem has one solution the combinations are tried, those with most stuck first. All others are found
// on the way of the torques from before the event, along which one contact after the other changes its mode (Lemke's
// parametric pivoting): `follow`. Where contacts hold more than they take while they slip, that way selects one of
// several solutions. What it leaves violated, of a higher derivative or by losses, is mended by principal pivoting:
// `pivot`.
//
// The search is compiled once, for trains of any size: kernels of few states hand over their state (system.hpp).
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <memory>
#include <utility>
#include <vector>

#include "../base/interruption.hpp"
#include "../base/status.hpp"
#include "guards_after.hpp"
#include "held_torque.hpp"
#include "impulses.hpp"
#include "sparse_regime.hpp"
#include "statics.hpp"

namespace lostmotion::model {

using lostmotion::Found;
using lostmotion::SearchCounts;

class SwitchedTrain {
 public:
    using Guard = SparseRegime::Guard;
    using Inputs = decltype(Instant::input)::value_type;
    using Rest = Flags;

    explicit SwitchedTrain(const Assembly& assembly);

    SparseRegimes& regimes() { return regimes_; }

    // Regime at the start of a run, where nothing is known but the state.
    Found start(Instant& now, Key& key);

    // Regime that follows `key` at this instant: after one of its guards has reached zero, given by its number, or
    // (`nowhere`) after an input has changed. Only the contact whose speed has reached zero has stopped, and a stop of
    // a twist is a turning point, which sets the hysteresis capacity anew (16). All other contacts that move go on in
    // their direction, however slowly: an input acts on the speeds through the accelerations only.
    // input: the inputs up to this instant. given_rest: contacts that given motions bring to rest.
    Found next(Instant& now, int fired, Key& key, const Inputs& input, const Rest& given_rest = {});

    // Sets the speeds of shafts whose motion is given to what they are now. True if contacts that slip and whose
    // speeds follow from that alone have none: those are marked.
    template <class X, class Input>
    bool follow_given(X& x, const Input& input, const Key& key, Rest& rests) const;

    // Sets the speeds of contacts at rest to what they are, to the last bit, and marks those that this implies.
    template <class Now, class AtRest>
    void stop(Now& now, AtRest& at_rest) const;
    template <class X>
    void set_tied_speeds(X& x, const Ties& ties) const;

    // The regimes that the last call of `next` has tried, after a contact has come to rest or to its limit: all but the
    // last do not hold, by a guard of a contact alone, or are the one that has ended. Of a contact at its limit, the
    // first is that in which it slips and all others go on. Empty where more was needed.
    const std::vector<const SparseRegime*>& tried() const { return tried_; }
    // A twist that has come to rest has turned: that sets the hysteresis capacity anew (16).
    template <class Now>
    void turn(Now& now, const Rest& at_rest, const Flags& before, const Key& key) const;
    // The speed of a contact.
    const LinearForm& speed(int contact) const { return speeds_[static_cast<std::size_t>(contact)]; }
    // Does a contact that is to slip turn against that, by more than rounding may make? after: its speed's sign.
    static bool turns_the_other_way(int slip, const Sign& after) { return slip * after.relative < -max_violation; }

    // The key in these modes, at the instant and the torques of another regime.
    Key branches_at(const SparseRegime& other, const Key& modes, const Instant& now) const;

    double few = 27.0;  // up to so many combinations are tried one after the other; more are pivoted
    SearchCounts searches;
    int jams_at = nowhere;      // the contact of the gear that the last search found to jam, if it knows
    Interruption interruption;  // once it is requested, nothing that has been found counts

 private:
    using Torques = Few<double, 12>;
    struct Event {
        Rest at_rest{};
        Rest stopped{};                     // those that have come to rest at this event
        Torques gear{};                     // T_2 of each gear before [N m]
        Torques coupling{};                 // torque of each coupling before [N m], by contact
        bool with_guard = false;            // a guard has ended the regime before
        Guard::Kind kind = Guard::outside;  // and what it was
        int contact = nowhere, branch = nowhere, neighbour = 0, memory = nowhere;
        double shift = 0.0;
        Key before{};
        Key from{};                   // with the branch beyond the edge that has ended it: what laws remember
        bool from_each_load = false;  // begin the search for the cell of a loss law from each load
        bool by_value = false;        // a guard that is zero to rounding holds, whatever its derivatives
        bool closest = false;         // take the combination that violates its guards least
        Rest strikes{};               // those without a gap that approach it: their ends are not to be seen

        // The margins of a contact that has just come to a stop are zero by chance only.
        bool by_value_alone(const Guard& g) const {
            return (by_value && g.kind != Guard::set_off) ||
                   (with_guard && kind == Guard::speed && g.kind == Guard::capacity && g.contact == contact);
        }
        // The way in which its contact gives way or has slipped: what is tried in turn is tried so in a mirror, too.
        int ahead() const {
            if (!with_guard || contact == nowhere) return 1;
            return (kind == Guard::capacity ? neighbour : before.modes[contact]) < 0 ? -1 : 1;
        }
        // A contact that has been at its limit up to the end of a regime has no margin there: a value is what an
        // elimination has left of larger terms. Contacts that stop may take its torque with a jump.
        bool was_at_limit(const Guard& g) const {
            return with_guard && kind != Guard::speed && g.kind == Guard::capacity && g.contact != contact &&
                   before.modes[g.contact] == g.neighbour && at_rest[g.contact];
        }
        // The solver has seen this regime to its end.
        bool has_ended(const Key& key) const { return with_guard && kind != Guard::speed && key == before; }
    };
    // For each contact at rest and each mode, -1, 0 and +1: negative where the contact has to change to that mode.
    // Margins of what is stuck, accelerations of what slips; infinite where there is no condition.
    using Conditions = std::vector<std::array<double, 3>>;
    struct Trial {
        Found found = Found::inconsistent;
        bool turns_back = false;  // all that is violated is that what drives a contact to its limit turns back
        const SparseRegime* end = nullptr;  // where the walk has ended, if that is all it has come to
    };

    int contacts() const { return assembly_.layout().contacts; }
    const Places& places() const { return assembly_.places(); }
    const Train& train() const { return assembly_.train(); }

    template <class Use>
    void each_coupling_contact(Use&& use) const {
        for (int c = 0; c < contacts(); ++c)
            if (places().contacts[c].has_own_torque()) use(c);
    }

    template <class Wanted>
    void set_turns(Instant& now, Wanted&& wanted) const;

    // What contacts at rest make of the speeds: found once for each set.
    struct Stopped {
        Rest at_rest, kept;
        Ties ties;
    };
    const Stopped& stopped(const Rest& at_rest) const;
    bool at_its_limit(const Key& key) const;
    bool pushes_against_rest(const Key& key) const;
    bool holds_more(const ContactPlace& c) const;
    // before(): the instant before the event, asked for where the way of the torques is followed.
    Found find(Instant& now, const std::function<Instant()>& before, Event event, Key& key);
    bool conditions(Instant now, const Key& modes, const Event& event, Conditions& out);
    Key follow(const Instant& now, const Instant& before, const Event& event, const Key& from);
    struct Failure {
        int contact = nowhere, mode = 0;
        double way = 1.0;
    };
    Failure first_failure(const Key& begin, const Key& end, Conditions& first, const Conditions& last,
                          const Conditions& before_change, double way) const;
    double combinations(const Event& event) const;
    template <class Next>
    int combination(Next&& next, const Event& event, const Key& from, Key& out) const;
    int numbered_combination(std::uint64_t number, const Event& event, const Key& from, Key& out) const;

    // Impulses: modes_impact.cpp.
    using MovedShafts = Flags;
    bool has_gap(int contact, const Instant& now) const;
    bool approach(int contact, const Instant& now) const;
    Impulses impulses(const Instant& now, const Key& key) const;
    double speed_of(int contact, const Instant& now) const;
    Found strikes(Instant& now, const Guard& fired, Key& key);
    Found land(Instant& now, const Impulses& after, Event event, const Instant& past, Key& key);
    Found find_after(Instant& now, const MovedShafts& moved, Event event, const Rest& before, const Instant& past,
                     Key& key);
    double time_to_rest(const SparseRegime& e, const Instant& now, int contact);
    double time_to_rest(const SparseRegime& e, const Instant& now, const Instant& before, const Impulses& joined,
                        double energy);
    bool close(Instant& now, const Impulses& struck, int contact, const Event& event, const Instant& past,
               const Key& from, Key& key);
    Found locks(Instant& now, const Event& event, const Instant& past, Key& key);
    Flags parts_that_fail(const Instant& now, const Event& event, const Key& from);
    int jams(const Instant& now, const Event& event, const Key& from);
    bool locks_in_motion(const Instant& now, const Event& event, const Key& from, std::size_t gear);
    enum class Slowed { stopped, joined, impossible };
    Slowed slow_down(Instant& now, std::size_t gear, Flags& joined, MovedShafts& moved) const;

    Found enumerate(Instant& now, const Event& event, const Key& from, Key& key);
    std::vector<int> parts_at(const Event& event) const;
    std::vector<Violation> of_neighbours(const Key& modes, const Event& event) const;
    Found pivot(Instant& now, const Event& event, Key modes, const Key& from, Key& key);
    Trial settle(Instant& now, const Key& modes, const Event& event, Key& key, Violated violated = {});
    bool settle_on_corner(Instant& now, const Event& event, const Key& trial, Key& key);
    Found settle_at_limit(Instant& now, const Key& modes, const Event& event, Key& key);
    Trial walk(Instant& now, const Event& event, Key trial, Key& key, Violated violated = {});
    bool drop_rounding(const SparseRegime& old, const Instant& past, Event& event) const;
    bool breaks_away(Instant& now, const Event& event, double margin_size, double near, Key& key);
    void note(const Trial& trial);
    void locate(const Instant& now, const Key& from, Key& trial) const;
    void locate_losses(const Instant& now, const Torques& T_2, Key& trial) const;
    void hold(const SparseRegime& r, Instant& now, const Event& event) const;
    double value_of(const Instant& now, const Row& v) const;
    double violation(const SparseRegime& e, const Instant& now, const Event& event);
    double torque_change(const SparseRegime& r, const Instant& now, const Event& event) const;

    static constexpr double max_violation = 1e-6;                                      // that rounding may make
    static constexpr double on_corner = 8.0 * std::numeric_limits<double>::epsilon();  // of an angle and its period
    // Flights of this height, by the backlash, are not followed: those of one gear alone make no difference to others.
    static constexpr double one_flight = 1e-6, flight_among_others = rounding;
    // The last round at an instant is that in which the energy of approach is this share of the first.
    static constexpr double negligible = 0x1p-80;
    static constexpr int most_rounds = 4096;
    static constexpr double unresolved = 1e4 * std::numeric_limits<double>::epsilon();  // of the time
    static constexpr double for_ever = 1e9;                                             // [s]
    static constexpr int most_changes = 4;  // of the mode of each contact along the way of the torques
    static constexpr std::size_t from_one_start = 300, longest_pivoting = 600;

    const Guard* first_left(const SparseRegime& r, const Instant& now, const std::vector<std::size_t>& ignored,
                            const Event& event, Violated& of_contacts);
    static double size_at_turn(const Guard& guard, const Instant& now);
    // Is a guard the speed of a contact that moves, whose mode was chosen by that speed, or the end that it is about to
    // strike?
    static bool is_of_moving(const Guard& g, const Event& event) {
        return (g.kind == Guard::speed && !event.at_rest[g.contact]) ||
               (g.kind == Guard::impact && g.branch == nowhere && event.strikes[g.contact]);
    }

    const Assembly& assembly_;
    SparseRegimes regimes_;
    SparseFlow::Room room_;
    Rest holds_more_{};  // contacts that hold more than they take while they slip
    bool has_impacts_ = false;
    double least_flight_ = one_flight;
    bool some_redundant_ = false;  // while all contacts are at rest; else no one keeps another at rest
    // What has been found of sets of contacts and of modes, by their hash.
    mutable std::array<std::unique_ptr<Stopped>, 16> stopped_;
    struct Limit {
        decltype(Key::modes) modes;
        bool known = false, reached = false;
    };
    mutable std::array<Limit, 64> limits_;
    std::vector<int> slips_of_;  // how many contacts slip in each combination; its memory is used again
    std::vector<OwnForm> speeds_;
    std::vector<const SparseRegime*> tried_;
    bool by_trials_ = false;  // all that the search has done so far
};

template <class Now>
void SwitchedTrain::turn(Now& now, const Rest& at_rest, const Flags& before, const Key& key) const {
    for (std::size_t g = 0; g < train().gears.size(); ++g) {
        const GearPlace& p = places().gears[g];
        if (p.hysteresis != nowhere && at_rest[p.contact] && !before[p.contact])
            now.memory[p.hysteresis] = assembly_.stiffness_factor(static_cast<int>(g), key) *
                                       train().gears[g].law.hysteresis_capacity(now.x[p.twist]);
    }
}

template <class Now, class AtRest>
void SwitchedTrain::stop(Now& now, AtRest& at_rest) const {
    Rest here;
    for (int c = 0; c < contacts(); ++c)
        if (at_rest[c]) here[c] = true;
    const Stopped& all = stopped(here);
    auto& x = now.x;
    for (int c = 0; c < contacts(); ++c) at_rest[c] = all.kept[c] && places().contacts[c].may_rest(now);
    if (places().driven.empty()) {
        set_tied_speeds(x, all.ties);
    } else {  // whose speeds stay what they are, to the last bit
        std::vector<std::int8_t> modes;
        for (int c = 0; c < contacts(); ++c) modes.push_back(at_rest[c] ? 0 : 1);
        set_tied_speeds(x, places().ties(modes));
    }
}

template <class X>
void SwitchedTrain::set_tied_speeds(X& x, const Ties& ties) const {
    for (std::size_t s = 0; s < train().shafts.size(); ++s) {
        double& w = x[places().shafts[s].speed];
        if (!ties.at_rest[s] && !ties.follows(static_cast<int>(s))) continue;
        w = 0.0;
        ties.each_share(static_cast<int>(s), [&](int k, double share) { w += x[places().shafts[k].speed] * share; });
    }
}

template <class X, class Input>
bool SwitchedTrain::follow_given(X& x, const Input& input, const Key& key, Rest& rests) const {
    if (places().driven.empty()) return false;
    for (const int s : places().driven) x[places().shafts[s].speed] = input[places().shafts[s].given_speed];
    const Ties ties = places().ties(key.modes);
    bool some = false;
    for (int c = 0; c < contacts(); ++c) {
        if (key.modes[c] == 0) continue;
        const Shares moves = tied_speed(places().contacts[c], ties);
        const auto is_given = [&](int s) { return std::ranges::binary_search(places().driven, s); };
        if (moves.empty() || !std::ranges::all_of(moves, is_given, &Share::shaft)) continue;
        double speed = 0.0;
        for (const Share& s : moves) speed += s.share * x[places().shafts[s.shaft].speed];
        rests[c] = speed == 0.0;
        some = some || rests[c];
    }
    return some;
}

}  // namespace lostmotion::model
