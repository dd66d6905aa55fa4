// States, and linear expressions in what a regime's equations may depend on.
#pragma once

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <concepts>
#include <type_traits>
#include <utility>
#include <variant>
#include <vector>

#include "../base/linear_form.hpp"
#include "../base/sign.hpp"
#include "dims.hpp"

namespace lostmotion {

// Up to so many coupled states, whole matrices cost less than what of them is not zero.
inline constexpr int few_states = 16;

// The coupled states, in registers; then a state, and its coupled part alone, in memory.
template <class D>
using CoupledOf = std::conditional_t<std::same_as<D, Any>, Numbers, Pack<D::coupled>>;
template <class D>
struct alignas(sizeof(typename CoupledOf<D>::Part)) StateOf : std::array<double, D::states> {};
template <class D>
struct alignas(sizeof(typename CoupledOf<D>::Part)) ColumnOf : std::array<double, D::coupled> {};
template <>
struct ColumnOf<Any> : Numbers {
    using Numbers::Numbers;
    using Numbers::operator=;
};
template <class D>
using InputsOf = std::conditional_t<std::same_as<D, Any>, NumbersIn<8>, std::array<double, D::inputs>>;
template <class D>
using AnglesOf = std::conditional_t<std::same_as<D, Any>, NumbersIn<4>, std::array<double, D::angles>>;

// A state in registers.
template <class D>
struct Lanes {
    CoupledOf<D> coupled{};
    AnglesOf<D> angle{};

    [[gnu::always_inline]] static Lanes load(const StateOf<D>& from) {
        Lanes x{CoupledOf<D>::load(from.data()), {}};
        for (int j = 0; j < D::angles; ++j) x.angle[j] = from[D::coupled + j];
        return x;
    }
    [[gnu::always_inline]] void store(StateOf<D>& to) const {
        coupled.store(to.data());
        for (int j = 0; j < D::angles; ++j) to[D::coupled + j] = angle[j];
    }
    [[gnu::always_inline]] friend Lanes operator+(Lanes a, const Lanes& b) {
        a.coupled = a.coupled + b.coupled;
        for (int j = 0; j < D::angles; ++j) a.angle[j] += b.angle[j];
        return a;
    }
    [[gnu::always_inline]] friend Lanes operator*(double a, Lanes b) {
        b.coupled = a * b.coupled;
        for (double& angle : b.angle) angle *= a;
        return b;
    }
};
// The same of a train of any size, with sums and multiples that are computed where they are assigned.
template <class C, class A>
struct LanesIn {
    C coupled;
    A angle;
};
template <>
struct StateOf<Any> {
    Numbers coupled;
    NumbersIn<4> angle;

