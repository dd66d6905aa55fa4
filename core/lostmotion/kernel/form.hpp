// States, and linear expressions in what a regime's equations may depend on.
#pragma once

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <concepts>
#include <type_traits>

#include "numbers.hpp"

namespace lostmotion {

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
    Form& operator-=(const Form& o) {
        for (int k = 0; k < N; ++k) c[k] -= o.c[k];
        return *this;
    }
    Form& operator*=(double a) {
        for (int k = 0; k < N; ++k) c[k] *= a;
        return *this;
    }
    friend Form operator+(Form a, const Form& b) { return a += b; }
    friend Form operator-(Form a, const Form& b) { return a -= b; }
    friend Form operator*(double a, Form f) { return f *= a; }
    friend Form operator/(Form f, double a) { return f *= 1.0 / a; }
    friend Form operator-(Form f) { return f *= -1.0; }
};

template <class D>
struct FormIn {
    using Type = Form<D::terms>;
};
template <>
struct FormIn<Any> {
    using Type = AnyForm;
};
template <class D>
using LinearFormOf = typename FormIn<D>::Type;

// The coupled states, in registers; then a state, and its coupled part alone, in memory.
template <class D>
struct CoupledIn {
    using Type = Pack<D::coupled>;
};
template <>
struct CoupledIn<Any> {
    using Type = Numbers;
};
template <class D>
using CoupledOf = typename CoupledIn<D>::Type;
template <class D>
struct alignas(sizeof(typename CoupledOf<D>::Part)) StateOf : std::array<double, D::states> {};
template <>
struct StateOf<Any> {
    Numbers coupled;
    Few<double, 4> angle;

    double operator[](int k) const { return k < Any::coupled ? coupled[k] : angle[k - Any::coupled]; }
    double& operator[](int k) { return k < Any::coupled ? coupled[k] : angle[k - Any::coupled]; }
    friend bool operator==(const StateOf&, const StateOf&) = default;
};
template <class D>
struct alignas(sizeof(typename CoupledOf<D>::Part)) ColumnOf : std::array<double, D::coupled> {};
template <>
struct ColumnOf<Any> : Numbers {
    ColumnOf() = default;
    ColumnOf(Numbers numbers) : Numbers(std::move(numbers)) {}
};
template <class D>
using InputsOf = std::conditional_t<std::same_as<D, Any>, Few<double, 8>, std::array<double, D::inputs>>;
template <class D>
using AnglesOf = std::conditional_t<std::same_as<D, Any>, Few<double, 4>, std::array<double, D::angles>>;

// A state in registers.
template <class D>
struct LanesOf {
    CoupledOf<D> coupled{};
    AnglesOf<D> angle{};

