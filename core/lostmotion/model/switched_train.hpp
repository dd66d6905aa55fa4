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
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <memory>
#include <type_traits>
#include <utility>
#include <vector>

#include "../kernel/bit_set.hpp"
#include "../solver/status.hpp"
#include "assembly.hpp"
#include "held_torque.hpp"
#include "impulses.hpp"
#include "motion.hpp"
#include "scales.hpp"
#include "statics.hpp"

namespace lostmotion::model {

// The kernel's regimes have room for more guards than they use.
template <class R>
std::size_t guard_count(const R& r) {
    if constexpr (requires { r.n_guards; })
        return static_cast<std::size_t>(r.n_guards);
    else
        return r.guards.size();
}

// For how many guards there is room.
inline constexpr int max_guards = Any::guards;
template <class Sizes>
inline constexpr int guard_room = max_guards;
template <int coupled, int angles, int inputs, int memory, int contacts, int guards>
inline constexpr int guard_room<Dims<coupled, angles, inputs, memory, contacts, guards>> = guards;
template <>
inline constexpr int guard_room<Any> = Any::guards;

using lostmotion::Found;
using lostmotion::SearchCounts;

// Sizes: Layout, or the kernel's dimensions. Cache: regime(key) gives a regime that stays where it is; that of the
// kernel has entries, with the guards of a regime as a table.
template <class Sizes = Layout>
class SwitchedTrain {
 public:
    explicit SwitchedTrain(const Assembly& assembly) : SwitchedTrain(assembly, assembly.layout()) {}
    SwitchedTrain(const Assembly& assembly, const Sizes& sizes) : assembly_(assembly), n_(sizes) {
        set_near_event();
        const auto strike =
            std::count_if(train().gears.begin(), train().gears.end(), [](const Gear& g) { return g.strikes(); });
        has_flanks_ = strike > 0;
        least_flight_ = strike > 1 ? flight_among_others : one_flight;
        for (int c = 0; c < contacts(); ++c) {
            some_redundant_ = some_redundant_ || places().contacts[c].locked != nowhere;
            holds_more_[c] = !places().contacts[c].bilateral && holds_more(places().contacts[c]);
        }
    }

    const Assembly& assembly() const { return assembly_; }
    const Sizes& sizes() const { return n_; }
    Regime build(const Key& key) const { return assembly_.build(key); }

    // Regime at the start of a run, where nothing is known but the state.
    template <class Cache, class Now>
    Found start(Cache& cache, Now& now, Key& key) const;

    // Regime that follows `key` at this instant: after one of its guards has reached zero, or (fired = nullptr)
    // after an input has changed. Only the contact whose speed has reached zero has stopped, and a stop of a twist is
    // a turning point, which sets the hysteresis capacity anew (16). All other contacts that move go on in their
    // direction, however slowly: an input acts on the speeds through the accelerations only.
    // input: the inputs up to this instant.
    template <class Cache, class Now, class G, class Input>
    Found next(Cache& cache, Now& now, const G* fired, Key& key, const Input& input) const;

    // What each guard has to exceed, beside its share of its terms, to be far from an event.
    template <class Table, class Values>
    void near_event(const Table& guards, Values& out) const {
        StateOf<Sizes> state{};
        InputsOf<Sizes> input{};
        const Layout& n = assembly_.layout();
        for (int k = 0; k < n.states; ++k) state[k < n.coupled ? k : n_.coupled + k - n.coupled] = near_state_[k];
        for (int i = 0; i < n.inputs; ++i) input[i] = near_input_[i];
        guards.rate_magnitudes(state, input, out);
    }

    using Rest = Flags;
    // Sets the speeds of contacts at rest to what they are, to the last bit, and marks those that this implies.
    template <class X, class AtRest>
    void stop(X& x, AtRest& at_rest) const;
    template <class X>
    void set_tied_speeds(X& x, const Ties& ties) const;

    // The key in these modes, at the instant and the torques of another regime.
    template <class R, class Now>
    Key branches_at(const R& other, const Key& modes, const Now& now) const {
        Key key;
        key.modes = modes.modes;
        Torques T_2{};
        for (std::size_t g = 0; g < train().gears.size(); ++g) T_2[g] = evaluate(n_, other.output_torque[g], now);
        locate(now, key);
        locate_losses(now, T_2, key);
        return key;
    }

