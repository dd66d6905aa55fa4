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

#include "../base/sign.hpp"
#include "dims.hpp"

namespace lostmotion {

// Up to so many coupled states, whole matrices cost less than what of them is not zero.
inline constexpr int few_states = 16;

// A linear expression sum_k c[k] * term[k].
template <int N>
struct Form {
    std::array<double, N> c{};

    static constexpr Form unit(int term, double factor = 1.0) {
        Form f;
        f.c[term] = factor;
        return f;
    }
    Form& operator+=(const Form& o) {
        for (int k = 0; k < N; ++k) c[k] += o.c[k];
        return *this;
    }
    Form& operator*=(double a) {
        for (int k = 0; k < N; ++k) c[k] *= a;
        return *this;
    }
    friend Form operator*(double a, Form f) { return f *= a; }
};

// A linear expression with few terms, in the order of their places.
class AnyForm {
 public:
    struct Term {
        int place;
        double factor;
    };
    enum Part { of_coupled, of_angles, of_one, of_memory, of_inputs };

    class Coefficients {
     public:
        double operator[](int place) const {
            const std::size_t at = find(place);
            return at < terms_.size() && terms_[at].place == place ? terms_[at].factor : 0.0;
        }
        double& operator[](int place) {
            const std::size_t at = find(place);
            if (at == terms_.size() || terms_[at].place != place) {
                terms_.insert(terms_.begin() + static_cast<std::ptrdiff_t>(at), {place, 0.0});
                count(place);
            }
            return terms_[at].factor;
        }
        // A term whose place is beyond those of all others.
        void append(int place, double factor) {
            terms_.push_back({place, factor});
            count(place);
        }
        const std::vector<Term>& terms() const { return terms_; }
        // The first term of one of the parts and the end of the part.
        std::pair<const Term*, const Term*> part(Part p) const {
            const Term* all = terms_.data();
            return {p == of_coupled ? all : all + end_[p - 1], p == of_inputs ? all + terms_.size() : all + end_[p]};
        }

     private:
        std::size_t find(int place) const {
            const auto below = [](const Term& t, int p) { return t.place < p; };
            return static_cast<std::size_t>(std::lower_bound(terms_.begin(), terms_.end(), place, below) -
                                            terms_.begin());
        }
        void count(int place) {
            constexpr std::array beyond{Any::coupled, Any::states, Any::first_memory, Any::first_input};
            for (std::size_t p = 0; p < beyond.size(); ++p) end_[p] += place < beyond[p];
        }

        std::vector<Term> terms_;
        std::array<int, of_inputs> end_{};  // of each part but the last
    };
    Coefficients c;