    [[gnu::always_inline]] static LanesOf load(const StateOf<D>& from) {
        if constexpr (std::same_as<D, Any>) {
            return {from.coupled, from.angle};
        } else {
            LanesOf x{CoupledOf<D>::load(from.data()), {}};
            for (int j = 0; j < D::angles; ++j) x.angle[j] = from[D::coupled + j];
            return x;
        }
    }
    [[gnu::always_inline]] void store(StateOf<D>& to) const {
        if constexpr (std::same_as<D, Any>) {
            to.coupled = coupled;
            to.angle = angle;
        } else {
            coupled.store(to.data());
            for (int j = 0; j < D::angles; ++j) to[D::coupled + j] = angle[j];
        }
    }
    [[gnu::always_inline]] friend LanesOf operator+(LanesOf a, const LanesOf& b) {
        a.coupled = a.coupled + b.coupled;
        for (std::size_t j = 0; j < b.angle.size(); ++j) a.angle[j] += b.angle[j];
        return a;
    }
    [[gnu::always_inline]] friend LanesOf operator*(double a, LanesOf b) {
        b.coupled = a * b.coupled;
        for (double& angle : b.angle) angle *= a;
        return b;
    }
};
template <class D>
[[gnu::always_inline]] inline LanesOf<D> load(const StateOf<D>& x) {
    return LanesOf<D>::load(x);
}
template <class D>
[[gnu::always_inline]] inline CoupledOf<D> load(const ColumnOf<D>& x) {
    return CoupledOf<D>::load(x.data());
}
inline const Numbers& load(const ColumnOf<Any>& x) { return x; }
template <class D>
[[gnu::always_inline]] inline CoupledOf<D> coupled(const StateOf<D>& x) {
    return CoupledOf<D>::load(x.data());
}
inline const Numbers& coupled(const StateOf<Any>& x) { return x.coupled; }
// The coupled states into memory.
template <class D>
[[gnu::always_inline]] inline void store(const CoupledOf<D>& x, ColumnOf<D>& to) {
    if constexpr (std::same_as<D, Any>)
        static_cast<Numbers&>(to) = x;
    else
        x.store(to.data());
}
template <class D>
[[gnu::always_inline]] inline void store(const CoupledOf<D>& x, StateOf<D>& to) {
    if constexpr (std::same_as<D, Any>)
        to.coupled = x;
    else
        x.store(to.data());
}
// Those of a form.
template <class D>
[[gnu::always_inline]] inline CoupledOf<D> coupled(const LinearFormOf<D>& f) {
    if constexpr (std::same_as<D, Any>) {
        Numbers out;
        f.each_term([&](int place, double factor) {
            if (place < Any::coupled) out[place] = factor;
        });
        return out;
    } else {
        return CoupledOf<D>::load(f.c.data());
    }
}
template <class D>
void add_scaled(StateOf<D>& y, double a, const StateOf<D>& x) {
    (load(y) + a * load(x)).store(y);
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
inline constexpr int n_derivatives = 6;
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

// Calls use(place, factor) for each term of a form that may be other than zero.
template <int N, class Use>
[[gnu::always_inline]] inline void each_term(const Form<N>& f, Use&& use) {
    for (int k = 0; k < N; ++k) use(k, f.c[k]);
}
template <class Use>
void each_term(const AnyForm& f, Use&& use) {
    f.each_term(use);
}
// Of those that belong to states, or to inputs by their number.
template <class D, class Use>
[[gnu::always_inline]] inline void each_state_of(const LinearFormOf<D>& f, Use&& use) {
    if constexpr (std::same_as<D, Any>) {
        const auto [begin, end] = f.between(0, D::states);
        for (auto* t = begin; t != end; ++t) use(t->place, t->factor);
    } else {
        for (int k = 0; k < D::states; ++k) use(k, f.c[k]);
    }
}
template <class D, class Use>
[[gnu::always_inline]] inline void each_input_of(const LinearFormOf<D>& f, Use&& use) {
    if constexpr (std::same_as<D, Any>) {
        const auto [begin, end] = f.between(D::first_input, D::terms);
        for (auto* t = begin; t != end; ++t) use(t->place - D::first_input, t->factor);
    } else {
        for (int i = 0; i < D::inputs; ++i) use(i, f.c[D::first_input + i]);
    }
}
template <class D, class Use>
[[gnu::always_inline]] inline void each_memory_of(const LinearFormOf<D>& f, Use&& use) {
    if constexpr (std::same_as<D, Any>) {
        const auto [begin, end] = f.between(D::first_memory, D::first_input);
        for (auto* t = begin; t != end; ++t) use(t->place - D::first_memory, t->factor);
    } else {
        for (int k = 0; k < D::memory; ++k) use(k, f.c[D::first_memory + k]);
    }
}

// The part of a form that depends on neither state nor inputs: constant within a regime.
template <class D>
double constant_part(const LinearFormOf<D>& f, const typename D::Memory& m) {
    double sum = f.c[D::one];
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
        const auto [begin, end] = f.between(0, D::coupled);
        return AnyForm::sum_of_coupled(begin, end, [&](const auto& t) { return t.factor * x.coupled[t.place]; });
    } else {
        return (CoupledOf<D>::load(f.c.data()) * coupled(x)).sum();
    }
}

