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
#include <vector>

#include "kernels/pack.hpp"
#include "kernels/system.hpp"

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

// Four linear forms side by side. Of regimes that are mirror images the coefficients of states and inputs are the same
// but for the sign of each form; what is constant while states and inputs change is the regime's own.
struct Forms {
    const Column* state;  // by coupled state
    const Column* input;  // by input; nullptr: none depends on them
    const Column* own;    // for 1 and, if it depends on it, for the memory
    bool by_memory;
    const Column* sign;

    // The part that is constant while memory and inputs are.
    [[gnu::always_inline]] Four constant(const Memory& m, const Inputs& u) const {
        Four sum = load<D>(own[0]);
        if (by_memory) sum = sum + (m[0] * load<D>(own[1]) + m[1] * load<D>(own[2]));
        if (input != nullptr) sum = sum + load<D>(*sign) * (u[0] * load<D>(input[0]) + u[1] * load<D>(input[1]));
        return sum;
    }
    [[gnu::always_inline]] Four of_state(const Four& x) const {
        return load<D>(*sign) * sum_in_fours<D::coupled>(
                                    [&](auto k) ALWAYS_INLINE { return x.template spread<k>() * load<D>(state[k]); });
    }
    // Sums of the magnitudes of the terms.
    Four magnitude_of_state(const Four& size) const {
        return sum_in_fours<D::coupled>(
            [&](auto k) { return size.template spread<k>() * absolute(load<D>(state[k])); });
    }
    Four magnitude(const Four& size, const Memory& m, const Inputs& u) const {
        Four sum = absolute(load<D>(own[0])) + magnitude_of_state(size);
        for (std::size_t k = 0; by_memory && k < D::memory; ++k)
            sum = sum + std::fabs(m[k]) * absolute(load<D>(own[1 + k]));
        for (std::size_t k = 0; input != nullptr && k < D::inputs; ++k)
            sum = sum + std::fabs(u[k]) * absolute(load<D>(input[k]));
        return sum;
    }
};

// A form by the coefficients of all that it may depend on, in the order of the kernel.
using Coefficients = std::array<double, D::terms>;
Coefficients coefficients_of(const LinearForm& f);
// Its value with another constant.
double value_of(const Coefficients& c, double constant, const State& x, const Memory& m, const Inputs& u);

// What only events and readers need of a regime. Those of other drives are often the same.
struct RegimeDetails {
    struct Mark {
        std::uint8_t kind = model::Guard::outside;
        std::int8_t contact = -1, branch = -1;
        std::int16_t neighbour = 0;
        friend bool operator==(const Mark&, const Mark&) = default;
    };
    // Which speed a shaft has once a contact has come to rest: none, or a multiple of another's.
    struct Stop {
        std::int8_t state = -1, other = -1;  // state: -1 if the shaft goes on
        double share = 0.0;
        friend bool operator==(const Stop&, const Stop&) = default;
    };
    std::array<bool, D::contacts> at_rest{};
    std::array<bool, D::contacts> stops_alone{};  // whether no other contact comes to rest with this one
    // Numbers of the contacts, of the states of twist and input shaft, and the branches of the loss law; -1: none.
    std::int8_t input_contact = -1, twist_contact = -1, twist = -1, input_speed = -1, cell = -1, cell_back = -1;
    double hysteresis = 0.0;  // of (16): a turning point sets the capacity to this times |P|
    std::array<std::array<Stop, 2>, D::contacts> stops{};  // by the contact that comes to rest
    Coefficients motor_torque{}, output_torque{};          // but that for 1
    std::vector<Mark> mark;                                // of each guard

    friend bool operator==(const RegimeDetails&, const RegimeDetails&) = default;
    std::size_t size() const { return sizeof *this + mark.size() * sizeof(Mark); }
};

// What regimes share that are mirror images: this, then for each four guards the coefficients of the states, the rows
// of R in single precision, rounded up, and, if there are some, the coefficients of the inputs.
struct alignas(64) SharedTable {
    double angle_coefficient = 0.0;
    double series_step = 0.0;  // [s], in which the series of the motion converges fast
    double norm = 0.0;         // |A| [1/s] in scaled units
    std::int8_t angle_speed = 0, n_blocks = 0;
    bool guards_by_input = false;
    std::array<Column, D::coupled> state{};  // of the rates of the coupled states
    std::array<Column, D::inputs> input{};
    MatrixOf<D> G;
    Column angle{};  // per x', what the angle gains in a step beyond h times its speed

