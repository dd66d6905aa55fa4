// The regimes visited so far, each built once. A drive has finitely many; a run visits a few dozen.
#pragma once

#include <memory>
#include <unordered_map>
#include <vector>

#include "propagator.hpp"
#include "regime.hpp"

namespace lostmotion {

template <class System>
class RegimeCache {
   public:
    struct Entry {
        Regime regime;
        Propagator propagator;
        // Guards as columns, so that all are evaluated at once: value = constant + sum columns * (x, u).
        std::array<std::array<double, max_guards>, n_states + n_inputs> guard_columns{};
    };

    explicit RegimeCache(const System& system) : system_(system) {}

    const Regime& regime(const RegimeKey& key) { return entry(key).regime; }

    Entry& entry(const RegimeKey& key) {
        const std::uint64_t packed = key.packed();
        std::unique_ptr<Entry>& found = entries_[packed];
        if (!found) {
            found = std::make_unique<Entry>();
            found->regime = system_.build(key);
            const Regime& r = found->regime;
            for (int g = 0; g < r.n_guards; ++g) {
                for (int k = 0; k < n_states; ++k) found->guard_columns[k][g] = r.guards[g].form.c[k];
                for (int i = 0; i < n_inputs; ++i)
                    found->guard_columns[n_states + i][g] = r.guards[g].form.c[first_input + i];
            }
        }
        return *found;
    }

    // Forgets what depends on the frequencies of the inputs.
    void reset_propagators() {
        for (auto& [key, entry] : entries_) entry->propagator.reset();
    }

   private:
    const System& system_;
    std::unordered_map<std::uint64_t, std::unique_ptr<Entry>> entries_;
};

}  // namespace lostmotion
