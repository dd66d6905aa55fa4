// States, and linear expressions in what a regime's equations may depend on.
#pragma once

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>

#include "dims.hpp"
#include "vec.hpp"

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
using LinearFormOf = Form<D::terms>;

template <class D>
using CoupledOf = Pack<D::coupled>;
template <class D>
struct alignas(sizeof(typename CoupledOf<D>::Part)) StateOf : std::array<double, D::states> {};
// The coupled states alone.
template <class D>
struct alignas(sizeof(typename CoupledOf<D>::Part)) ColumnOf : std::array<double, D::coupled> {};
template <class D>
using InputsOf = std::array<double, D::inputs>;

// A state in registers.
template <class D>
struct LanesOf {
    CoupledOf<D> coupled{};
    std::array<double, D::angles> angle{};

    [[gnu::always_inline]] static LanesOf load(const double* from) {
        LanesOf x{CoupledOf<D>::load(from), {}};
        for (int j = 0; j < D::angles; ++j) x.angle[j] = from[D::coupled + j];
        return x;
    }
    [[gnu::always_inline]] void store(double* to) const {
        coupled.store(to);
        for (int j = 0; j < D::angles; ++j) to[D::coupled + j] = angle[j];
    }
    [[gnu::always_inline]] friend LanesOf operator+(LanesOf a, const LanesOf& b) {
        a.coupled = a.coupled + b.coupled;
        for (int j = 0; j < D::angles; ++j) a.angle[j] += b.angle[j];
        return a;
    }
    [[gnu::always_inline]] friend LanesOf operator*(double a, LanesOf b) {
        b.coupled = a * b.coupled;
        for (int j = 0; j < D::angles; ++j) b.angle[j] *= a;
        return b;
    }
};
template <class D>
[[gnu::always_inline]] inline LanesOf<D> load(const StateOf<D>& x) {
    return LanesOf<D>::load(x.data());
}
template <class D>
[[gnu::always_inline]] inline CoupledOf<D> load(const ColumnOf<D>& x) {
    return CoupledOf<D>::load(x.data());
}
template <class D>
[[gnu::always_inline]] inline CoupledOf<D> coupled(const StateOf<D>& x) {
    return CoupledOf<D>::load(x.data());
}
template <class D>
void add_scaled(StateOf<D>& y, double a, const StateOf<D>& x) {
    (load(y) + a * load(x)).store(y.data());
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
    magnitude.store(out.data());
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

// The part of a form that depends on neither state nor inputs: constant within a regime.
template <class D>
double constant_part(const LinearFormOf<D>& f, const typename D::Memory& m) {
    double sum = f.c[D::one];
    for (int k = 0; k < D::memory; ++k) sum += f.c[D::first_memory + k] * m[k];
    return sum;
}

template <class D>
double input_part(const LinearFormOf<D>& f, const InputsOf<D>& u) {
    double sum = f.c[D::first_input] * u[0];
    for (int i = 1; i < D::inputs; ++i) sum += f.c[D::first_input + i] * u[i];
    return sum;
}

template <class D>
double evaluate(const LinearFormOf<D>& f, const StateOf<D>& x, const typename D::Memory& m, const InputsOf<D>& u) {
    double own = (CoupledOf<D>::load(f.c.data()) * coupled(x)).sum();
    for (int j = D::coupled; j < D::states; ++j) own += f.c[j] * x[j];
    return (constant_part<D>(f, m) + input_part<D>(f, u)) + own;
}

// Sum of the magnitudes of the terms: rounding in evaluate() is a small multiple of epsilon times this.
template <class D>
double magnitude(const LinearFormOf<D>& f, const StateOf<D>& x, const typename D::Memory& m, const InputsOf<D>& u) {
    double sum = std::fabs(f.c[D::one]);
    for (int k = 0; k < D::memory; ++k) sum += std::fabs(f.c[D::first_memory + k] * m[k]);
    for (int i = 0; i < D::inputs; ++i) sum += std::fabs(f.c[D::first_input + i] * u[i]);
    for (int k = 0; k < D::states; ++k) sum += std::fabs(f.c[k] * x[k]);
    return sum;
}

// The same for a time derivative of the form, where the constant terms have dropped out.
template <class D>
double evaluate_rate(const LinearFormOf<D>& f, const StateOf<D>& rate, const InputsOf<D>& input_rate) {
    double sum = input_part<D>(f, input_rate);
    for (int k = 0; k < D::states; ++k) sum += f.c[k] * rate[k];
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

}  // namespace lostmotion
