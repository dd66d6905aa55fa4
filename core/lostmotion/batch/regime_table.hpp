// One regime of a drive as a table for steps of one length, in which the inputs are constant.
//
// Within a regime x' = A x + c with a constant c, so that over a time t
//     x(t) = x + G(t) x',     G(t) = integral of exp(A r) dr from 0 to t,
// with x' at the begin. A guard g = C x + k departs from the straight line between its values at both ends of a step by
// C (G(t) - t/h G(h)) x'. So the guard has no zero in the step where
//     min(g(0), g(h)) > R |x'|,     R = max over t of |C (G(t) - t/h G(h))|, entry by entry.
// A drive whose guards pass this test is stepped by G(h) alone. R is taken from samples, with a bound on what lies
// between: from t_j on, G departs from its secant over d by at most d^2/8 |A| exp(|A| d).
#pragma once

#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <memory>
#include <new>

#include "../model/pack.hpp"
#include "../model/system.hpp"

namespace lostmotion::batch {

using D = model::Least;
using Four = CoupledOf<D>;
using Column = ColumnOf<D>;
using State = StateOf<D>;
using Memory = D::Memory;
using Inputs = InputsOf<D>;
static_assert(D::coupled == 4 && D::angles == 1 && D::memory == 2 && D::inputs == 2);

// The modes and branches of a regime, in 16 bytes.
struct Label {
    static constexpr int max_branches = 6;

    std::array<std::int8_t, 4> modes{};
    std::array<std::int16_t, max_branches> branch{};

    // Without a call of memcmp, which takes longer than that.
    friend bool operator==(const Label& a, const Label& b) {
        using Words = std::array<std::uint64_t, 2>;
        const Words v = std::bit_cast<Words>(a), w = std::bit_cast<Words>(b);
        return v[0] == w[0] && v[1] == w[1];
    }
    static Label of(const model::Key& key) {
        Label l;
        for (std::size_t c = 0; c < D::contacts; ++c) l.modes[c] = key.modes[c];
        for (std::size_t b = 0; b < max_branches; ++b) l.branch[b] = key.branch[b];
        return l;
    }
    model::Key key() const {
        model::Key k;
        for (std::size_t c = 0; c < D::contacts; ++c) k.modes[c] = modes[c];
        for (std::size_t b = 0; b < max_branches; ++b) k.branch[b] = branch[b];
        return k;
    }
};

// Coefficients of four linear forms side by side.
struct Forms {
    std::array<Column, D::coupled> state{};
    Column one{};
    std::array<Column, D::memory> memory{};
    std::array<Column, D::inputs> input{};

    void set(std::size_t row, const model::PackedForm<D>& f) {
        for (std::size_t k = 0; k < D::coupled; ++k) state[k][row] = f.c[k];
        one[row] = f.c[D::one];
        for (std::size_t k = 0; k < D::memory; ++k) memory[k][row] = f.c[D::first_memory + k];
        for (std::size_t k = 0; k < D::inputs; ++k) input[k][row] = f.c[D::first_input + k];
    }
    // The part that is constant while memory and inputs are.
    [[gnu::always_inline]] Four constant(const Memory& m, const Inputs& u) const {
        return (load<D>(one) + (m[0] * load<D>(memory[0]) + m[1] * load<D>(memory[1]))) +
               (u[0] * load<D>(input[0]) + u[1] * load<D>(input[1]));
    }
    [[gnu::always_inline]] Four of_state(const Four& x) const {
        return sum_in_fours<D::coupled>([&](auto k)
                                            ALWAYS_INLINE { return x.template spread<k>() * load<D>(state[k]); });
    }
    // Sums of the magnitudes of the terms.
    Four magnitude_of_state(const Four& size) const {
        return sum_in_fours<D::coupled>(
            [&](auto k) { return size.template spread<k>() * absolute(load<D>(state[k])); });
    }
    Four magnitude(const Four& size, const Memory& m, const Inputs& u) const {
        Four sum = absolute(load<D>(one)) + magnitude_of_state(size);
        for (std::size_t k = 0; k < D::memory; ++k) sum = sum + std::fabs(m[k]) * absolute(load<D>(memory[k]));
        for (std::size_t k = 0; k < D::inputs; ++k) sum = sum + std::fabs(u[k]) * absolute(load<D>(input[k]));
        return sum;
    }
};

// Guards, four at a time, with the rows of R.
struct GuardBlock {
    Forms form;
    std::array<Column, D::coupled> departure{};
};

// What only events and readers need of a regime.
struct RegimeDetails {
    struct Mark {
        std::uint8_t kind = model::Guard::outside;
        std::int8_t contact = -1, branch = -1;
        std::int16_t neighbour = 0;
    };
    // Which speed a shaft has once a contact has come to rest: none, or a multiple of another's.
    struct Stop {
        std::int8_t state = -1, other = -1;  // state: -1 if the shaft goes on
        double share = 0.0;
    };

