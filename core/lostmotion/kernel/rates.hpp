// The rates of one regime as arrays: what the linear forms of a regime are turned into for computing.
#pragma once

#include <cassert>
#include <cmath>

#include "form.hpp"
#include "inputs.hpp"

namespace lostmotion {

// A linear map of the coupled states, column by column.
template <class D>
struct MatrixOf {
    static constexpr int n = D::coupled;
    using Coupled = CoupledOf<D>;
    using Column = ColumnOf<D>;

    std::array<Column, n> column{};

    static const MatrixOf& identity() {
        static constexpr MatrixOf one = [] {
            MatrixOf m{};
            for (std::size_t k = 0; k < n; ++k) m.column[k][k] = 1.0;
            return m;
        }();
        return one;
    }

    [[gnu::always_inline]] Coupled at(int c) const { return load(column[c]); }
    [[gnu::always_inline]] Coupled operator*(const Coupled& v) const {
        return sum_in_fours<n>([&](auto k) ALWAYS_INLINE { return v.template spread<k>() * at(k); });
    }
    // The same for a vector that is in memory.
    [[gnu::always_inline]] Coupled operator*(const Column& v) const {
        return sum_in_fours<n>([&](auto k) ALWAYS_INLINE { return v[k] * at(k); });
    }
    double operator()(int row, int col) const { return column[col][row]; }
    Coupled row(int r) const {
        std::array<double, n> numbers;
        for (int c = 0; c < n; ++c) numbers[c] = column[c][r];
        return Coupled::of(numbers);
    }
    // A row times this.
    Coupled after(const Coupled& row) const {
        Coupled out;
        for (int c = 0; c < n; c += 4)
            out.set_four(c / 4, sums(row * at(c), row * at(c + 1), row * at(c + 2), row * at(c + 3)));
        return out;
    }

    // factor * other, entry by entry
    void add(double factor, const MatrixOf& other) {
        for (int c = 0; c < n; ++c) (at(c) + factor * other.at(c)).store(column[c].data());
    }
    void scale(double factor) {
        for (int c = 0; c < n; ++c) (factor * at(c)).store(column[c].data());
    }
    MatrixOf magnitudes() const {
        MatrixOf out;
        for (int c = 0; c < n; ++c) absolute(at(c)).store(out.column[c].data());
        return out;
    }
    friend MatrixOf operator*(const MatrixOf& a, const MatrixOf& b) {
        MatrixOf out;
        for (int c = 0; c < n; ++c) (a * b.column[c]).store(out.column[c].data());
        return out;
    }
};

// dx/dt = A x + constant + B u of one regime. The angles follow their speeds, and no rate depends on them.
template <class D>
struct LinearRatesOf {
    using Coupled = CoupledOf<D>;
    using Column = ColumnOf<D>;
    using State = StateOf<D>;
    using Lanes = LanesOf<D>;
    using Inputs = InputsOf<D>;
    using Memory = typename D::Memory;

    MatrixOf<D> rate;
    std::array<double, D::angles>
        angle_coefficient{};  // of each angle: 1 or, if its shaft is at rest, 0: its rate over its speed
    [[no_unique_address]] AngleSpeeds<D> angle_speed;
    std::array<Column, D::inputs> input_column{};
    Column fixed{};                              // the constant: its column for 1 ...
    std::array<Column, D::memory> per_memory{};  // ... and those for the memory
    [[no_unique_address]] DependsOn<D> depends_on;
    const std::vector<GivenState>* given = nullptr;  // states that are given speeds, if there are any

