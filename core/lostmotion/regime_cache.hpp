// The regimes visited so far, each built once. A drive has finitely many; a run visits a few dozen.
#pragma once

#include <algorithm>
#include <memory>
#include <new>
#include <vector>

#include "kernel/propagator.hpp"
#include "regime.hpp"

namespace lostmotion {

template <class System>
class RegimeCache {
 public:
    struct Entry {
        Entry() = default;
        Entry(const Entry&) = delete;
        Entry& operator=(const Entry&) = delete;

        Regime regime;
        LinearRates rates;
        GuardTable guards;
        int touch_guard = -1;                       // the one that also ends the regime by touching zero
        std::array<unsigned, n_contacts> speeds{};  // the guards of each contact's speed, as bits
        unsigned contacts = 0;                      // and those that say whether a contact goes on in its mode
        unsigned behind = 0;  // edges of the curve that the twist slips away from, so that it does not reach them
        // The guards that are multiples of the rate of the twist: its own speed, and that of one end while the other
        // is at rest.
        struct TwistSpeed {
            int guard;
            double factor;
        };
        std::array<TwistSpeed, n_contacts> twist_speeds{};
        int n_twist_speeds = 0;
        GuardTable::Values near_event;  // what each guard exceeds where it is far from an event
        Propagator<DriveDims> propagator;
        std::array<Entry*, max_guards> neighbour{};  // what lies beyond each guard, as far as it is known

        void set(const System& system, const RegimeKey& key) {
            // In place, since they are large.
            const Regime& r = *new (&regime) Regime(system.build(key));
            new (&rates) LinearRates(r.rate);
            guards = {};
            neighbour = {};
            touch_guard = -1;
            speeds = {};
            contacts = behind = 0;
            n_twist_speeds = 0;
            for (int g = 0; g < r.n_guards; ++g) {
                guards.set(g, r.guards[g].form);
                if (r.guards[g].by_touch) touch_guard = g;
                if (r.guards[g].kind == Guard::speed) {
                    speeds[r.guards[g].contact] |= 1u << g;
                    if (const double factor = twist_factor(r, r.guards[g].form); factor != 0.0)
                        twist_speeds[n_twist_speeds++] = {g, factor};
                }
                if (r.guards[g].is_of_contact()) contacts |= 1u << g;
                if (r.guards[g].kind == Guard::torsion_piece && slips_away(key, r.guards[g].neighbour))
                    behind |= 1u << g;
            }
            if constexpr (requires { system.near_event(guards, near_event); }) system.near_event(guards, near_event);
            propagator.reset();
        }
        void prepare(InputTurns& turns, const State& scale) { propagator.prepare(rates, turns, scale); }

        // How many times the rate of the twist a guard is, or 0.
        double twist_factor(int guard) const {
            for (int k = 0; k < n_twist_speeds; ++k)
                if (twist_speeds[k].guard == guard) return twist_speeds[k].factor;
            return 0.0;
        }
        // Sum of the magnitudes of the terms of the guard that ends by touching, a speed.
        double touch_size(const State& x) const {
            return std::fabs(guards.coefficient(touch_guard, motor_speed) * x[motor_speed]) +
                   std::fabs(guards.coefficient(touch_guard, load_speed) * x[load_speed]);
        }

     private:
        static bool slips_away(const RegimeKey& key, int piece) {
            const int slip = key.modes[twist_contact];
            return slip != absent && slip * (piece - key.piece) < 0;
        }
        static double twist_factor(const Regime& r, const LinearForm& speed) {
            const LinearForm& rate = r.rate[twist];
            const auto moving = [&r](const LinearForm& f, Term t, Contact c) { return r.at_rest[c] ? 0.0 : f.c[t]; };
            const double a = moving(speed, motor_speed, input_contact), b = moving(speed, load_speed, load_contact),
                         rate_a = moving(rate, motor_speed, input_contact),
                         rate_b = moving(rate, load_speed, load_contact);
            if (a * rate_b != b * rate_a) return 0.0;
            return rate_a != 0.0 ? a / rate_a : rate_b != 0.0 ? b / rate_b : 0.0;
        }
    };