    StateOf() = default;
    template <InFours C, InFours A = NumbersIn<4>>
    [[gnu::always_inline]] StateOf(const C& c, const A& a = {}) : coupled(c), angle(a) {}
    template <class C, class A>
    [[gnu::always_inline]] StateOf(const LanesIn<C, A>& of) : coupled(of.coupled), angle(of.angle) {}
    template <class C, class A>
    [[gnu::always_inline]] StateOf& operator=(const LanesIn<C, A>& of) {
        coupled = of.coupled;
        angle = of.angle;
        return *this;
    }
    [[gnu::always_inline]] void store(StateOf& to) const { to = *this; }
    double operator[](int k) const { return k < Any::coupled ? coupled[k] : angle[k - Any::coupled]; }
    double& operator[](int k) { return k < Any::coupled ? coupled[k] : angle[k - Any::coupled]; }
    friend bool operator==(const StateOf&, const StateOf&) = default;
};
template <class D>
using LanesOf = std::conditional_t<std::same_as<D, Any>, StateOf<Any>, Lanes<D>>;

template <class L>
inline constexpr bool any_lanes = false;
template <>
inline constexpr bool any_lanes<StateOf<Any>> = true;
template <class C, class A>
inline constexpr bool any_lanes<LanesIn<C, A>> = true;
template <class C, class A>
LanesIn(C, A) -> LanesIn<C, A>;
template <class L, class M>
    requires any_lanes<L> && any_lanes<M>
[[gnu::always_inline]] inline auto operator+(const L& a, const M& b) {
    return LanesIn{a.coupled + b.coupled, a.angle + b.angle};
}
template <class L>
    requires any_lanes<L>
[[gnu::always_inline]] inline auto operator*(double a, const L& b) {
    return LanesIn{a * b.coupled, a * b.angle};
}

// Into registers; a train of any size is left where it is.
template <class D>
[[gnu::always_inline]] inline decltype(auto) load(const StateOf<D>& x) {
    if constexpr (std::same_as<D, Any>)
        return (x);
    else
        return Lanes<D>::load(x);
}
template <class D>
[[gnu::always_inline]] inline decltype(auto) load(const ColumnOf<D>& x) {
    if constexpr (std::same_as<D, Any>)
        return static_cast<const Numbers&>(x);
    else
        return CoupledOf<D>::load(x.data());
}
[[gnu::always_inline]] inline NumbersAt load(const NumbersRoom& x) { return {x.at, x.count}; }
template <class D>
[[gnu::always_inline]] inline decltype(auto) coupled(const StateOf<D>& x) {
    if constexpr (std::same_as<D, Any>)
        return (x.coupled);
    else
        return CoupledOf<D>::load(x.data());
}
template <class D>
const double* coupled_numbers(const StateOf<D>& x) {
    if constexpr (std::same_as<D, Any>)
        return x.coupled.data();
    else
        return x.data();
}
// The coupled states into memory.
template <class D, class To>
[[gnu::always_inline]] inline void store(const auto& x, To&& to) {
    if constexpr (std::same_as<std::remove_cvref_t<To>, StateOf<Any>>)
        to.coupled = x;
    else if constexpr (std::same_as<D, Any>)
        to = x;
    else
        x.store(to.data());
}
// Those of a form.
template <class D>
[[gnu::always_inline]] inline CoupledOf<D> coupled(const LinearForm& f) {
    if constexpr (std::same_as<D, Any>) {
        Numbers out;
        for (const auto& [k, factor] : f.of_coupled()) out[k] = factor;
        return out;
    } else {
        ColumnOf<D> out{};
        for (const auto& [k, factor] : f.of_coupled()) out[static_cast<std::size_t>(k)] = factor;
        return load<D>(out);
    }
}
template <class D>
void add_scaled(StateOf<D>& y, double a, const StateOf<D>& x) {
    const LanesOf<D> sum = load(y) + a * load(x);
    sum.store(y);
}
// Room for all states.
template <class D>
void make_room(StateOf<D>& x, [[maybe_unused]] const CountsOf<D>& n) {
    if constexpr (std::same_as<D, Any>) {
        x.coupled.reach(n.coupled);
        x.angle.reach(n.angles);
    }
}
// The same number for all states.
template <class D>
StateOf<D> filled(const CountsOf<D>& n, double value) {
    StateOf<D> out{};
    each_state<D>(n, [&](int k) { out[k] = value; });
    return out;
}

template <std::size_t n>
[[gnu::always_inline]] inline std::array<double, n> magnitudes(std::array<double, n> v) {
    for (double& x : v) x = std::fabs(x);
    return v;
}
template <class D>
[[gnu::always_inline]] inline StateOf<D> magnitudes(const StateOf<D>& x) {
    LanesOf<D> magnitude = load(x);
    magnitude.coupled = absolute(magnitude.coupled);
    for (double& angle : magnitude.angle) angle = std::fabs(angle);
    StateOf<D> out;
    magnitude.store(out);
    return out;
}

// Value and time derivatives of the inputs at one instant: u[k][input] is the k-th derivative.
template <class D>
using InputJetOf = std::array<InputsOf<D>, n_derivatives>;

// All that a regime's equations depend on at one instant.
template <class D>
struct InstantOf {
    double time = 0.0;  // [s]
    StateOf<D> x{};
    typename D::Memory memory{};
    InputJetOf<D> input{};
    InputsOf<D> input_magnitudes{};  // sums of the magnitudes of the inputs' parts
};

// Calls use(place, factor) for each term of a form that belongs to a state, by its place in the kernel.
template <class D, class Use>
[[gnu::always_inline]] inline void each_state_of(const LinearForm& f, Use&& use) {
    for (const auto& [k, factor] : f.of_coupled()) use(k, factor);
    for (const auto& [j, factor] : f.of_angles()) use(D::coupled + j, factor);
}
// term(0) + term(1) + ... of the coupled states, in pairs and fours.
template <class D, class Term>
[[gnu::always_inline]] inline auto sum_of_states([[maybe_unused]] int coupled, Term&& term) {
    if constexpr (std::same_as<D, Any>) {
        decltype(term(0)) sum{};
        for (std::ptrdiff_t k = 0; k < coupled; k += 4)
            sum = sum + ((term(k) + term(k + 1)) + (term(k + 2) + term(k + 3)));
        return sum;
    } else {
        return sum_in_fours<D::coupled>(term);
    }
}

// The part of a form that depends on neither state nor inputs: constant within a regime.
template <class Memory>
double constant_part(const LinearForm& f, const Memory& m) {
    double sum = f.one;
    for (const auto& [k, factor] : f.of_memory()) sum += factor * m[k];
    return sum;
}

template <class Inputs>
double input_part(const LinearForm& f, const Inputs& u) {
    double sum = 0.0;
    for (const auto& [i, factor] : f.of_inputs()) sum += factor * u[i];
    return sum;
}

template <class D>
double evaluate(const LinearForm& f, const StateOf<D>& x, const typename D::Memory& m, const InputsOf<D>& u) {
    double own = f.sum_of_coupled([at = coupled_numbers<D>(x)](int k, double factor) { return factor * at[k]; });
    for (const auto& [j, factor] : f.of_angles()) own += factor * x[D::coupled + j];
    return (constant_part(f, m) + input_part(f, u)) + own;
}

// Sum of the magnitudes of the terms: rounding in evaluate() is a small multiple of epsilon times this.
template <class D>
double magnitude(const LinearForm& f, const StateOf<D>& x, const typename D::Memory& m, const InputsOf<D>& u) {
    double sum = std::fabs(f.one);
    for (const auto& [k, factor] : f.of_memory()) sum += std::fabs(factor * m[k]);
    for (const auto& [i, factor] : f.of_inputs()) sum += std::fabs(factor * u[i]);
    each_state_of<D>(f, [&](int k, double factor) { sum += std::fabs(factor * x[k]); });
    return sum;
}

// The same for a time derivative of the form, where the constant terms have dropped out.
template <class D>
[[gnu::always_inline]] inline double evaluate_rate(const LinearForm& f, const StateOf<D>& rate,
                                                   const InputsOf<D>& input_rate) {
    double sum = input_part(f, input_rate);
    each_state_of<D>(f, [&](int k, double factor) { sum += factor * rate[k]; });
    return sum;
}

// Up to N forms, as many side by side as a vector holds, so that all of them are evaluated at once. None may depend on
// an angle. Of large trains the forms are kept one by one, without their zeros.
template <class D, int N>
class FormTable {
 public:
    static_assert(N % vec_width == 0);
    static constexpr bool any = std::same_as<D, Any>;
    using Values = std::conditional_t<any, NumbersIn<32>, std::array<double, N>>;
    using State = StateOf<D>;
    using Inputs = InputsOf<D>;
    using Memory = typename D::Memory;

