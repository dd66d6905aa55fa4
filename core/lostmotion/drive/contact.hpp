// Set-valued dry contacts: which combination of stuck and slipping is consistent (docs/theory.md, contacts).
//
// A regime holds just after t if each of its guards g is positive there. Since the flow of a regime is known, that
// is decided at t itself: by the sign of the first of g, g', g'', ... that is not zero. So break-away, reversal,
// touching a boundary and several of these at once are one rule, and no step has to be tried out.
#pragma once

#include <algorithm>
#include <bit>
#include <limits>
#include <optional>
#include <utility>

#include "../kernel/flow.hpp"
#include "../solver/course.hpp"
#include "../solver/switching.hpp"
#include "drive.hpp"

namespace lostmotion {

// The drive as a switched linear system: which regime follows at an event.
class SwitchedDrive {
 public:
    using Dims = DriveDims;
    using Key = RegimeKey;
    using Regime = lostmotion::Regime;
    using Guard = lostmotion::Guard;

    explicit SwitchedDrive(const Drive& drive) : drive_(drive) { drive_changed(); }
    // To be called when the drive that this refers to has been given other parameters.
    void drive_changed() {
        (far_from_event * lostmotion::load(drive_.rated_scale())).store(near_state_.data());
        near_input_ = {far_from_event, far_from_event * drive_.gearbox.rated_output_torque};
    }
    // What each guard has to exceed, beside its share of its terms, to be far from an event.
    void near_event(const GuardTable& guards, GuardTable::Values& out) const {
        guards.rate_magnitudes(near_state_, near_input_, out);
    }
    // The twists of gears, whose rates are the speeds that end a regime by touching zero.
    static constexpr int n_twists() { return 1; }
    static constexpr int twist_state(int) { return twist; }
    // A rigid gear is none: it holds whatever acts.
    bool has_dry_contacts() const {
        return drive_.has(input_contact) || drive_.has(load_contact) || drive_.gearbox.has_hysteresis();
    }
    static const LinearForm& torque_at_load(const Regime& r) { return r.output_torque; }
    const Drive& drive() const { return drive_; }
    Regime build(const RegimeKey& key) const { return drive_.build(key); }

    // Regime at the start of a run, where nothing is known but the state.
    template <class Cache>
    Found start(Cache& cache, Instant& now, RegimeKey& key) const {
        for (int c = 0; c < n_contacts; ++c) key.modes[c] = drive_.has(static_cast<Contact>(c)) ? 1 : absent;
        direct(now.x, key);
        std::array<bool, n_contacts> at_rest = at_exact_rest(now.x);
        if (drive_.rigid()) at_rest[twist_contact] = true;
        const double P = drive_.rigid() ? now.memory.locked_torque : drive_.gearbox.curve.torque(now.x[twist]);
        return find(cache, now, {at_rest, P}, key);
    }

    // Regime that follows `key` at this instant: after one of its guards has reached zero, or (fired = nullptr)
    // after an input has changed. Only the contact whose speed has reached zero has stopped, and a stop of the twist is
    // a turning point, which sets the hysteresis capacity anew (16). All other contacts that move go on in their
    // direction, however slowly: an input acts on the speeds through the accelerations only.
    // input: the inputs up to this instant.
    template <class Cache>
    Found next(Cache& cache, Instant& now, const Guard* fired, RegimeKey& key,
               const std::array<double, n_inputs>& input) const {
        if (fired != nullptr ? goes_on(cache, now, *fired, key) : stays(cache, now, key, input)) return Found::yes;
        const Regime& old = cache.regime(key);
        const double T_2 = evaluate(old.output_torque, now.x, now.memory, input);
        std::array<bool, n_contacts> at_rest = old.at_rest;
        if (fired != nullptr && fired->kind == Guard::speed) at_rest[fired->contact] = true;
        stop(now.x, at_rest);
        if (at_rest[twist_contact] && !old.at_rest[twist_contact] && drive_.gearbox.has_hysteresis())
            now.memory.hysteresis_capacity = drive_.gearbox.hysteresis_capacity(now.x[twist]);
        Event event{at_rest, T_2, fired, key};
        if (fired != nullptr && fired->kind == Guard::capacity && breaks_away(cache, now, event, key))
            return Found::yes;
        return find(cache, now, event, key);
    }

