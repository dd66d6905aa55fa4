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
        std::array<std::array<double, max_guards>, n_states + n_inputs> guard_columns{}, guard_sizes{};
        int guard_lanes = 0;  // number of guards, rounded up to whole vectors

        // The guards' values, or with constant = nullptr and the derivatives of state and inputs, their rates.
        void evaluate_guards(const std::array<double, max_guards>* constant, const State& x,
                             const std::array<double, n_inputs>& u, std::array<double, max_guards>& out) const {
            const auto& c = guard_columns;
            for (int g = 0; g < guard_lanes; ++g) {
                const double fixed = constant != nullptr ? (*constant)[g] : 0.0;
                out[g] = fixed + c[0][g] * x[0] + c[1][g] * x[1] + c[2][g] * x[2] + c[3][g] * x[3] + c[4][g] * x[4] +
                         c[5][g] * u[0] + c[6][g] * u[1];
            }
        }
        // How far the guards lie above a thousandth of the sizes of their terms.
        std::array<double, max_guards> guard_room(const State& x, const Memory& m,
                                                  const std::array<double, n_inputs>& u,
                                                  const std::array<double, n_inputs>& input_size) const {
            const std::array<double, max_guards> constant = guard_constants(m);
            std::array<double, max_guards> value, size;
            evaluate_guards(&constant, x, u, value);
            const auto& c = guard_sizes;
            for (int g = 0; g < guard_lanes; ++g) {
                size[g] = std::fabs(constant[g]) + c[0][g] * std::fabs(x[0]) + c[1][g] * std::fabs(x[1]) +
                          c[2][g] * std::fabs(x[2]) + c[3][g] * std::fabs(x[3]) + c[4][g] * std::fabs(x[4]) +
                          c[5][g] * input_size[0] + c[6][g] * input_size[1];
                value[g] -= 1e-3 * size[g];
            }
            return value;
        }
        // Sum of the magnitudes of the terms of a guard that is a speed, so without constant or inputs.
        double speed_size(int g, const State& x) const {
            const auto& c = guard_sizes;
            return c[motor_speed][g] * std::fabs(x[motor_speed]) + c[load_speed][g] * std::fabs(x[load_speed]);
        }
        // The part of the guards that depends on neither state nor inputs.
        std::array<double, max_guards> guard_constants(const Memory& m) const {
            std::array<double, max_guards> constant{};
            for (int g = 0; g < regime.n_guards; ++g) {
                const LinearForm& f = regime.guards[g].form;
                constant[g] = constant_part(f, m);
            }
            return constant;
        }
    };

    explicit RegimeCache(const System& system) : system_(system) {}

    const Regime& regime(const RegimeKey& key) { return entry(key).regime; }

    Entry& entry(const RegimeKey& key) {
        if (last_ != nullptr && last_->regime.key == key) return *last_;
        const std::uint64_t packed = key.packed();
        std::unique_ptr<Entry>& found = entries_[packed];
        if (!found) {
            found = std::make_unique<Entry>();
            found->regime = system_.build(key);
            const Regime& r = found->regime;
            found->guard_lanes = (r.n_guards + 3) / 4 * 4;
            for (int g = 0; g < r.n_guards; ++g) {
                for (int k = 0; k < n_states; ++k) found->guard_columns[k][g] = r.guards[g].form.c[k];
                for (int i = 0; i < n_inputs; ++i)
                    found->guard_columns[n_states + i][g] = r.guards[g].form.c[first_input + i];
            }
            for (int k = 0; k < n_states + n_inputs; ++k)
                for (int g = 0; g < r.n_guards; ++g) found->guard_sizes[k][g] = std::fabs(found->guard_columns[k][g]);
        }
        last_ = found.get();
        return *found;
    }

    // Makes ready for runs with this unit of length and these inputs; propagators for others are forgotten.
    const std::vector<InputBasis>& serve(double unit, const std::vector<InputBasis>& basis) {
        if (entries_.size() > most_kept) {
            entries_.clear();
            last_ = nullptr;
        }
        if (unit != unit_ || basis != basis_)
            for (auto& [key, entry] : entries_) entry->propagator.reset();
        unit_ = unit;
        basis_ = basis;
        return basis_;
    }

 private:
    static constexpr std::size_t most_kept = 1000;  // from run to run; each takes some tens of kilobytes

    const System& system_;
    double unit_ = 0.0;
    std::vector<InputBasis> basis_;
    Entry* last_ = nullptr;  // the one asked for last
    std::unordered_map<std::uint64_t, std::unique_ptr<Entry>> entries_;
};

}  // namespace lostmotion