    FormTable() { clear(); }

    // Forms that are not there are 1.
    void clear() {
        if constexpr (any) {
            forms_.clear();
            block_.clear();
        } else {
            std::memset(block_.data(), 0, sizeof block_);
            for (int row = 0; row < N; ++row) at_place(row, one_column()) = 1.0;
        }
        rows_ = 0;
        driven_ = false;
        depends_on_ = {};
    }
    // How many there are of what the forms depend on: side by side if there are few states.
    void set_counts(const CountsOf<D>& n) {
        if constexpr (any) {
            n_ = n;
            sparse_ = n.coupled > few_states;
        }
    }

    void set(int row, const LinearForm& f) {
        rows_ = std::max(rows_, (row + vec_width) / vec_width * vec_width);
        assert(f.of_angles().empty());
        if (sparse()) {
            if constexpr (any) {
                if (row >= static_cast<int>(forms_.size())) forms_.resize(static_cast<std::size_t>(row) + 1);
                forms_[static_cast<std::size_t>(row)] = f;
            }
        } else {
            if constexpr (any)
                for (std::size_t n = block_.size(); n < static_cast<std::size_t>(rows_ * width()); ++n)
                    block_.push_back(static_cast<int>(n) / vec_width % width() == one_column() ? 1.0 : 0.0);
            at_place(row, one_column()) = f.one;
            for (const auto& [k, c] : f.of_coupled()) at_place(row, k) = c;
            for (const auto& [k, c] : f.of_memory()) at_place(row, memory_column() + k) = c;
            for (const auto& [i, c] : f.of_inputs()) at_place(row, input_column() + i) = c;
        }
        driven_ = driven_ || !f.of_inputs().empty();
        for (const auto& [i, c] : f.of_inputs()) depends_on_.see_input(i, c);
        for (const auto& [k, c] : f.of_memory()) depends_on_.see_memory(k, c);
    }
    int rows() const { return rows_; }  // rounded up to whole vectors
    // About what a table of any size takes beside itself.
    std::size_t bytes() const { return sizeof(double) * block_.size() + sizeof(LinearForm) * forms_count(); }
    // Those of coupled states and of inputs in a form.
    double of_coupled(int row, int k) const {
        if constexpr (any)
            if (sparse()) return forms_[static_cast<std::size_t>(row)].of(k);
        return block_[index(row, k)];
    }
    double of_input(int row, int i) const {
        if constexpr (any)
            if (sparse()) {
                for (const auto& [place, factor] : forms_[static_cast<std::size_t>(row)].of_inputs())
                    if (place == i) return factor;
                return 0.0;
            }
        return block_[index(row, input_column() + i)];
    }