    LinearRatesOf() = default;
    // From the rates of all states.
    explicit LinearRatesOf(const std::array<LinearFormOf<D>, D::states>& of) {
        for (int j = 0; j < D::angles; ++j) {
            const LinearFormOf<D>& angle = of[D::coupled + j];
            for (int k = 0; k < D::coupled; ++k)
                if (angle.c[k] != 0.0) angle_speed.set(j, k);
            angle_coefficient[j] = angle.c[angle_speed[j]];
            for (int k = 0; k < D::terms; ++k) assert(k == angle_speed[j] || angle.c[k] == 0.0);
        }
        for (int r = 0; r < D::coupled; ++r) {
            const LinearFormOf<D>& f = of[r];
            for (int j = D::coupled; j < D::states; ++j) assert(f.c[j] == 0.0);
            for (int c = 0; c < D::coupled; ++c) rate.column[c][r] = f.c[c];
            for (int i = 0; i < D::inputs; ++i) {
                input_column[i][r] = f.c[D::first_input + i];
                depends_on.see_input(i, input_column[i][r]);
            }
            fixed[r] = f.c[D::one];
            for (int k = 0; k < D::memory; ++k) {
                per_memory[k][r] = f.c[D::first_memory + k];
                depends_on.see_memory(k, per_memory[k][r]);
            }
        }
    }

    // The part of dx/dt that depends on neither state nor inputs.
    Column constant(const Memory& m) const {
        Coupled kept = m[0] * load(per_memory[0]);
        for (int k = 1; k < depends_on.memory; ++k) kept = kept + m[k] * load(per_memory[k]);
        Column c;
        (load(fixed) + kept).store(c.data());
        return c;
    }
    // The part of it that the inputs bring.
    [[gnu::always_inline]] Coupled forced(const Inputs& u) const {
        Coupled sum = u[0] * load(input_column[0]);
        for (int i = 1; i < depends_on.inputs; ++i) sum = sum + u[i] * load(input_column[i]);
        return sum;
    }
    // From inputs that are asked for their values.
    template <class Input>
    [[gnu::always_inline]] Coupled forced(const Input& input) const {
        Inputs u{};
        input.values(depends_on.inputs, u);
        return forced(u);
    }
    // The rates of the angles.
    [[gnu::always_inline]] std::array<double, D::angles> angle_rate(const Coupled& x) const {
        std::array<double, D::angles> out;
        for (int j = 0; j < D::angles; ++j) out[j] = angle_coefficient[j] * x[angle_speed[j]];
        return out;
    }
    template <class Input>
    [[gnu::always_inline]] Lanes operator()(const Coupled& x, const Column& constant, const Input& u) const {
        return {(rate * x + forced(u)) + load(constant), angle_rate(x)};
    }
    [[gnu::always_inline]] State operator()(const State& x, const Column& constant, const Inputs& u) const {
        State out;
        (*this)(coupled(x), constant, u).store(out.data());
        return out;
    }
    // The next time derivative of the state from one that is at least the first.
    [[gnu::always_inline]] State higher(const State& derivative, const Inputs& u) const {
        return (*this)(derivative, Column{}, u);
    }

    // The fastest rate [1/s] of one state, or of two that act on each other, whatever their units.
    double fastest() const {
        double square = 0.0;
        for (int j = 0; j < D::coupled; ++j)
            for (int k = 0; k <= j; ++k) square = std::fmax(square, std::fabs(rate(j, k) * rate(k, j)));
        return std::sqrt(square);
    }

    // Sums of the magnitudes of the terms of both, from magnitudes of what they depend on.
    State magnitude(const State& x, const Memory& m, const Inputs& u) const {
        State out = higher_magnitude(x, u);
        Coupled kept = m[0] * absolute(load(per_memory[0]));
        for (int k = 1; k < depends_on.memory; ++k) kept = kept + m[k] * absolute(load(per_memory[k]));
        (coupled(out) + (absolute(load(fixed)) + kept)).store(out.data());
        return out;
    }
    State higher_magnitude(const State& derivative, const Inputs& u) const {
        Coupled forced = u[0] * absolute(load(input_column[0]));
        for (int i = 1; i < depends_on.inputs; ++i) forced = forced + u[i] * absolute(load(input_column[i]));
        State out;
        (sum_in_fours<D::coupled>([&](auto k) { return derivative[k] * absolute(rate.at(k)); }) + forced)
            .store(out.data());
        for (int j = 0; j < D::angles; ++j) out[D::coupled + j] = angle_coefficient[j] * derivative[angle_speed[j]];
        return out;
    }
};

}  // namespace lostmotion
