// The regimes that the search of modes has visited, for trains of any size.
#pragma once

#include <memory>
#include <vector>

#include "assembly.hpp"
#include "motion.hpp"

namespace lostmotion::model {

struct SearchedRegime {
    using Guard = GuardOf<SparseForm>;

    Key key;
    std::vector<SparseForm> rate, output_torque, contact_torque;  // as those of Regime
    std::vector<Guard> guards;
    std::vector<double> near_event;  // what each guard has to exceed, beside its share of its terms
    std::vector<Driver<SparseForm>> drivers;
    std::vector<LockedTorque<SparseForm>> locked;
    Flags at_rest;
    bool solvable = true;

    // near_state, near_input: what states and inputs have near an event, by the layout.
    SearchedRegime(const Regime& r, const Layout& n, const std::vector<double>& near_state,
                   const std::vector<double>& near_input);
    SearchedRegime(const SearchedRegime&) = delete;
    SearchedRegime& operator=(const SearchedRegime&) = delete;

    // About what it takes.
    std::size_t bytes() const {
        return sizeof *this + sizeof(Guard) * guards.size() + sizeof(block_[0]) * block_.size();
    }

 private:
    std::vector<SparseForm::Term> block_;  // of all forms
};

class SearchedRegimes {
 public:
    explicit SearchedRegimes(const Assembly& assembly);

    // It stays where it is until the next call of `make_room`.
    const SearchedRegime& operator[](const Key& key);
    // Forgets all regimes if they take more memory than is to be kept.
    void make_room();
    // A regime as it is composed; most often the last one.
    const Regime& composed(const Key& key);

    // What states and inputs have near an event, by the layout.
    const std::vector<double>& near_state() const { return near_state_; }
    const std::vector<double>& near_input() const { return near_input_; }

 private:
    static constexpr std::size_t most_bytes = std::size_t{16} << 20, first_slots = 64;

    // Slot of the regime, or the free slot where it has to go.
    std::size_t slot(const Key& key) const;

    const Assembly& assembly_;
    std::vector<double> near_state_, near_input_;
    std::vector<std::unique_ptr<const SearchedRegime>> known_;
    std::vector<const SearchedRegime*> slots_;  // a power of two, by hash, at most half full
    std::size_t bytes_ = 0;
    Regime composed_;  // its memory is used again
};

}  // namespace lostmotion::model
