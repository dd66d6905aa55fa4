// Regimes with their forms as the terms that are not zero: what the search of modes and the kernels go by.
#pragma once

#include <deque>
#include <memory>
#include <span>
#include <vector>

#include "../base/key_table.hpp"
#include "../base/shared.hpp"
#include "../base/signal.hpp"
#include "assembly.hpp"
#include "instant.hpp"

namespace lostmotion::model {

struct SparseRegime {
    using Guard = GuardOf<LinearForm>;
    using Forms = std::span<const LinearForm>;

    Key key;
    Forms rate;        // of each coupled state; zero up to a multiple of four
    Forms angle_rate;  // of each angle
    // As those of Regime; of a train without gears, one output torque that is zero.
    Forms output_torque, input_torque, contact_torque, motor_torque, drive_torque, massless_speed;
    Forms mesh_loss;  // of each gear, what it takes at its output, |i| T_1 - T_2 as turned by the input [N m]
    std::vector<Guard> guards;
    std::vector<double> near_event;  // what each guard has to exceed, beside its share of its terms
    std::vector<Driver<LinearForm>> drivers;
    std::vector<LockedTorque<LinearForm>> locked;
    std::vector<GivenState> given;
    Flags at_rest, redundant;  // contacts
    Flags resting, following;  // coupled states: speeds that are kept at zero, and those that follow others
    bool solvable = true, in_data = true;
    int driving_input = -1;
    double driving_way = 0.0;
    // A product of two forms, and its number among all flows of power; they are set once they are asked for.
    struct PowerTerms {
        int number;
        LinearForm torque, speed;
    };
    struct AllPowers {
        std::vector<PowerTerms> all;
        FormMaker::Terms block;
    };
    mutable std::unique_ptr<const AllPowers> flows;

    // near_state, near_input: what states and inputs have near an event, by the layout.
    SparseRegime(const Regime& r, const Assembly& a, std::span<const double> near_state,
                 std::span<const double> near_input, FormMaker& form);
    SparseRegime(const SparseRegime&) = delete;
    SparseRegime& operator=(const SparseRegime&) = delete;

    // About what it takes.
    std::size_t bytes() const {
        return sizeof *this + sizeof(Guard) * guards.size() + sizeof(forms_[0]) * forms_.size() +
               sizeof(LinearForm::Term) * terms_;
    }

 private:
    std::vector<LinearForm> forms_;
    std::size_t terms_;
    FormMaker::Terms block_;  // of all forms
};

using SharedRegime = Shared<const SparseRegime>;

class SparseRegimes {
 public:
    explicit SparseRegimes(const Assembly& assembly);

    // One that stays where it is while somebody has it.
    const SharedRegime& share(const Key& key);
    // It stays where it is until the next call of `make_room`.
    const SparseRegime& operator[](const Key& key) { return *share(key); }
    // Forgets all regimes if they take more memory than is to be kept.
    void make_room();
    // The flows of power of a regime.
    const std::vector<SparseRegime::PowerTerms>& flows(const SparseRegime& r);

 private:
    static constexpr std::size_t most_bytes = std::size_t{16} << 20;

    // A regime as it is composed; most often the last one.
    const Regime& composed(const Key& key);

    const Assembly& assembly_;
    std::vector<double> near_state_, near_input_;
    struct KeyOf {
        const Key& operator()(const SharedRegime& r) const { return r->key; }
    };
    std::deque<SharedRegime> known_;
    KeyTable<const SharedRegime, KeyOf> table_;
    std::size_t bytes_ = 0;
    Regime composed_;  // the memory of this one and of the maker of forms is used again
    FormMaker form_;
};

}  // namespace lostmotion::model