    double few = 27.0;  // up to so many combinations are tried one after the other; more are pivoted
    mutable SearchCounts searches;

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
        bool from_each_load = false;  // begin the search for the cell of a loss law from each load
        bool by_value = false;        // a guard that is zero to rounding holds, whatever its derivatives
        bool closest = false;         // take the combination that violates its guards least

        // The margins of a contact that has just come to a stop are zero by chance only.
        template <class G>
        bool by_value_alone(const G& g) const {
            return (by_value && g.kind != Guard::set_off) ||
                   (with_guard && kind == Guard::speed && g.kind == Guard::capacity && g.contact == contact);
        }
        // The solver has seen this regime to its end.
        bool has_ended(const Key& key) const { return with_guard && kind != Guard::speed && key == before; }
    };
    using Guards = BitSet<guard_room<Sizes>>;
    // For each contact at rest and each mode, -1, 0 and +1: negative where the contact has to change to that mode.
    // Margins of what is stuck, accelerations of what slips; infinite where there is no condition.
    using Conditions = std::vector<std::array<double, 3>>;
    // A guard of a contact that is violated.
    struct Violation {
        int contact = nowhere, mode = 0;  // the mode that it suggests
        int order = 0;
        double relative = 0.0;
        bool turning = false;
    };
    struct Trial {
        Found found = Found::inconsistent;
        bool turns_back = false;  // all that is violated is that what drives a contact to its limit turns back
    };
    // What of the contacts is violated; each by itself only where there is a list for them.
    struct Violated {
        std::vector<Violation>* each = nullptr;
        bool any = false, only_turning = true;

        void clear() {
            if (each != nullptr) each->clear();
            any = false;
            only_turning = true;
        }
        void add(const Violation& v) {
            if (each != nullptr) each->push_back(v);
            any = true;
            only_turning = only_turning && v.turning;
        }
    };

    int contacts() const { return assembly_.layout().contacts; }
    const Places& places() const { return assembly_.places(); }
    const Train& train() const { return assembly_.train(); }

    template <class Use>
    void each_coupling_contact(Use&& use) const {
        for (int c = 0; c < contacts(); ++c)
            if (places().contacts[c].kind == ContactPlace::coupling) use(c);
    }

    void set_near_event();
    template <class F>
    double near_event(const F& f) const {
        double sum = 0.0;
        const Layout& n = assembly_.layout();
        each_state_of(n_, f, [&](int k, double c) {
            const int at = k < n_.coupled ? k : n.coupled + k - n_.coupled;
            if (c != 0.0) sum += std::fabs(c) * near_state_[at];
        });
        each_input_of(n_, f, [&](int i, double c) {
            if (c != 0.0) sum += std::fabs(c) * near_input_[i];
        });
        return sum;
    }

    // Across an edge: the branch beyond and, where it shifts a memory, that.
    template <class G>
    static void cross(const G& guard, Key& key) {
        if (guard.branch != nowhere) key.branch[guard.branch] = static_cast<std::int16_t>(guard.neighbour);
    }
    template <class G, class Now>
    static void shift(const G& guard, Now& now) {
        if (guard.branch != nowhere && guard.memory != nowhere) now.memory[guard.memory] += guard.shift;
    }