template <class D>
double evaluate(const LinearFormOf<D>& f, const StateOf<D>& x, const typename D::Memory& m, const InputsOf<D>& u) {
    double own = coupled_part<D>(f, x);
    if constexpr (std::same_as<D, Any>) {
        const auto [begin, end] = f.between(D::coupled, D::states);
        for (auto* t = begin; t != end; ++t) own += t->factor * x[t->place];
    } else {
        for (int j = D::coupled; j < D::states; ++j) own += f.c[j] * x[j];
    }
    return (constant_part<D>(f, m) + input_part<D>(f, u)) + own;
}

// Sum of the magnitudes of the terms: rounding in evaluate() is a small multiple of epsilon times this.
template <class D>
double magnitude(const LinearFormOf<D>& f, const StateOf<D>& x, const typename D::Memory& m, const InputsOf<D>& u) {
    double sum = std::fabs(f.c[D::one]);
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
// an angle.
template <class D, int N>
class FormTable {
 public:
    static_assert(N % vec_width == 0);
    using Values = std::array<double, N>;
    using LinearForm = LinearFormOf<D>;
    using State = StateOf<D>;
    using Inputs = InputsOf<D>;
    using Memory = typename D::Memory;

    FormTable() { clear(); }

    // Forms that are not there are 1.
    void clear() {
        block_ = {};
        for (int row = 0; row < N; ++row) place(row, D::one) = 1.0;
        rows_ = 0;
        driven_ = false;
        depends_on_ = {};
    }

    void set(int row, const LinearForm& f) {
        for (int j = D::coupled; j < D::states; ++j) assert(f.c[j] == 0.0);
        for (int k = 0; k < D::terms; ++k) place(row, k) = f.c[k];
        rows_ = std::max(rows_, (row + vec_width) / vec_width * vec_width);
        for (int i = 0; i < D::inputs; ++i) {
            driven_ = driven_ || f.c[D::first_input + i] != 0.0;
            depends_on_.see_input(i, f.c[D::first_input + i]);
        }
        for (int k = 0; k < D::memory; ++k) depends_on_.see_memory(k, f.c[D::first_memory + k]);
    }
    int rows() const { return rows_; }  // rounded up to whole vectors
    double coefficient(int row, int term) const { return block_[row / vec_width][term][row % vec_width]; }
    LinearForm form(int row) const {
        LinearForm f;
        for (int k = 0; k < D::terms; ++k) f.c[k] = coefficient(row, k);
        return f;
    }

    // The parts that depend on neither state nor inputs.
    void constants(const Memory& m, Values& out) const {
        for (int g = 0; g < rows_; g += vec_width) {
            Vec sum = at(D::one, g);
            for (int k = 0; k < depends_on_.memory; ++k) sum += m[k] * at(D::first_memory + k, g);
            store(sum, &out[g]);
        }
    }
    [[gnu::always_inline]] void evaluate(const Values& constant, const State& x, const Inputs& u, Values& out) const {
        for (int g = 0; g < rows_; g += vec_width) store(load(&constant[g]) + terms(g, x, u), &out[g]);
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
        for (int g = 0; g < rows_; g += vec_width) {
            store(load(&constant[g]) + terms(g, x, u), &value[g]);
            store(terms(g, rate, u_rate), &slope[g]);
        }
    }
    // Sums of the magnitudes of the terms, from magnitudes of what the forms depend on.
    void magnitudes(const Memory& m, const State& x, const Inputs& u, Values& out) const {
        for (int g = 0; g < rows_; g += vec_width) store(magnitude<Vec>(g, m, x, u), &out[g]);
    }
    // The same of one form.
    template <class Input>
    double magnitude_of(int row, const Memory& m, const State& x, const Input& input) const {
        return magnitude<double>(row, m, x, driven_ ? input.magnitudes() : Inputs{});
    }
    void rate_magnitudes(const State& rate, const Inputs& input_rate, Values& out) const {
        for (int g = 0; g < rows_; g += vec_width) store(terms<true>(g, rate, input_rate), &out[g]);
    }
    // Time derivatives, from those of state and inputs.
    [[gnu::always_inline]] void rates(const State& rate, const Inputs& input_rate, Values& out) const {
        for (int g = 0; g < rows_; g += vec_width) store(terms(g, rate, input_rate), &out[g]);
    }

 private:
    // V: Vec for as many forms as it holds, from the g-th on; double for that alone.
    template <class V = Vec>
    V at(int term, int g) const {
        V v;
        std::memcpy(&v, &block_[g / vec_width][term][g % vec_width], sizeof v);
        return v;
    }
    template <bool magnitudes = false, class V = Vec>
    [[gnu::always_inline]] V terms(int g, const State& x, const Inputs& u) const {
        const auto c = [&](int term) { return magnitudes ? absolute(at<V>(term, g)) : at<V>(term, g); };
        const V sum = sum_in_fours<D::coupled>([&](auto k) { return c(k) * x[k]; });
        if (!driven_) return sum;
        V forced = c(D::first_input) * u[0];
        for (int i = 1; i < depends_on_.inputs; ++i) forced += c(D::first_input + i) * u[i];
        return sum + forced;
    }
    template <class V>
    [[gnu::always_inline]] V magnitude(int g, const Memory& m, const State& x, const Inputs& u) const {
        V kept = m[0] * absolute(at<V>(D::first_memory, g));
        for (int k = 1; k < depends_on_.memory; ++k) kept += m[k] * absolute(at<V>(D::first_memory + k, g));
        return absolute(at<V>(D::one, g)) + kept + terms<true, V>(g, x, u);
    }

    double& place(int row, int term) { return block_[row / vec_width][term][row % vec_width]; }

    // Term by term the coefficients of the forms of one vector, vector by vector: what is used lies together.
    alignas(64) std::array<std::array<std::array<double, vec_width>, D::terms>, N / vec_width> block_;
    int rows_;
    bool driven_;
    [[no_unique_address]] DependsOn<D> depends_on_;
};

// For trains of any size: the coefficients that are not zero, form by form.
template <int N>
class FormTable<Any, N> {
 public:
    using D = Any;
    using Values = Few<double, 32>;
    using LinearForm = AnyForm;
    using State = StateOf<D>;
    using Inputs = InputsOf<D>;
    using Memory = D::Memory;

    void clear() {
        forms_.clear();
        block_.clear();
        states_ = 0;
        depends_on_ = {};
        driven_ = false;
    }
    // Of few states the coefficients are kept whole, side by side as the other kernels keep them.
    void set_states(int coupled) { states_ = coupled <= few_states ? coupled : 0; }
    void set(int row, const LinearForm& f) {
        if (static_cast<std::size_t>(row) >= forms_.size()) forms_.resize(static_cast<std::size_t>(row) + 1, one());
        forms_[static_cast<std::size_t>(row)] = f;
        block_.resize(static_cast<std::size_t>(rows() * states_));
        each_state_of<D>(f, [&](int k, double factor) {
            if (k < states_)
                block_[static_cast<std::size_t>((row / vec_width * states_ + k) * vec_width + row % vec_width)] =
                    factor;
        });
        each_input_of<D>(f, [&](int i, double factor) {
            driven_ = driven_ || factor != 0.0;
            depends_on_.see_input(i, factor);
        });
    }
    int rows() const { return (static_cast<int>(forms_.size()) + vec_width - 1) / vec_width * vec_width; }
    double coefficient(int row, int term) const { return form(row).c[term]; }
    const LinearForm& form(int row) const { return forms_[static_cast<std::size_t>(row)]; }

    void constants(const Memory& m, Values& out) const {
        fill(out, [&](const LinearForm& f) { return constant_part<D>(f, m); }, 1.0);
    }
    void evaluate(const Values& constant, const State& x, const Inputs& u, Values& out) const {
        terms(x, u, out);
        double* to = out.data();
        for (int g = 0; g < rows(); ++g) to[g] = constant.data()[g] + to[g];
    }
    template <class Input>
    void evaluate(const Values& constant, const State& x, const State& rate, const Input& input, Values& value,
                  Values& slope) const {
        Inputs u{}, u_rate{};
        if (driven_) {
            input.values(depends_on_.inputs, u);
            input.rates(depends_on_.inputs, u_rate);
        }
        evaluate(constant, x, u, value);
        rates(rate, u_rate, slope);
    }
    void magnitudes(const Memory& m, const State& x, const Inputs& u, Values& out) const {
        fill(out, [&](const LinearForm& f) { return magnitude(f, m, x, u); });
    }
    template <class Input>
    double magnitude_of(int row, const Memory& m, const State& x, const Input& input) const {
        return magnitude(form(row), m, x, driven_ ? input.magnitudes() : Inputs{});
    }
    void rate_magnitudes(const State& rate, const Inputs& input_rate, Values& out) const {
        terms<true>(rate, input_rate, out);
    }
    void rates(const State& rate, const Inputs& input_rate, Values& out) const { terms(rate, input_rate, out); }

 private:
    static const LinearForm& one() {
        static const LinearForm form = [] {
            LinearForm f;
            f.c[D::one] = 1.0;
            return f;
        }();
        return form;
    }
    // Of each form, and of those that are missing to whole vectors.
    template <class Value>
    void fill(Values& out, Value&& value, double missing = 0.0) const {
        out.reach(static_cast<std::size_t>(rows()));
        double* to = out.data();
        for (const LinearForm& f : forms_) *to++ = value(f);
        while (to < out.data() + rows()) *to++ = missing;
    }
    // Of all forms.
    template <bool magnitudes = false>
    void terms(const State& x, const Inputs& u, Values& out) const {
        if (states_ == 0) {
            fill(out, [&](const LinearForm& f) { return terms<magnitudes>(f, x, u); });
            return;
        }
        out.reach(static_cast<std::size_t>(rows()));
        for (int g = 0; g < rows(); g += vec_width) {
            const double* c = block_.data() + g * states_;
            Vec sum{};
            for (int k = 0; k < states_; k += 4) {
                const auto part = [&](int j) ALWAYS_INLINE {
                    const Vec factor = load(c + (k + j) * vec_width);
                    return (magnitudes ? absolute(factor) : factor) * x.coupled.data()[k + j];
                };
                sum += (part(0) + part(1)) + (part(2) + part(3));
            }
            store(sum, out.data() + g);
        }
        if (!driven_) return;
        double* to = out.data();
        for (const LinearForm& f : forms_) {
            double forced = 0.0;
            each_input_of<D>(f, [&](int i, double c) { forced += (magnitudes ? std::fabs(c) : c) * u[i]; });
            *to++ += forced;
        }
    }
    template <bool magnitudes = false>
    static double terms(const LinearForm& f, const State& x, const Inputs& u) {
        const auto c = [](double factor) { return magnitudes ? std::fabs(factor) : factor; };
        const auto [begin, end] = f.between(0, D::coupled);
        const double own = AnyForm::sum_of_coupled(
            begin, end, [&](const AnyForm::Term& t) { return c(t.factor) * x.coupled[t.place]; });
        double forced = 0.0;
        each_input_of<D>(f, [&](int i, double factor) { forced += c(factor) * u[i]; });
        return own + forced;
    }
    static double magnitude(const LinearForm& f, const Memory& m, const State& x, const Inputs& u) {
        double kept = 0.0;
        each_memory_of<D>(f, [&](int k, double factor) { kept += m[k] * std::fabs(factor); });
        return std::fabs(f.c[D::one]) + kept + terms<true>(f, x, u);
    }

    std::vector<LinearForm> forms_;
    std::vector<double> block_;
    int states_ = 0;
    bool driven_ = false;
    DependsOn<D> depends_on_;
};

}  // namespace lostmotion