    // Lets the contacts that slip do so in the direction of their speeds: for a state that the motion has not led to.
    void direct(const State& x, RegimeKey& key) const {
        for (int k = 0; k < n_contacts; ++k) {
            if (key.modes[k] == 0 || key.modes[k] == absent) continue;
            const double speed = evaluate(drive_.contact_speed(static_cast<Contact>(k)), x, {}, {});
            if (speed != 0.0) key.modes[k] = speed > 0.0 ? +1 : -1;
        }
    }

    // Sets the speeds of contacts at rest to what they are, to the last bit. Two at rest imply the third.
    void stop(State& x, std::array<bool, n_contacts>& at_rest) const {
        if (at_rest[0] + at_rest[1] + at_rest[2] >= 2) at_rest = {true, true, true};
        if (at_rest[input_contact]) x[motor_speed] = 0.0;
        if (at_rest[load_contact]) x[load_speed] = 0.0;
        if (at_rest[twist_contact]) x[load_speed] = x[motor_speed] * (1.0 / drive_.gearbox.ratio);
    }

 private:
    enum class Search {
        lasting,         // does a regime go on? A guard that is zero to rounding has not ended it
        from_before,     // piece and cell by a walk from those of the output torque before
        from_each_load,  // by a walk from each load of the map
        closest,         // the same; the combination that violates its guards least
    };

    // What the search for the regime after an event goes by.
    struct Event {
        std::array<bool, n_contacts> at_rest;
        double T_2;                    // the output torque before [N m]
        const Guard* fired = nullptr;  // what ended the regime before, if not an input
        RegimeKey before{};
        Search search = Search::from_before;
        std::optional<Modes> refuted{};  // not consistent from before

        // The margins of a contact that has just come to a stop are zero by chance only. If one is, the contact may
        // well rest for that moment, and breaks away again. So their derivatives, which rounding may falsify, are not
        // needed.
        bool by_value_alone(const Guard& g) const {
            return search == Search::lasting || (fired != nullptr && fired->kind == Guard::speed &&
                                                 g.kind == Guard::capacity && g.contact == fired->contact);
        }
        // The solver has seen this regime to its end. Where the motion has all but come to rest, the derivatives at the
        // instant alone may be too small to tell that it ends.
        bool has_ended(const RegimeKey& key) const {
            return fired != nullptr && fired->kind != Guard::speed && key == before;
        }
    };

    // Crosses into the neighbour that a guard of the curve, the map or the amplifier leads to.
    static void cross(const Guard& guard, RegimeKey& key) {
        switch (guard.kind) {
            case Guard::torsion_piece: key.piece = static_cast<std::int16_t>(guard.neighbour); break;
            case Guard::loss_cell: key.cell = guard.neighbour; break;
            case Guard::loss_cell_back: key.cell_back = guard.neighbour; break;
            case Guard::amplifier: key.amplifier = static_cast<std::int8_t>(guard.neighbour); break;
            default: break;
        }
    }

    std::array<bool, n_contacts> at_exact_rest(const State& x) const {
        const double w_M = x[motor_speed], w = x[load_speed];
        return {w_M == 0.0, w_M * (1.0 / drive_.gearbox.ratio) == w, w == 0.0};
    }