    // The parts that depend on neither state nor inputs.
    void constants(const Memory& m, Values& out) const {
        each_vector(out, [&](int g) ALWAYS_INLINE {
            if constexpr (any)
                if (sparse()) return each_form<Vec>(g, 1.0, [&](const LinearForm& f) { return constant_part(f, m); });
            const auto c = factors(g);
            Vec sum = c(one_column());
            for (int k = 0; k < depends_on_.memory; ++k) sum += m[k] * c(memory_column() + k);
            return sum;
        });
    }
    [[gnu::always_inline]] void evaluate(const Values& constant, const State& x, const Inputs& u, Values& out) const {
        each_vector(out, [&](int g) ALWAYS_INLINE { return load(constant.data() + g) + terms(g, x, u); });
    }
    // Values and time derivatives at once; the inputs are asked for theirs where the forms depend on them.
    template <class Input>
    [[gnu::always_inline]] void evaluate(const Values& constant, const State& x, const State& rate, const Input& input,
                                         Values& value, Values& slope) const {
        Inputs u{}, u_rate{};
        if (driven_) {
            input.values(depends_on_.inputs, u);
            input.rates(depends_on_.inputs, u_rate);
        }
        make_room(slope, rows_);
        each_vector(value, [&](int g) ALWAYS_INLINE {
            store(terms(g, rate, u_rate), slope.data() + g);
            return load(constant.data() + g) + terms(g, x, u);
        });
    }
    // Sums of the magnitudes of the terms, from magnitudes of what the forms depend on.
    void magnitudes(const Memory& m, const State& x, const Inputs& u, Values& out) const {
        each_vector(out, [&](int g) { return magnitude<Vec>(g, m, x, u); });
    }
    // The same of one form.
    template <class Input>
    double magnitude_of(int row, const Memory& m, const State& x, const Input& input) const {
        return magnitude<double>(row, m, x, driven_ ? input.magnitudes() : Inputs{});
    }
    // Sum of the magnitudes of the terms in coupled states.
    double state_magnitude(int row, const State& x) const {
        if constexpr (any)
            if (sparse())
                return forms_[static_cast<std::size_t>(row)].sum_of_coupled(
                    [&](int k, double c) { return std::fabs(c * x.coupled[k]); });
        const auto c = factors<double>(row);
        const double* state = coupled_numbers<D>(x);
        return sum_of_states<D>(n_.coupled, [&](auto k) ALWAYS_INLINE { return std::fabs(c(k) * state[k]); });
    }
    void rate_magnitudes(const State& rate, const Inputs& input_rate, Values& out) const {
        each_vector(out, [&](int g) ALWAYS_INLINE { return terms<true>(g, rate, input_rate); });
    }
    // Time derivatives, from those of state and inputs.
    [[gnu::always_inline]] void rates(const State& rate, const Inputs& input_rate, Values& out) const {
        each_vector(out, [&](int g) ALWAYS_INLINE { return terms(g, rate, input_rate); });
    }

