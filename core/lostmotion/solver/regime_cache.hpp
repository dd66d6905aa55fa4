// The regimes visited so far, each built once. A drive has finitely many; a run visits a few dozen.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <memory>
#include <new>
#include <vector>

#include "../base/key_table.hpp"
#include "../base/shared.hpp"
#include "../kernel/bit_set.hpp"
#include "../kernel/propagator.hpp"

namespace lostmotion {

template <class System>
class RegimeCache {
 public:
    using D = typename System::Dims;
    using Regime = typename System::Regime;
    using Key = typename System::Key;
    using Guard = typename System::Guard;
    using GuardTable = FormTable<D, D::guards>;
    using State = StateOf<D>;
    using Guards = BitSet<D::guards>;
    using States = BitSet<D::coupled>;  // a set of coupled states

    struct Entry {
        Entry() = default;
        Entry(const Entry&) = delete;
        Entry& operator=(const Entry&) = delete;

        Shared<const Regime> regime;
        LinearRatesOf<D> rates;
        GuardTable guards;
        int n_guards;                        // as many as there is room for
        ListOf<D, int, D::contacts> speeds;  // the guards of speeds of contacts
        int n_speeds;
        Guards contacts;  // those that say whether a contact goes on in its mode
        Guards behind;    // edges that a twist slips away from, so that it does not reach them
        // The twists that move: the state, and the guard of its rate that also ends the regime by touching zero.
        struct Twist {
            int state, grazing_guard;
        };
        ListOf<D, Twist, D::twists> twists;
        int n_twists;
        bool may_graze;  // has one of them such a guard?
        // The guards that are multiples of the rate of a twist: its own speed, and that of one end while the other
        // is at rest.
        struct TwistSpeed {
            int guard, twist;
            double factor;
        };
        ListOf<D, TwistSpeed, D::contacts> twist_speeds;
        int n_twist_speeds;
        bool followed;                           // does the speed of a state follow another?
        typename GuardTable::Values near_event;  // what each guard exceeds where it is far from an event
        Propagator<D> propagator;
        int readers;  // observers that are still to read the motion along it: its matrices are not given up
        ListOf<D, Entry*, D::guards> neighbour;  // what lies beyond each guard, as far as it is known
        // The regimes that have been tried where a contact comes to rest or to its limit; the last one holds.
        struct Tried {
            int guard;
            std::vector<Entry*> regimes;
        };
        std::vector<Tried> tried;
        // What has been tried after a guard; nullptr if nothing is known of it.
        Tried* tried_after(int guard) {
            const auto known = std::ranges::find(tried, guard, &Tried::guard);
            return known == tried.end() ? nullptr : &*known;
        }

        void set(const System& system, const Key& key) {
            regime = system.build(key);
            const Regime& r = *regime;
            std::destroy_at(&rates);
            std::construct_at(&rates, system.counts(), r.rate, r.angle_rate);
            rates.given = r.given.empty() ? nullptr : &r.given;
            guards.clear();
            guards.set_counts(rates.n);
            neighbour = {};
            tried.clear();
            n_speeds = 0;
            contacts = behind = {};
            unreached_known_ = false;
            n_guards = static_cast<int>(std::min(r.guards.size(), static_cast<std::size_t>(D::guards)));
            for (int g = 0; g < n_guards; ++g) {
                const Guard& guard = r.guards[static_cast<std::size_t>(g)];
                guards.set(g, guard.form);
                if (guard.kind == Guard::speed) speeds[n_speeds++] = g;
                if (guard.is_of_contact()) contacts.set(g);
                if (guard.behind) behind.set(g);
            }
            followed = std::ranges::find(r.following, true) != r.following.end();
            find_twists(system);
            clear(near_event, guards.rows());
            std::copy_n(r.near_event.begin(), n_guards, near_event.begin());
            propagator.reset();
            readers = 0;
        }