    // What contacts at rest make of the speeds: found once for each set.
    struct Stopped {
        Rest at_rest, kept;
        Ties ties;
    };
    const Stopped& stopped(const Rest& at_rest) const;
    bool at_its_limit(const Key& key) const;
    bool pushes_against_rest(const Key& key) const;
    bool holds_more(const ContactPlace& c) const;
    template <class Cache, class Now>
    Found find(Cache& cache, Now& now, const Now& before, Event event, Key& key) const;
    template <class Cache, class Now>
    bool conditions(Cache& cache, Now now, const Key& modes, const Event& event, Conditions& out) const;
    template <class Cache, class Now>
    Key follow(Cache& cache, const Now& now, const Now& before, const Event& event, const Key& from) const;
    struct Failure {
        int contact = nowhere, mode = 0;
        double way = 1.0;
    };
    Failure first_failure(const Key& begin, const Key& end, Conditions& first, const Conditions& last,
                          const Conditions& before_change, double way) const;
    // In how many ways contacts at rest may stick and slip.
    double combinations(const Event& event) const {
        double n = 1.0;
        for (int c = 0; c < contacts(); ++c)
            if (event.at_rest[c] && !places().contacts[c].bilateral) n *= places().contacts[c].one_way ? 2.0 : 3.0;
        return n;
    }
    // One of them, by its number: the last contact changes first, from stuck to forward to backward. Returns how many
    // contacts slip.
    int combination(std::uint64_t number, const Event& event, const Key& from, Key& out) const {
        return combination(
            [&](std::uint64_t n) {
                const std::uint64_t mode = number % n;
                number /= n;
                return mode;
            },
            event, from, out);
    }
    // next(n): the mode of the next contact, below n.
    template <class Next>
        requires std::is_invocable_v<Next, std::uint64_t>
    int combination(Next&& next, const Event& event, const Key& from, Key& out) const {
        int slips = 0;
        for (int c = contacts(); c-- > 0;) {
            const ContactPlace& p = places().contacts[c];
            if (p.bilateral) continue;
            out.modes[c] = from.modes[c];
            if (event.at_rest[c]) {
                const std::uint64_t mode = next(p.one_way ? 2 : 3);
                out.modes[c] = mode == 0 ? 0 : mode == 1 && !p.one_way ? +1 : -1;
            }
            slips += out.modes[c] != 0;
        }
        return slips;
    }
    // Impulses: modes_impact.hpp.
    using MovedShafts = Flags;
    template <class Now>
    bool has_gap(int contact, const Now& now) const;
    // Do flanks close their gap, by more than rounding?
    template <class Now>
    bool approach(int contact, const Now& now) const {
        double speed = 0.0, size = 0.0;
        places().contacts[contact].each_shaft([&](int s, double per) {
            speed += per * now.x[places().shafts[s].speed];
            size += std::fabs(per * now.x[places().shafts[s].speed]);
        });
        const double side = now.x[places().contacts[contact].flanks] > 0.0 ? 1.0 : -1.0;
        return side * speed > 8.0 * std::numeric_limits<double>::epsilon() * size;
    }
    template <class Now>
    Impulses impulses(const Now& now, const Key& key) const;
    template <class Now>
    double speed_of(int contact, const Now& now) const {
        double speed = 0.0;
        places().contacts[contact].each_shaft(
            [&](int s, double per) { speed += per * now.x[places().shafts[s].speed]; });
        return speed;
    }
    template <class Cache, class Now, class G>
    Found strikes(Cache& cache, Now& now, const G& fired, Key& key) const;
    template <class Cache, class Now>
    Found land(Cache& cache, Now& now, const Impulses& after, Event event, const Now& past, Key& key) const;
    template <class Cache, class Now>
    Found find_after(Cache& cache, Now& now, const MovedShafts& moved, Event event, const Rest& before, const Now& past,
                     Key& key) const;
    template <class E, class Now>
    double time_to_rest(const E& e, const Now& now, int contact) const;
    template <class E, class Now>
    double time_to_rest(const E& e, const Now& now, const Now& before, const Impulses& joined, double energy) const;
    template <class Cache, class Now>
    bool close(Cache& cache, Now& now, const Impulses& struck, int contact, const Event& event, const Now& past,
               const Key& from, Key& key) const;
    template <class Cache, class Now>
    Found locks(Cache& cache, Now& now, const Event& event, const Now& past, Key& key) const;
    template <class Cache, class Now>
    bool locks_in_motion(Cache& cache, const Now& now, const Event& event, const Key& from, std::size_t gear) const;
    template <class Now>
    bool stop_with(Now& now, std::size_t gear, MovedShafts& moved, double& lost) const;