    // A contact whose capacity has been overcome begins to slip that way, from rest with no acceleration: the torques
    // are those before. Its jerk has the sign of the fall of the capacity's margin, so that there is nothing to decide
    // as long as all others go on as they were. If the capacity itself has gone with its margin, as where a load that
    // alone holds a self-locking gear reverses, the contact may as well stay stuck.
    template <class Cache>
    bool breaks_away(Cache& cache, Instant& now, Event& event, RegimeKey& key) const {
        const Contact c = event.fired->contact;
        const auto& ended = cache.entry(event.before);
        const auto guard = static_cast<std::size_t>(event.fired - ended.regime.guards.data());
        if (magnitude(event.fired->form, now.x, now.memory, now.input[0]) <= ended.near_event[guard]) return false;
        Modes modes = key.modes;
        modes[c] = static_cast<std::int8_t>(event.fired->neighbour);
        Event slipping{event.at_rest, event.T_2};
        slipping.at_rest[c] = false;
        if (at_its_limit(modes)) return false;
        const Found found = settle(cache, now, modes, slipping, key);
        if (found == Found::inconsistent) event.refuted = modes;
        return found == Found::yes;
    }

    // Usually piece and cell are found by a walk from those before. If the guards that are zero or nearly so leave no
    // combination, the motion is too small beside its torques for rounding to tell which of them rise: then the one
    // that violates its guards least is taken. A drive that jams violates them by more.
    template <class Cache>
    Found find(Cache& cache, Instant& now, Event event, RegimeKey& key) const {
        const Combinations combinations = combinations_after(event, key.modes);
        const Found found = search(cache, now, combinations, event, key);
        if (found == Found::yes) return found;
        for (const Search further : {Search::from_each_load, Search::closest}) {
            if (further == Search::from_each_load && drive_.gearbox.losses != Gearbox::loss_map) continue;
            event.search = further;
            if (search(cache, now, combinations, event, key) == Found::yes) return Found::yes;
        }
        return found;
    }

    // Two speeds that are kept at zero keep the third; so do input and load that a stuck twist turns together, if they
    // are to slip against each other. Then a contact that "slips" does not move: it gives all that it can, and the
    // output torque, which everything at rest leaves open, follows from that.
    static bool at_its_limit(const Modes& modes) {
        const auto [input, slip, bearing] = modes;
        if (input == absent || slip == absent || bearing == absent) return false;
        const int stuck = (input == 0) + (slip == 0) + (bearing == 0);
        return stuck == 2 || (slip == 0 && input * bearing < 0);
    }

    // The combinations of modes that may follow, in the order in which they are tried: those with most contacts stuck
    // first, those with a contact at its limit last.
    class Combinations {
     public:
        void insert(const Modes& modes) {
            const int rank =
                (modes[0] != 0) + (modes[1] != 0) + (modes[2] != 0) + (at_its_limit(modes) ? n_contacts + 1 : 0);
            int k = size_++;
            for (; k > 0 && rank_[k - 1] > rank; --k) {
                modes_[k] = modes_[k - 1];
                rank_[k] = rank_[k - 1];
            }
            modes_[k] = modes;
            rank_[k] = rank;
        }
        const Modes* begin() const { return modes_.data(); }
        const Modes* end() const { return modes_.data() + size_; }

     private:
        static constexpr int max_count = 27;
        std::array<Modes, max_count> modes_;
        std::array<int, max_count> rank_;
        int size_ = 0;
    };
    Combinations combinations_after(const Event& event, const Modes& before) const {
        std::array<Modes, n_contacts> choices{};
        std::array<int, n_contacts> n{};
        for (int k = 0; k < n_contacts; ++k) {
            const auto c = static_cast<Contact>(k);
            if (!drive_.has(c)) {
                choices[k][n[k]++] = absent;
            } else if (c == twist_contact && drive_.rigid()) {
                choices[k][n[k]++] = 0;
            } else if (event.at_rest[c]) {
                for (const int mode : {0, +1, -1}) choices[k][n[k]++] = static_cast<std::int8_t>(mode);
            } else {
                choices[k][n[k]++] = before[c];
            }
        }
        Combinations all;
        for (int a = 0; a < n[0]; ++a)
            for (int b = 0; b < n[1]; ++b)
                for (int c = 0; c < n[2]; ++c) all.insert({choices[0][a], choices[1][b], choices[2][c]});
        return all;
    }