    using Departure = std::array<std::array<float, D::coupled>, D::coupled>;
    static constexpr std::size_t departure_columns = sizeof(Departure) / sizeof(Column);
    std::size_t block_columns() const {
        return D::coupled + departure_columns + (guards_by_input ? std::size_t{D::inputs} : 0);
    }
    std::size_t size() const {
        return sizeof *this + static_cast<std::size_t>(n_blocks) * block_columns() * sizeof(Column);
    }
    const Column* block(int b) const {
        return reinterpret_cast<const Column*>(this + 1) + static_cast<std::size_t>(b) * block_columns();
    }
    // The k-th column of R.
    [[gnu::always_inline]] Four departure(int b, std::size_t k) const {
        const auto& of = reinterpret_cast<const Departure*>(block(b) + D::coupled)[0][k];
        return Four::of({of[0], of[1], of[2], of[3]});
    }
};

// A regime: this, then what is its own of the rates and of each four guards.
struct alignas(64) RegimeTable {
    static constexpr int max_blocks = (D::guards + 3) / 4;
    using Signs = std::array<std::uint8_t, max_blocks>;

    Label label;
    RegimeTable* next = nullptr;  // of the same drive
    // nullptr: the general solver makes all steps that begin in this regime or come into it.
    const SharedTable* shared = nullptr;
    const RegimeDetails* details = nullptr;
    double motor_torque = 0.0, output_torque = 0.0;  // the coefficients for 1
    Signs signs{};                                   // of the guards, four to a number; a bit is a minus
    bool by_memory = false;

    bool plain() const { return shared != nullptr; }
    std::size_t own_columns() const { return by_memory ? 1 + std::size_t{D::memory} : 1; }
    const Column* own() const { return reinterpret_cast<const Column*>(this + 1); }
    [[gnu::always_inline]] Forms rates() const {
        return {shared->state.data(), shared->input.data(), own(), by_memory, &sign_of[0]};
    }
    [[gnu::always_inline]] Forms guards(int b) const {
        const Column* block = shared->block(b);
        const Column* inputs = shared->guards_by_input ? block + D::coupled + SharedTable::departure_columns : nullptr;
        const auto k = static_cast<std::size_t>(b);
        return {block, inputs, own() + (1 + k) * own_columns(), by_memory, &sign_of[signs[k]]};
    }

 private:
    // By the bits of four signs.
    static constexpr std::array<Column, 16> sign_of = [] {
        std::array<Column, 16> out{};
        for (std::size_t bits = 0; bits < 16; ++bits)
            for (std::size_t k = 0; k < 4; ++k) out[bits][k] = (bits >> k & 1) != 0 ? -1.0 : 1.0;
        return out;
    }();
};
static_assert(sizeof(RegimeTable) == 64 && D::coupled == 4);

// A table as it is made, before what others have is shared.
struct Tabulated {
    RegimeTable table;
    RegimeDetails details;
    std::vector<Column> own;
    SharedTable shared;
    std::vector<Column> blocks;  // of the shared part

    Column* block(int b) { return blocks.data() + static_cast<std::size_t>(b) * shared.block_columns(); }
};

// The memory that tables lie in: chunks that stay.
class TableStore {
 public:
    // A table for a drive that has had these, the last one first.
    RegimeTable* add(const Tabulated& made, RegimeTable* others);
    // Bytes in use.
    std::size_t memory() const { return memory_; }

 private:
    void* take(std::size_t bytes);
    const RegimeDetails* same(const RegimeDetails& details);
    const SharedTable* same(const Tabulated& made, const RegimeTable* others);

    static constexpr std::size_t line = 64, longest_chunk = std::size_t{1} << 21, recent = 64;
    struct Free {
        void operator()(std::byte* chunk) const { ::operator delete(chunk, std::align_val_t{longest_chunk}); }
    };
    std::vector<std::unique_ptr<std::byte, Free>> chunks_;
    std::size_t length_ = std::size_t{1} << 13, used_ = length_, memory_ = 0;
    std::vector<std::unique_ptr<const RegimeDetails>> details_;
};

// The table of a regime for steps of h [s].
Tabulated tabulate(const model::Assembly& assembly, const Label& label, double h);

}  // namespace lostmotion::batch