    std::array<bool, D::contacts> at_rest{};
    std::array<bool, D::contacts> stops_alone{};  // whether no other contact comes to rest with this one
    // Numbers of the contacts, of the states of twist and input shaft, and the branches of the loss law; -1: none.
    std::int8_t input_contact = -1, twist_contact = -1, twist = -1, input_speed = -1, cell = -1, cell_back = -1;
    double hysteresis = 0.0;  // of (16): a turning point sets the capacity to this times |P|
    std::array<std::array<Stop, 2>, D::contacts> stops{};  // by the contact that comes to rest
    model::PackedForm<D> motor_torque{}, output_torque{};
    std::unique_ptr<Mark[]> mark;  // of each guard
};

// All that a step without event reads lies in one row: this, then the guards.
struct alignas(64) RegimeTable {
    Label label;
    RegimeTable* next = nullptr;  // of the same drive
    std::unique_ptr<RegimeDetails> details = std::make_unique<RegimeDetails>();
    double angle_coefficient = 0.0;
    double series_step = 0.0;  // [s], in which the series of the motion converges fast
    double norm = 0.0;         // |A| [1/s] in scaled units
    // False: the general solver makes all steps that begin in this regime or come into it. Then only the forms of the
    // torques are set.
    bool plain = false;
    std::int8_t n_guards, n_blocks, angle_speed = 0;
    Forms rate;  // of the coupled states
    MatrixOf<D> G;
    Column angle{};  // per x', what the angle gains in a step beyond h times its speed

    struct Free {
        void operator()(RegimeTable* t) const {
            t->~RegimeTable();
            ::operator delete(static_cast<void*>(t), std::align_val_t{alignof(RegimeTable)});
        }
    };
    using Owned = std::unique_ptr<RegimeTable, Free>;
    static Owned make(int guards) {
        const int blocks = (guards + 3) / 4;
        void* room = ::operator new(sizeof(RegimeTable) + static_cast<std::size_t>(blocks) * sizeof(GuardBlock),
                                    std::align_val_t{alignof(RegimeTable)});
        return Owned(new (room) RegimeTable(guards, blocks));
    }
    GuardBlock& guards(int block) { return reinterpret_cast<GuardBlock*>(this + 1)[block]; }
    const GuardBlock& guards(int block) const { return reinterpret_cast<const GuardBlock*>(this + 1)[block]; }
    // Fetches what a step reads into the cache.
    [[gnu::always_inline]] void prefetch() const {
        const char* row = reinterpret_cast<const char*>(this);
        for (std::size_t k = 0; k < sizeof(RegimeTable) + sizeof(GuardBlock); k += 64) __builtin_prefetch(row + k);
    }
    // Bytes that it takes.
    std::size_t size() const {
        return sizeof(RegimeTable) + sizeof(RegimeDetails) + static_cast<std::size_t>(n_blocks) * sizeof(GuardBlock) +
               static_cast<std::size_t>(n_guards) * sizeof(RegimeDetails::Mark);
    }

 private:
    RegimeTable(int guards, int blocks)
        : n_guards(static_cast<std::int8_t>(guards)), n_blocks(static_cast<std::int8_t>(blocks)) {
        for (int b = 0; b < blocks; ++b) new (&this->guards(b)) GuardBlock{};
        details->mark = std::make_unique<RegimeDetails::Mark[]>(static_cast<std::size_t>(guards));
    }
};
static_assert(sizeof(RegimeTable) % alignof(GuardBlock) == 0);

// The table of a regime for steps of h [s].
RegimeTable::Owned tabulate(const model::Assembly& assembly, const Label& label, double h);

}  // namespace lostmotion::batch