    // The first combination that is consistent. While everything is at rest the output torque stays as it was, and
    // gives way only if neither that nor a motion is consistent, and then by as little as it can.
    template <class Cache>
    Found search(Cache& cache, Instant& now, const Combinations& combinations, const Event& event,
                 RegimeKey& key) const {
        const bool closest = event.search == Search::closest;
        const Memory before = now.memory;  // all that a trial may change
        Found worst = Found::inconsistent;
        struct {
            double price;
            RegimeKey key;
            Memory memory;
            bool found = false;
        } best{closest ? max_violation : std::numeric_limits<double>::infinity(), key, before};
        for (const Modes& modes : combinations) {
            if (event.search == Search::from_before && modes == event.refuted) continue;
            now.memory = before;
            RegimeKey trial;
            const Found found = at_its_limit(modes) ? settle_at_limit(cache, now, modes, event, trial)
                                                    : settle(cache, now, modes, event, trial);
            if (found == Found::outside) worst = found;
            if (found != Found::yes) continue;
            const double price = closest               ? violation(cache.entry(trial), now, event)
                                 : at_its_limit(modes) ? torque_change(cache.regime(trial), now, event)
                                                       : 0.0;
            if (price < best.price) best = {price, trial, now.memory, true};
            if (price == 0.0) break;
        }
        if (!best.found) return worst;
        key = best.key;
        now.memory = best.memory;
        return Found::yes;
    }

    // Is this combination, in which a contact is at its limit, consistent, or, if what drives it there turns back, does
    // everything rest at that torque?
    template <class Cache>
    Found settle_at_limit(Cache& cache, Instant& now, const Modes& modes, const Event& event, RegimeKey& key) const {
        Event thorough = event;
        thorough.search = std::max(event.search, Search::from_each_load);
        const Found found = settle(cache, now, modes, thorough, key);
        if (found != Found::inconsistent || event.search == Search::closest) return found;
        thorough.search = Search::closest;
        if (settle(cache, now, modes, thorough, key) != Found::yes) return found;
        Event standing = event;
        standing.T_2 = evaluate(cache.regime(key).output_torque, now.x, now.memory, now.input[0]);
        return settle(cache, now, {0, 0, 0}, standing, key);
    }

    // Is this combination of modes consistent? Piece and cell are found by a walk that begins at what the torque T_2
    // was.
    template <class Cache>
    Found settle(Cache& cache, Instant& now, const Modes& modes, const Event& event, RegimeKey& key) const {
        double T_2 = event.T_2;
        RegimeKey trial;
        trial.modes = modes;
        const Gearbox& gearbox = drive_.gearbox;
        const double d = now.x[twist], E = now.input[0][0];
        if (drive_.motor.limits_voltage() && std::fabs(E) > drive_.motor.voltage_limit)
            trial.amplifier = E > 0.0 ? 1 : -1;
        if (!drive_.rigid()) {
            trial.piece = static_cast<std::int16_t>(gearbox.curve.locate(d));
            const int slip = modes[twist_contact];
            if (slip != 0)
                T_2 = gearbox.curve.torque(d) + (slip == absent ? 0.0 : slip * now.memory.hysteresis_capacity);
        }
        if (modes[0] == 0 && modes[1] == 0 && modes[2] == 0 && !hold(now, T_2)) return Found::inconsistent;
        if (gearbox.losses != Gearbox::loss_map) return walk(cache, now, event, trial, key);
        const int s = modes[input_contact];
        const double mu = T_2 / gearbox.rated_output_torque;
        const double v = std::fabs(now.x[motor_speed]) / gearbox.rated_input_speed;
        trial.cell = s == 0 ? gearbox.map.load_interval(mu) : gearbox.map.triangle(s * mu, v);
        trial.cell_back = s == 0 ? gearbox.map.load_interval(-mu) : 0;
        const Found found = walk(cache, now, event, trial, key);
        if (found != Found::inconsistent || event.search == Search::from_before || s == 0 || modes[twist_contact] != 0)
            return found;
        // The torque that keeps the twist at rest depends on the cell, and the cell on the torque.
        for (int j = 0; j < gearbox.map.load_intervals(); ++j) {
            const double middle = 0.5 * (gearbox.map.load_interval_lower(j) + gearbox.map.load_interval_upper(j));
            for (const int half : {0, 1}) {  // of the two triangles at this speed
                trial.cell = gearbox.map.triangle(middle, v) ^ half;
                const Found other = walk(cache, now, event, trial, key);
                if (other == Found::yes) return other;
            }
        }
        return found;
    }