    template <class Cache, class Now>
    Found enumerate(Cache& cache, Now& now, const Event& event, const Key& from, Key& key) const;
    template <class Cache, class Now>
    Found pivot(Cache& cache, Now& now, const Event& event, Key modes, const Key& from, Key& key) const;
    template <class Cache, class Now>
    Trial settle(Cache& cache, Now& now, const Key& modes, const Event& event, Key& key, Violated violated = {}) const;
    template <class Cache, class Now>
    bool settle_on_corner(Cache& cache, Now& now, const Event& event, const Key& trial, Key& key) const;
    template <class Cache, class Now>
    Found settle_at_limit(Cache& cache, Now& now, const Key& modes, const Event& event, Key& key) const;
    template <class Cache, class Now>
    Trial walk(Cache& cache, Now& now, const Event& event, Key trial, Key& key, Violated violated = {}) const;
    template <class Cache, class Now>
    bool breaks_away(Cache& cache, Now& now, const Event& event, double margin_size, double near, Key& key) const;
    template <class E, class Now>
    bool turns_the_other_way(const E& e, const Now& now, const Event& event) const;
    template <class Now>
    void locate(const Now& now, Key& trial) const;
    // Where the motion of shafts is given, sets their speeds to what they are now. True if contacts that slip and whose
    // speeds follow from that alone have none: those are marked.
    template <class Now>
    bool follow_given(Now& now, const Key& key, Rest& rests) const;
    template <class Now>
    void locate_losses(const Now& now, const Torques& T_2, Key& trial) const;
    template <class R, class Now>
    void hold(const R& r, Now& now, const Event& event) const;
    template <class Now>
    double value_of(const Now& now, const Row& v) const;