    explicit RegimeCache(const System& system) : system_(system) {}
    ~RegimeCache() {
        for (std::unique_ptr<Entry>& entry : entries_)
            if (spare().size() < most_spare) spare().push_back(std::move(entry));
    }
    RegimeCache(const RegimeCache&) = delete;
    RegimeCache& operator=(const RegimeCache&) = delete;

    const Regime& regime(RegimeKey key) { return entry(key).regime; }

    Entry& entry(RegimeKey key) {  // by value: two words in registers
        if (last_ != nullptr && key == last_->regime.key) return *last_;
        std::size_t k = slot(key);
        if (slots_[k] == nullptr) {
            if (2 * (used_ + 1) > slots_.size()) k = grow(key);
            if (used_ == entries_.size()) entries_.push_back(memory());
            slots_[k] = entries_[used_++].get();
            slots_[k]->set(system_, key);
        }
        return *(last_ = slots_[k]);
    }
    // What lies beyond a guard of another regime; its key is asked for the first time only.
    template <class Key>
    Entry& beyond(Entry& from, int guard, Key&& key) {
        Entry*& neighbour = from.neighbour[guard];
        if (neighbour == nullptr) neighbour = &entry(key());
        return *(last_ = neighbour);
    }

    // Forgets all regimes, since the system has changed. Their memory is kept for others.
    void forget() {
        if (entries_.size() > most_kept) entries_.resize(most_kept);
        std::ranges::fill(slots_, nullptr);
        used_ = 0;
        last_ = nullptr;
    }

    // Makes ready for runs with this unit of length and these inputs; propagators for others are forgotten.
    InputTurns& serve(double unit, std::vector<InputBasis> basis) {
        if (used_ > most_kept) forget();
        if (!turns_ || unit != turns_->unit() || basis != turns_->basis()) {
            for (std::size_t k = 0; k < used_; ++k) entries_[k]->propagator.reset();
            turns_ = std::make_unique<InputTurns>(unit, std::move(basis));
        }
        return *turns_;
    }

 private:
    static constexpr std::size_t most_kept = 4000;   // from run to run; each takes about 12 kilobytes
    static constexpr std::size_t most_spare = 1000;  // from drive to drive, in each thread

    // Entries of caches that are gone, for the sake of their memory.
    static std::vector<std::unique_ptr<Entry>>& spare() {
        thread_local std::vector<std::unique_ptr<Entry>> entries;
        return entries;
    }
    static std::unique_ptr<Entry> memory() {
        if (spare().empty()) return std::make_unique<Entry>();
        std::unique_ptr<Entry> entry = std::move(spare().back());
        spare().pop_back();
        return entry;
    }

    // Where the regime is, or where it has to go.
    std::size_t slot(RegimeKey key) const {
        const std::size_t mask = slots_.size() - 1;
        std::size_t k = key.hash() & mask;
        while (slots_[k] != nullptr && !(slots_[k]->regime.key == key)) k = (k + 1) & mask;
        return k;
    }
    // Makes room for more; returns the slot of a key anew.
    std::size_t grow(RegimeKey key) {
        slots_.assign(2 * slots_.size(), nullptr);
        for (std::size_t n = 0; n < used_; ++n) slots_[slot(entries_[n]->regime.key)] = entries_[n].get();
        return slot(key);
    }

    const System& system_;
    std::unique_ptr<InputTurns> turns_;
    Entry* last_ = nullptr;                        // the one asked for last
    std::vector<std::unique_ptr<Entry>> entries_;  // those in use, then such as only keep their memory
    std::size_t used_ = 0;
    std::vector<Entry*> slots_ = std::vector<Entry*>(256, nullptr);  // a power of two, by hash, at most half full
};

}  // namespace lostmotion