        // About what it takes without matrices, of a train of any size.
        std::size_t bytes() const { return sizeof *this + regime->bytes() + guards.bytes(); }
        // How many times the rate of a twist a guard is; factor 0 if of none.
        TwistSpeed twist_speed(int guard) const {
            for (int k = 0; k < n_twist_speeds; ++k)
                if (twist_speeds[k].guard == guard) return twist_speeds[k];
            return {guard, 0, 0.0};
        }
        // The twist whose rate this guard is, if it also ends the regime by touching zero; else -1.
        int grazing_twist(int guard) const {
            for (int t = 0; t < n_twists; ++t)
                if (twists[t].grazing_guard == guard) return t;
            return -1;
        }
        // Sum of the magnitudes of the terms of a guard that ends by touching, a speed.
        double grazing_magnitude(const Twist& twist, const State& x) const {
            return guards.state_magnitude(twist.grazing_guard, x);
        }
        // The states that the inputs that vary do not act on, by way of others either.
        template <class Varies>
        const States& unreached(Varies&& varies) {
            std::uint64_t which = 0;
            for (int i = 0; i < rates.n.inputs; ++i) which |= std::uint64_t{varies(i)} << (i % 64);
            if (unreached_known_ && which == unreached_by_ && rates.n.inputs <= 64) return unreached_;
            States reached;
            for (int i = 0; i < rates.n.inputs; ++i)
                for (int r = 0; r < rates.n.coupled && varies(i); ++r)
                    if (rates.input_column[static_cast<std::size_t>(i)][r] != 0.0) reached.set(r);
            for (States before; before != reached;) {
                before = reached;
                for (int r = 0; r < rates.n.coupled; ++r)
                    rates.each_in_row(r, [&](int c, double rate) {
                        if (rate != 0.0 && reached[c]) reached.set(r);
                    });
            }
            unreached_known_ = true;
            unreached_by_ = which;
            return unreached_ = States::below(rates.n.coupled) - reached;
        }

     private:
        void find_twists(const System& system) {
            n_twists = n_twist_speeds = 0;
            may_graze = false;
            for (int t = 0; t < system.n_twists(); ++t) {
                Twist& twist = twists[n_twists];
                twist = {system.twist_state(t), -1};
                bool moves = false;
                for (int g = 0; g < n_guards; ++g) {
                    const Guard& guard = regime->guards[static_cast<std::size_t>(g)];
                    if (guard.kind != Guard::speed) continue;
                    const double factor = times_rate(guard.form, regime->rate[static_cast<std::size_t>(twist.state)]);
                    if (factor != 0.0) twist_speeds[n_twist_speeds++] = {g, n_twists, factor};
                    if (factor != 0.0 && guard.by_grazing) twist.grazing_guard = g;
                    moves = moves || factor != 0.0;
                }
                may_graze |= twist.grazing_guard >= 0;
                if (moves) ++n_twists;
            }
        }
        // How many times the rate of a twist a speed is, or 0; the speeds at rest are left out.
        double times_rate(const LinearForm& speed, const LinearForm& rate) const {
            const auto next = [this](const LinearForm::Term*& t, const LinearForm::Term* end) {
                while (t != end && regime->resting[t->place]) ++t;
            };
            const LinearForm::Term *a = speed.begin, *b = rate.begin, *end_a = a + speed.coupled,
                                   *end_b = b + rate.coupled;
            double first_a = 0.0, first_b = 0.0;
            for (next(a, end_a), next(b, end_b); a != end_a || b != end_b; next(a, end_a), next(b, end_b)) {
                if (a == end_a || b == end_b || a->place != b->place) return 0.0;
                if (first_b == 0.0) first_a = a->factor, first_b = b->factor;
                if (first_a * b->factor != first_b * a->factor) return 0.0;
                ++a, ++b;
            }
            return first_b == 0.0 ? 0.0 : first_a / first_b;
        }

        States unreached_;
        std::uint64_t unreached_by_;  // the inputs that it was found for, as bits
        bool unreached_known_;
    };

    explicit RegimeCache(const System& system) : system_(system) {}
    RegimeCache(const RegimeCache&) = delete;
    RegimeCache& operator=(const RegimeCache&) = delete;

    const Regime& regime(const Key& key) { return *entry(key).regime; }