    // From a piece and a cell across each of their edges that is violated, until none is: do the contacts hold there?
    template <class Cache>
    Found walk(Cache& cache, const Instant& now, const Event& event, RegimeKey trial, RegimeKey& key) const {
        constexpr int longest_walk = 400;
        RegimeKey previous = trial;
        unsigned along = 0;  // edges that lead back to where the walk came from: the motion goes along them
        for (int step = 0; step < longest_walk; ++step) {
            const auto& entry = cache.entry(trial);
            if (!entry.regime.solvable) return Found::inconsistent;
            const auto [left, overcome] = violated(entry, now, moving(entry, event) | along, &event);
            if (left != nullptr && left->kind == Guard::outside) return Found::outside;
            if (left == nullptr) {
                if (overcome && event.search != Search::closest) return Found::inconsistent;
                if (event.has_ended(trial) && event.search != Search::closest) {
                    if (!event.fired->is_edge()) return Found::inconsistent;
                    cross(*event.fired, trial);
                }
                key = trial;
                return Found::yes;
            }
            RegimeKey next = trial;
            cross(*left, next);
            if (step > 0 && next == previous) {
                along |= 1u << (left - entry.regime.guards.data());
                continue;
            }
            previous = std::exchange(trial, next);
            along = 0;
        }
        return Found::inconsistent;
    }

    // The guards of the speeds of contacts that move, as bits: their modes were chosen by their speeds.
    template <class Entry>
    static unsigned moving(const Entry& entry, const Event& event) {
        unsigned guards = 0;
        for (int c = 0; c < n_contacts; ++c)
            if (!event.at_rest[c]) guards |= entry.speeds[c];
        return guards;
    }

    // By how much the output torque changes with a regime [N m].
    static double torque_change(const Regime& r, const Instant& now, const Event& event) {
        return std::fabs(evaluate(r.output_torque, now.x, now.memory, now.input[0]) - event.T_2);
    }

    // By how much the contacts' guards of a regime are violated, each in units of the sum of its terms' magnitudes: by
    // the value or, of one that is zero to rounding, by the rate.
    template <class Entry>
    static double violation(const Entry& entry, const Instant& now, const Event& event) {
        const unsigned ignored = moving(entry, event);
        Flow<DriveDims> flow(entry.rates, now);
        double worst = 0.0;
        for (int k = 0; k < entry.regime.n_guards; ++k) {
            if ((entry.contacts & ~ignored & 1u << k) == 0) continue;
            const LinearForm& form = entry.regime.guards[k].form;
            const double value = evaluate(form, now.x, now.memory, now.input[0]);
            const double size = magnitude(form, now.x, now.memory, now.input[0]);
            const double rate = flow.rate(form, 1), rate_magnitude = flow.rate_magnitude(form, 1);
            const bool zero = std::fabs(value) <= flow.noise(size, rate);
            if (zero && rate < 0.0 && !event.by_value_alone(entry.regime.guards[k]))
                worst = std::fmax(worst, -rate / rate_magnitude);
            else if (!zero && value < 0.0)
                worst = std::fmax(worst, -value / size);
        }
        return worst;
    }