    // Calls use(place, factor) for each term.
    template <class Use>
    void each_term(Use&& use) const {
        for (const Term& t : c.terms()) use(t.place, t.factor);
    }
    // Calls use(number, factor) for each term of a part, whose first number is at `first`.
    template <class Use>
    [[gnu::always_inline]] void each_of(Part part, int first, Use&& use) const {
        for (auto [t, end] = c.part(part); t != end; ++t) use(t->place - first, t->factor);
    }
    // sum value(place, factor) over the coupled states, in fours.
    template <class Value>
    double sum_of_coupled(Value&& value) const {
        double all = 0.0;
        for (auto [t, end] = c.part(of_coupled); t != end;) {
            const int four = t->place / 4;
            double part[4] = {};
            for (; t != end && t->place / 4 == four; ++t) part[t->place % 4] = value(t->place, t->factor);
            all += (part[0] + part[1]) + (part[2] + part[3]);
        }
        return all;
    }
};

template <class D>
using LinearFormOf = std::conditional_t<std::same_as<D, Any>, AnyForm, Form<D::terms>>;
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
[[gnu::always_inline]] inline CoupledOf<D> coupled(const LinearFormOf<D>& f) {
    if constexpr (std::same_as<D, Any>) {
        Numbers out;
        f.each_of(AnyForm::of_coupled, 0, [&](int k, double factor) { out[k] = factor; });
        return out;
    } else {
        return CoupledOf<D>::load(f.c.data());
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

// Calls use(place, factor) for each term of a form that may be other than zero and belongs to a state; use(number,
// factor) for those that belong to inputs, or to the memory.
template <class D, class Use>
[[gnu::always_inline]] inline void each_state_of(const LinearFormOf<D>& f, Use&& use) {
    if constexpr (std::same_as<D, Any>) {
        f.each_of(AnyForm::of_coupled, 0, use);
        f.each_of(AnyForm::of_angles, 0, use);
    } else {
        for (int k = 0; k < D::states; ++k) use(k, f.c[k]);
    }
}
template <class D, class Use>
[[gnu::always_inline]] inline void each_input_of(const LinearFormOf<D>& f, Use&& use) {
    if constexpr (std::same_as<D, Any>)
        f.each_of(AnyForm::of_inputs, D::first_input, use);
    else
        for (int i = 0; i < D::inputs; ++i) use(i, f.c[D::first_input + i]);
}
template <class D, class Use>
[[gnu::always_inline]] inline void each_memory_of(const LinearFormOf<D>& f, Use&& use) {
    if constexpr (std::same_as<D, Any>)
        f.each_of(AnyForm::of_memory, D::first_memory, use);
    else
        for (int k = 0; k < D::memory; ++k) use(k, f.c[D::first_memory + k]);
}
// The coefficient of 1.
template <class D>
double constant_of(const LinearFormOf<D>& f) {
    if constexpr (std::same_as<D, Any>) {
        const auto [one, end] = f.c.part(AnyForm::of_one);
        return one == end ? 0.0 : one->factor;
    } else {
        return f.c[D::one];
    }
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
template <class D>
double constant_part(const LinearFormOf<D>& f, const typename D::Memory& m) {
    double sum = constant_of<D>(f);
    each_memory_of<D>(f, [&](int k, double factor) ALWAYS_INLINE { sum += factor * m[k]; });
    return sum;
}

template <class D>
double input_part(const LinearFormOf<D>& f, const InputsOf<D>& u) {
    if constexpr (std::same_as<D, Any>) {
        double sum = 0.0;
        each_input_of<D>(f, [&](int i, double factor) { sum += factor * u[i]; });
        return sum;
    } else {
        double sum = f.c[D::first_input] * u[0];
        for (int i = 1; i < D::inputs; ++i) sum += f.c[D::first_input + i] * u[i];
        return sum;
    }
}

// The part of the coupled states.
template <class D>
double coupled_part(const LinearFormOf<D>& f, const StateOf<D>& x) {
    if constexpr (std::same_as<D, Any>) {
        return f.sum_of_coupled([&](int k, double factor) { return factor * x.coupled[k]; });
    } else {
        return (CoupledOf<D>::load(f.c.data()) * coupled(x)).sum();
    }
}

template <class D>
double evaluate(const LinearFormOf<D>& f, const StateOf<D>& x, const typename D::Memory& m, const InputsOf<D>& u) {
    double own = coupled_part<D>(f, x);
    if constexpr (std::same_as<D, Any>) {
        f.each_of(AnyForm::of_angles, 0, [&](int k, double factor) { own += factor * x[k]; });
    } else {
        for (int j = D::coupled; j < D::states; ++j) own += f.c[j] * x[j];
    }
    return (constant_part<D>(f, m) + input_part<D>(f, u)) + own;
}

// Sum of the magnitudes of the terms: rounding in evaluate() is a small multiple of epsilon times this.
template <class D>
double magnitude(const LinearFormOf<D>& f, const StateOf<D>& x, const typename D::Memory& m, const InputsOf<D>& u) {
    double sum = std::fabs(constant_of<D>(f));
    each_memory_of<D>(f, [&](int k, double factor) ALWAYS_INLINE { sum += std::fabs(factor * m[k]); });
    each_input_of<D>(f, [&](int i, double factor) ALWAYS_INLINE { sum += std::fabs(factor * u[i]); });
    each_state_of<D>(f, [&](int k, double factor) ALWAYS_INLINE { sum += std::fabs(factor * x[k]); });
    return sum;
}

// The same for a time derivative of the form, where the constant terms have dropped out.
template <class D>
double evaluate_rate(const LinearFormOf<D>& f, const StateOf<D>& rate, const InputsOf<D>& input_rate) {
    double sum = input_part<D>(f, input_rate);
    each_state_of<D>(f, [&](int k, double factor) ALWAYS_INLINE { sum += factor * rate[k]; });
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
    using LinearForm = LinearFormOf<D>;
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
        if (sparse()) {
            if constexpr (any) {
                if (row >= static_cast<int>(forms_.size())) forms_.resize(static_cast<std::size_t>(row) + 1);
                forms_[static_cast<std::size_t>(row)] = f;
            }
        } else {
            if constexpr (any)
                for (std::size_t n = block_.size(); n < static_cast<std::size_t>(rows_ * width()); ++n)
                    block_.push_back(static_cast<int>(n) / vec_width % width() == one_column() ? 1.0 : 0.0);
            at_place(row, one_column()) = constant_of<D>(f);
            each_state_of<D>(f, [&](int k, double c) {
                assert(k < D::coupled || c == 0.0);
                if (k < D::coupled) at_place(row, k) = c;
            });
            each_memory_of<D>(f, [&](int k, double c) { at_place(row, memory_column() + k) = c; });
            each_input_of<D>(f, [&](int i, double c) { at_place(row, input_column() + i) = c; });
        }
        each_input_of<D>(f, [&](int i, double c) {
            driven_ = driven_ || c != 0.0;
            depends_on_.see_input(i, c);
        });
        each_memory_of<D>(f, [&](int k, double c) { depends_on_.see_memory(k, c); });
    }
    int rows() const { return rows_; }  // rounded up to whole vectors
    double coefficient(int row, int term) const {
        if constexpr (any)
            if (sparse()) return forms_[static_cast<std::size_t>(row)].c[term];
        const int column = term < D::coupled        ? term
                           : term < D::first_memory ? one_column()
                           : term < D::first_input  ? memory_column() + term - D::first_memory
                                                    : input_column() + term - D::first_input;
        return block_[index(row, column)];
    }

    // The parts that depend on neither state nor inputs.
    void constants(const Memory& m, Values& out) const {
        each_vector(out, [&](int g) ALWAYS_INLINE {
            if constexpr (any)
                if (sparse())
                    return each_form<Vec>(g, 1.0, [&](const LinearForm& f) { return constant_part<D>(f, m); });
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
        const double* state = coupled_numbers(x);
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
        const double* state = coupled_numbers(x);
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
                    each_memory_of<D>(f, [&](int k, double c) { kept += m[k] * std::fabs(c); });
                    return std::fabs(constant_of<D>(f)) + kept + form_terms<true>(f, x, u);
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
        each_input_of<D>(f, [&](int i, double factor) { forced += c(factor) * u[i]; });
        return own + forced;
    }

    bool sparse() const {
        if constexpr (any)
            return sparse_;
        else
            return false;
    }
    static const double* coupled_numbers(const State& x) {
        if constexpr (any)
            return x.coupled.data();
        else
            return x.data();
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