    // What a cache knows of a regime: an entry of the kernel's, or the regime itself.
    template <class Cache>
    static auto& look_up(Cache& cache, const Key& key) {
        if constexpr (requires { cache.entry(key); })
            return cache.entry(key);
        else
            return cache.regime(key);
    }
    template <class E>
    static const auto& regime_of(const E& e) {
        if constexpr (requires { e.regime; })
            return e.regime;
        else
            return e;
    }
    // The regime that lies beyond an edge of another.
    template <class Cache, class E, class G>
    static const auto& beyond(Cache& cache, E& from, const G& edge) {
        const auto neighbour = [&] {
            Key k = regime_of(from).key;
            cross(edge, k);
            return k;
        };
        if constexpr (requires { from.regime; })
            return cache.beyond(from, static_cast<int>(&edge - from.regime.guards.data()), neighbour);
        else
            return cache.regime(neighbour());
    }
    template <class E, class Now>
    auto flow(const E& e, const Now& now) const {
        if constexpr (requires { e.regime; })
            return Flow<Sizes>(e.rates, now);
        else
            return RowFlow<Sizes, E, Now>(n_, e, now);
    }
    // The guards of the speeds of contacts that move: their modes were chosen by their speeds.
    template <class E, class AtRest>
    Guards moving(const E& e, const AtRest& at_rest) const {
        Guards out;
        if constexpr (requires { e.regime; }) {
            for (int k = 0; k < e.n_speeds; ++k)
                if (!at_rest[e.regime.guards[e.speeds[k]].contact]) out.set(e.speeds[k]);
        } else {
            for (std::size_t g = 0; g < guard_count(e); ++g)
                if (e.guards[g].kind == Guard::speed && !at_rest[e.guards[g].contact]) out.set(static_cast<int>(g));
        }
        return out;
    }
    // Calls use(guard, value, magnitude) for each guard that is not clear of zero, until it returns false.
    template <class E, class Now, class Use>
    void each_near_zero(const E& e, const Now& now, const Guards& ignored, Use&& use) const {
        const auto& r = regime_of(e);
        if constexpr (requires { e.regime; }) {
            typename std::decay_t<decltype(e.guards)>::Values constant, value, size;
            e.guards.constants(now.memory, constant);
            e.guards.evaluate(constant, now.x, now.input[0], value);
            e.guards.magnitudes(magnitudes(now.memory), magnitudes(now.x), now.input_magnitudes, size);
            Guards near;
            for (int g = 0; g < e.guards.rows(); g += vec_width) {
                const Vec clear = clear_of_zero * load(size.data() + g) + load(e.near_event.data() + g);
                near.set(g, all_bits & ~above(load(value.data() + g), clear));
            }
            (near - ignored - e.behind).each([&](int g) { return use(r.guards[g], value[g], size[g]); });
        } else {
            for (std::size_t g = 0; g < guard_count(r); ++g) {
                const auto& guard = r.guards[g];
                if (ignored[static_cast<int>(g)] || guard.behind) continue;
                const double value = evaluate(n_, guard.form, now), size = magnitude(n_, guard.form, now);
                if (value > clear_of_zero * size + near_event(guard.form)) continue;
                if (!use(guard, value, size)) return;
            }
        }
    }
    // A guard of a law or an input that does not hold just after now; those of contacts are collected.
    template <class E, class Now>
    auto first_left(const E& e, const Now& now, const Guards& ignored, const Event* event,
                    Violated& of_contacts) const {
        const auto& r = regime_of(e);
        auto along = flow(e, now);
        decltype(&r.guards[0]) left = nullptr;
        for (const auto& driver : r.drivers)
            if (turns_back(along, driver.torque)) of_contacts.add({driver.contact, 0, n_derivatives, 0.0, true});
        each_near_zero(e, now, ignored, [&](const auto& guard, double value, double size) {
            const Sign s = sign_after(along, guard.form, value, size, event != nullptr && event->by_value_alone(guard));
            if (s.sign >= 0) return true;
            if (!guard.is_of_contact()) {
                left = &guard;
                return false;
            }
            of_contacts.add({guard.contact, guard.kind == Guard::speed ? 0 : guard.neighbour,
                             s.order - Guard::acceleration_order(guard.kind), -s.relative,
                             guard.kind == Guard::turning});
            return true;
        });
        return left;
    }
    // Does what drives a contact at its limit turn back just after now?
    template <class F, class Form>
    static bool turns_back(F& along, const Form& torque) {
        for (int k = 1; k + 1 < static_cast<int>(n_derivatives); ++k) {
            const double rate = along.rate(torque, k);
            if (std::fabs(rate) > along.noise(along.rate_magnitude(torque, k), along.rate(torque, k + 1)))
                return rate < 0.0;
        }
        return false;
    }
    // Has it turned back where the inputs jump? A breakpoint that is met but for rounding is no jump: else a contact
    // would hold anew what it holds at rest, and another come to its limit.
    template <class Driver, class Input>
    bool falls(const Driver& driver, const Input& before, const Input& after) const {
        double change = 0.0, size = 0.0;
        each_input_of(n_, driver.torque, [&](int i, double share) {
            change += share * (after[i] - before[i]);
            size += std::fabs(share) * std::fmax(std::fabs(before[i]), std::fabs(after[i]));
        });
        return change < -rounding * size;
    }
    template <class E, class Now>
    double violation(const E& e, const Now& now, const Event& event) const;
    template <class R, class Now>
    double torque_change(const R& r, const Now& now, const Event& event) const {
        double sum = 0.0;
        for (std::size_t g = 0; g < train().gears.size(); ++g)
            sum += std::fabs(evaluate(n_, r.output_torque[g], now) - event.gear[g]);
        each_coupling_contact(
            [&](int c) { sum += std::fabs(evaluate(n_, r.contact_torque[c], now) - event.coupling[c]); });
        return sum;
    }
    template <class Cache, class E, class Now, class G>
    bool goes_on(Cache& cache, E& from, Now& now, const G& fired, Key& key) const;
    template <class E, class Now, class Input>
    bool stays(const E& e, const Now& now, const Input& input) const;

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

    const Assembly& assembly_;
    Sizes n_;
    std::vector<double> near_state_, near_input_;
    Rest holds_more_{};  // contacts that hold more than they take while they slip
    bool has_flanks_ = false;
    double least_flight_ = one_flight;
    bool some_redundant_ = false;  // while all contacts are at rest; else no one keeps another at rest
    // What has been found of sets of contacts and of modes, by their hash.
    mutable std::array<std::unique_ptr<Stopped>, 16> stopped_;
    struct Limit {
        decltype(Key::modes) modes;
        bool known = false, reached = false;
    };
    mutable std::array<Limit, 64> limits_;
    // Of each combination, how many contacts slip. Its memory is used again.
    mutable std::vector<int> slips_of_;
};

}  // namespace lostmotion::model