    // A guard of the curve, the map or the amplifier that does not hold just after now, and whether a contact's does
    // not. Guards that are set in `ignored` are not looked at.
    template <class Entry>
    std::pair<const Guard*, bool> violated(const Entry& entry, const Instant& now, unsigned ignored,
                                           const Event* event = nullptr) const {
        const GuardTable& guards = entry.guards;
        GuardTable::Values constant, value, size;
        guards.constants(now.memory, constant);
        guards.evaluate(constant, now.x, now.input[0], value);
        guards.magnitudes(magnitudes(now.memory), magnitudes(now.x), now.input_magnitudes, size);
        unsigned near = 0;
        for (int g = 0; g < guards.rows(); g += vec_width)
            near |= (all_bits & ~above(load(&value[g]), clear_of_zero * load(&size[g]) + load(&entry.near_event[g])))
                    << g;
        near &= ~(ignored | entry.behind);
        bool overcome = entry.regime.driving_input >= 0 && turns_back(entry.regime, now);
        if (near == 0) return {nullptr, overcome};
        Flow<DriveDims> flow(entry.rates, now);
        for (; near != 0; near &= near - 1) {
            const int k = std::countr_zero(near);
            const bool by_value_alone = event != nullptr && event->by_value_alone(entry.regime.guards[k]);
            // The form out of the table, which is at hand.
            if (sign_after(flow, guards.form(k), value[k], size[k], by_value_alone).sign >= 0) continue;
            if ((entry.contacts >> k & 1) == 0) return {&entry.regime.guards[k], overcome};
            overcome = true;
        }
        return {nullptr, overcome};
    }

    // Does the input that drives a contact at its limit turn back just after now?
    static bool turns_back(const Regime& r, const Instant& now) {
        const auto way = [&](std::size_t k) {
            return r.driving_way * now.input[k][static_cast<std::size_t>(r.driving_input)];
        };
        for (std::size_t k = 1; k + 1 < n_derivatives; ++k)
            if (std::fabs(way(k)) > time_rounding * std::fabs(now.time * way(k + 1))) return way(k) < 0.0;
        return false;
    }

    // Across an edge of the curve, the map or the amplifier the motion is smooth enough for every contact to go on as
    // it was; if that is consistent there is nothing to search.
    template <class Cache>
    bool goes_on(Cache& cache, const Instant& now, const Guard& fired, RegimeKey& key) const {
        if (!fired.is_edge()) return false;
        auto& from = cache.entry(key);
        const auto& entry = cache.beyond(from, static_cast<int>(&fired - from.regime.guards.data()), [&] {
            RegimeKey beyond = key;
            cross(fired, beyond);
            return beyond;
        });
        if (!entry.regime.solvable) return false;
        const auto [left, overcome] = violated(entry, now, 0);
        if (left != nullptr || overcome) return false;
        key = entry.regime.key;
        return true;
    }

    // An input has changed: does the regime go on? The contacts that move keep their direction. A guard that is zero to
    // rounding has not ended it; the solver finds it if it goes on to fall. An input that jumps back turns back.
    template <class Cache>
    bool stays(Cache& cache, const Instant& now, const RegimeKey& key,
               const std::array<double, n_inputs>& input) const {
        const auto& entry = cache.entry(key);
        if (const int i = entry.regime.driving_input;
            i >= 0 && entry.regime.driving_way * (now.input[0][i] - input[i]) < 0)
            return false;
        Event lasting{entry.regime.at_rest, 0.0};
        lasting.search = Search::lasting;
        const auto [left, overcome] = violated(entry, now, moving(entry, lasting), &lasting);
        return left == nullptr && !overcome;
    }

    // Everything is at rest: T_2 stays where it was, or at the nearest value that twist and load contact can hold.
    bool hold(Instant& now, double T_2) const {
        const double M_Z = now.input[0][1], T_f = drive_.load.friction_torque;
        double low = M_Z - T_f, high = M_Z + T_f;
        if (!drive_.rigid()) {
            const double P = drive_.gearbox.curve.torque(now.x[twist]), h = now.memory.hysteresis_capacity;
            low = std::max(low, P - h);
            high = std::min(high, P + h);
        }
        if (low > high) return false;
        now.memory.locked_torque = std::clamp(T_2, low, high);
        return true;
    }

    static constexpr double max_violation = 1e-6;  // that rounding may make

    const Drive& drive_;
    State near_state_{};  // magnitudes of states and inputs whose part in a guard it must exceed
    std::array<double, n_inputs> near_input_{};
};

using Switching = SwitchingOf<SwitchedDrive>;
using Course = CourseOf<DriveDims>;

}  // namespace lostmotion