    Entry& entry(const Key& key) { return last_ != nullptr && key == last_->regime->key ? *last_ : find(key); }
    // What lies beyond a guard of another regime; its key is asked for the first time only.
    template <class Key>
    Entry& beyond(Entry& from, int guard, Key&& key) {
        Entry*& neighbour = from.neighbour[guard];
        if (neighbour == nullptr) neighbour = &entry(key());
        return *(last_ = neighbour);
    }

    // An entry to be followed. Where matrices are large, those of regimes that have not been met for long are given up.
    void prepare(Entry& e, PhaseRotations& rotations, const State& scale) {
        if constexpr (std::same_as<D, Any>) {
            std::erase(followed_, &e);
            followed_.push_back(&e);
            std::size_t bytes = 0;
            for (std::size_t k = followed_.size(); k-- > 0;) {
                bytes += followed_[k]->propagator.bytes();
                if (bytes <= most_bytes || followed_.size() - k <= in_use) continue;
                const auto end = followed_.begin() + static_cast<std::ptrdiff_t>(k) + 1;
                const auto given_up = std::stable_partition(followed_.begin(), end, [](Entry* old) {
                    if (old->readers == 0) old->propagator.release();
                    return old->readers == 0;
                });
                followed_.erase(followed_.begin(), given_up);
                break;
            }
        }
        e.propagator.prepare(e.rates, rotations, scale);
    }

    // Whether the regimes of a train of any size take more memory than is to be kept: then they are to be forgotten
    // once nobody refers to them.
    bool is_full() const { return std::same_as<D, Any> && bytes_ > most_bytes; }

    // Forgets all regimes, since the system has changed. The memory of so many is kept for others.
    void forget(std::size_t kept = max_kept) {
        blocks_.resize(std::min(blocks_.size(), kept / per_block));
        table_.clear();
        used_ = 0;
        bytes_ = 0;
        last_ = nullptr;
        followed_.clear();
    }

    // Makes ready for runs with this unit of length and these inputs; propagators for others are forgotten.
    PhaseRotations& serve(double unit, std::vector<InputBasis> basis) {
        if (used_ > max_kept) forget();
        for (Entry* e : followed_) e->readers = 0;  // of a run that has been broken off
        if (!rotations_ || unit != rotations_->unit() || basis != rotations_->basis()) {
            for (std::size_t k = 0; k < used_; ++k) entry(k).propagator.reset();
            rotations_ = std::make_unique<PhaseRotations>(unit, std::move(basis));
        }
        return *rotations_;
    }

 private:
    static constexpr std::size_t max_kept = 4000;  // from run to run; each of a drive takes about 12 kilobytes
    // Matrices of trains of any size, and how many regimes keep them whatever they take.
    static constexpr std::size_t most_bytes = std::size_t{256} << 20, in_use = 8;

    struct KeyOf {
        const Key& operator()(const Entry& e) const { return e.regime->key; }
    };
    [[gnu::noinline]] Entry& find(const Key& key) {
        Entry*& known = table_[key];
        if (known != nullptr) return *(last_ = known);
        if (used_ == per_block * blocks_.size()) blocks_.push_back(std::make_unique_for_overwrite<Entry[]>(per_block));
        Entry& made = entry(used_++);
        made.set(system_, key);
        table_.put(known, made);
        if constexpr (std::same_as<D, Any>) bytes_ += made.bytes();
        return *(last_ = &made);
    }

    // In the order in which they were made.
    Entry& entry(std::size_t k) const { return blocks_[k / per_block][k % per_block]; }
    // As many as are allocated at once.
    static constexpr std::size_t per_block = std::clamp<std::size_t>(65536 / sizeof(Entry), 1, 8);

    const System& system_;
    std::unique_ptr<PhaseRotations> rotations_;
    std::vector<Entry*> followed_;  // with matrices, in the order of their last preparation; only of trains of any size
    Entry* last_ = nullptr;         // the one asked for last
    std::vector<std::unique_ptr<Entry[]>> blocks_;
    std::size_t bytes_ = 0;  // of the regimes in use, without matrices; only of trains of any size
    std::size_t used_ = 0;   // they come first, then those that `forget` has left
    KeyTable<Entry, KeyOf> table_;
};

}  // namespace lostmotion