 private:
    template <class Value>
    [[gnu::always_inline]] void each_vector(Values& out, Value&& value) const {
        make_room(out, rows_);
        for (int g = 0; g < rows_; g += vec_width) store(value(g), out.data() + g);
    }
    // The coefficients of the forms of a vector, from the g-th on, or of that alone, by their columns.
    template <class V = Vec>
    [[gnu::always_inline]] auto factors(int g) const {
        return [c = &block_[index(g, 0)]](std::ptrdiff_t column) ALWAYS_INLINE {
            V v;
            std::memcpy(&v, c + column * vec_width, sizeof v);
            return v;
        };
    }
    template <bool magnitudes = false, class V = Vec>
    [[gnu::always_inline]] V terms(int g, const State& x, const Inputs& u) const {
        if constexpr (any)
            if (sparse())
                return each_form<V>(g, 0.0, [&](const LinearForm& f) { return form_terms<magnitudes>(f, x, u); });
        const auto c = [at = factors<V>(g)](std::ptrdiff_t k)
                           ALWAYS_INLINE { return magnitudes ? absolute(at(k)) : at(k); };
        const double* state = coupled_numbers<D>(x);
        const V sum = sum_of_states<D>(n_.coupled, [&](auto k) ALWAYS_INLINE { return c(k) * state[k]; });
        if (!driven_) return sum;
        V forced = c(input_column()) * u[0];
        for (int i = 1; i < depends_on_.inputs; ++i) forced += c(input_column() + i) * u[i];
        return sum + forced;
    }
    template <class V>
    [[gnu::always_inline]] V magnitude(int g, const Memory& m, const State& x, const Inputs& u) const {
        if constexpr (any)
            if (sparse())
                return each_form<V>(g, 0.0, [&](const LinearForm& f) {
                    double kept = 0.0;
                    for (const auto& [i, c] : f.of_memory()) kept += m[i] * std::fabs(c);
                    return std::fabs(f.one) + kept + form_terms<true>(f, x, u);
                });
        const auto c = factors<V>(g);
        V kept = m[0] * absolute(c(memory_column()));
        for (int k = 1; k < depends_on_.memory; ++k) kept += m[k] * absolute(c(memory_column() + k));
        return absolute(c(one_column())) + kept + terms<true, V>(g, x, u);
    }
    // Of forms that are kept one by one.
    template <class V, class Value>
    V each_form(int g, double missing, Value&& value) const {
        const auto of = [&](int row) {
            return row < static_cast<int>(forms_.size()) ? value(forms_[static_cast<std::size_t>(row)]) : missing;
        };
        if constexpr (std::same_as<V, double>) {
            return of(g);
        } else {
            V out{};
            for (int k = 0; k < vec_width; ++k) out[k] = of(g + k);
            return out;
        }
    }
    template <bool magnitudes>
    static double form_terms(const LinearForm& f, const State& x, const Inputs& u) {
        const auto c = [](double factor) { return magnitudes ? std::fabs(factor) : factor; };
        const double own = f.sum_of_coupled([&](int k, double factor) { return c(factor) * x.coupled[k]; });
        double forced = 0.0;
        for (const auto& [i, factor] : f.of_inputs()) forced += c(factor) * u[i];
        return own + forced;
    }

    std::size_t forms_count() const {
        if constexpr (any)
            return forms_.size();
        else
            return 0;
    }
    bool sparse() const {
        if constexpr (any)
            return sparse_;
        else
            return false;
    }
    // Where the coefficients lie: column by column those of the forms of one vector, vector by vector, so that what is
    // used lies together. The columns are [coupled states][angles, where sizes are fixed][1][memory][inputs].
    int one_column() const { return any ? n_.coupled : D::one; }
    int memory_column() const { return one_column() + 1; }
    int input_column() const { return any ? memory_column() + n_.memory : D::first_input; }
    int width() const { return any ? input_column() + n_.inputs : D::terms; }
    std::size_t index(int row, int column) const {
        return static_cast<std::size_t>((row / vec_width * width() + column) * vec_width + row % vec_width);
    }
    double& at_place(int row, int column) { return block_[index(row, column)]; }

    alignas(64) ArrayOf<D, double, N * D::terms> block_;
    int rows_;
    bool driven_, sparse_ = any;
    [[no_unique_address]] CountsOf<D> n_;
    [[no_unique_address]] DependsOn<D> depends_on_;
    [[no_unique_address]] std::conditional_t<any, std::vector<LinearForm>, std::monostate> forms_;
};

}  // namespace lostmotion
