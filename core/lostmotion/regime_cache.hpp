// The regimes visited so far, each built once. A drive has finitely many; a run visits a few dozen.
#pragma once

#include <memory>
#include <unordered_map>
#include <vector>

#include "propagator.hpp"
#include "regime.hpp"

namespace lostmotion {

using GuardTable = FormTable<max_guards>;

template <class System>
class RegimeCache {
 public:
    struct Entry {
        Entry() = default;
        Entry(const Entry&) = delete;
        Entry& operator=(const Entry&) = delete;

        Regime regime;
        LinearRates rates, rate_sizes;  // and with the magnitudes of all coefficients
        GuardTable guards, guard_sizes;
        int touch_guard = -1;  // the one that also ends the regime by touching zero
        Propagator propagator;
        std::vector<FormSeries> series;  // of the guards that have been crossed

        void set(const Regime& r) {
            regime = r;
            rates = LinearRates(r);
            rate_sizes = rates.magnitudes();
            guards = {};
            touch_guard = -1;
            for (int g = 0; g < r.n_guards; ++g) {
                guards.set(g, r.guards[g].form);
                if (r.guards[g].by_touch) touch_guard = g;
            }
            guard_sizes = guards.magnitudes();
            propagator.reset();
        }
        void prepare(InputTurns& turns, const State& scale) {
            propagator.prepare(rates, turns, scale);
            series.resize(static_cast<std::size_t>(regime.n_guards));
            for (FormSeries& s : series) s.reset();
        }
        const FormSeries& guard_series(int g) {
            FormSeries& s = series[static_cast<std::size_t>(g)];
            if (!s.ready()) propagator.prepare(s, regime.guards[g].form);
            return s;
        }

        // How far the guards lie above a thousandth of the sizes of their terms.
        GuardTable::Values guard_room(const Instant& now) const {
            GuardTable::Values constant{}, value, size;
            guards.constants(now.memory, constant);
            guards.evaluate(constant, now.x, now.input[0], value);
            guard_sizes.constants(magnitudes(now.memory), constant);
            guard_sizes.evaluate(constant, magnitudes(now.x), now.input_size, size);
            for (int g = 0; g < guards.rows(); g += vec_width)
                store(load(&value[g]) - 1e-3 * load(&size[g]), &value[g]);
            return value;
        }
        // Sum of the magnitudes of the terms of the guard that ends by touching, a speed.
        double touch_size(const State& x) const {
            return guard_sizes.coefficient(touch_guard, motor_speed) * std::fabs(x[motor_speed]) +
                   guard_sizes.coefficient(touch_guard, load_speed) * std::fabs(x[load_speed]);
        }
    };

    explicit RegimeCache(const System& system) : system_(system) {}

    const Regime& regime(const RegimeKey& key) { return entry(key).regime; }

    Entry& entry(const RegimeKey& key) {
        const std::uint64_t packed = key.packed();
        if (last_ != nullptr && packed == last_packed_) return *last_;
        std::unique_ptr<Entry>& found = entries_[packed];
        if (!found) {
            if (spare_.empty()) {
                found = std::make_unique<Entry>();
            } else {
                found = std::move(spare_.back());
                spare_.pop_back();
            }
            found->set(system_.build(key));
        }
        last_ = found.get();
        last_packed_ = packed;
        return *found;
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
    static constexpr std::size_t most_kept = 1000;  // from run to run; each takes some tens of kilobytes

    const System& system_;
    std::unique_ptr<InputTurns> turns_;
    Entry* last_ = nullptr;  // the one asked for last
    std::uint64_t last_packed_ = 0;
    std::unordered_map<std::uint64_t, std::unique_ptr<Entry>> entries_;
    std::vector<std::unique_ptr<Entry>> spare_;
};

}  // namespace lostmotion
