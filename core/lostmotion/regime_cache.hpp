// The regimes visited so far, each built once. A drive has finitely many; a run visits a few dozen.
#pragma once

#include <memory>
#include <new>
#include <unordered_map>
#include <vector>

#include "propagator.hpp"
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
        unsigned contacts = 0;                      // and those of all speeds and capacities
        Propagator propagator;
        std::array<Entry*, max_guards> neighbour{};  // what lies beyond each guard, as far as it is known

        void set(const System& system, const RegimeKey& key) {
            // In place, since they are large.
            const Regime& r = *new (&regime) Regime(system.build(key));
            new (&rates) LinearRates(r);
            guards = {};
            neighbour = {};
            touch_guard = -1;
            speeds = {};
            contacts = 0;
            for (int g = 0; g < r.n_guards; ++g) {
                guards.set(g, r.guards[g].form);
                if (r.guards[g].by_touch) touch_guard = g;
                if (r.guards[g].kind == Guard::speed) speeds[r.guards[g].contact] |= 1u << g;
                if (r.guards[g].kind == Guard::speed || r.guards[g].kind == Guard::capacity) contacts |= 1u << g;
            }
            propagator.reset();
        }
        void prepare(InputTurns& turns, const State& scale) { propagator.prepare(rates, turns, scale); }

        // Sum of the magnitudes of the terms of the guard that ends by touching, a speed.
        double touch_size(const State& x) const {
            return std::fabs(guards.coefficient(touch_guard, motor_speed) * x[motor_speed]) +
                   std::fabs(guards.coefficient(touch_guard, load_speed) * x[load_speed]);
        }
    };

    explicit RegimeCache(const System& system) : system_(system) {}

    const Regime& regime(const RegimeKey& key) { return entry(key).regime; }

    Entry& entry(const RegimeKey& key) {
        if (last_ != nullptr && key == last_->regime.key) return *last_;
        std::unique_ptr<Entry>& found = entries_[key];
        if (!found) {
            if (spare_.empty()) {
                found = std::make_unique<Entry>();
            } else {
                found = std::move(spare_.back());
                spare_.pop_back();
            }
            found->set(system_, key);
        }
        last_ = found.get();
        return *last_;
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
        for (auto& [key, entry] : entries_)
            if (spare_.size() < most_kept) spare_.push_back(std::move(entry));
        entries_.clear();
        last_ = nullptr;
    }

    // Makes ready for runs with this unit of length and these inputs; propagators for others are forgotten.
    InputTurns& serve(double unit, std::vector<InputBasis> basis) {
        if (entries_.size() > most_kept) forget();
        if (!turns_ || unit != turns_->unit() || basis != turns_->basis()) {
            for (auto& [key, entry] : entries_) entry->propagator.reset();
            turns_ = std::make_unique<InputTurns>(unit, std::move(basis));
        }
        return *turns_;
    }

 private:
    static constexpr std::size_t most_kept = 4000;  // from run to run; each takes about 15 kilobytes

    const System& system_;
    std::unique_ptr<InputTurns> turns_;
    Entry* last_ = nullptr;  // the one asked for last
    std::unordered_map<RegimeKey, std::unique_ptr<Entry>, RegimeKey::Hash> entries_;
    std::vector<std::unique_ptr<Entry>> spare_;
};

}  // namespace lostmotion
