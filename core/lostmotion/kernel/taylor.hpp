// Taylor series of the motion in one regime about an instant.
//
// The derivatives of the state follow from one another, x^(k+1) = A x^(k) + B u^(k). They are computed three at a time,
//     x^(k+3) = A^3 x^(k) + A^2 B u^(k) + A B u^(k+1) + B u^(k+2),
// so that few products wait for one another.
#pragma once

#include <array>
#include <cassert>

#include "../base/polynomial.hpp"
#include "inputs.hpp"
#include "rates.hpp"

namespace lostmotion {

// 1/k!
inline constexpr std::array<double, Polynomial::degree + 2> over_factorial = [] {
    std::array<double, Polynomial::degree + 2> c{};
    double factorial = 1.0;
    for (std::size_t k = 0; k < c.size(); ++k) {
        if (k > 0) factorial *= static_cast<double>(k);
        c[k] = 1.0 / factorial;
    }
    return c;
}();

// The motion about an instant: its derivatives there, as far as a base interval needs them.
template <class D>
class Expansion {
 public:
    static constexpr int terms = Polynomial::degree;  // good for a base interval: 0.25^13/13! < 1e-17
    using Coupled = CoupledOf<D>;

    std::array<InputsOf<D>, terms + 1> input;  // [k]: their k-th derivative
    AnglesOf<D> angle_rate;                    // of the angles
    AnglesOf<D> angle_coefficient;             // their rates over their speeds
    [[no_unique_address]] AngleSpeeds<D> angle_speed;
    [[no_unique_address]] CountsOf<D> n;
    std::array<Coupled, terms> coupled;  // derivatives of the other states, from the first on

    // By how much the state changes over s.
    [[gnu::always_inline]] LanesOf<D> change(double s) const {
        const double s2 = s * s, s4 = s2 * s2;
        const Pack<4> powers = Pack<4>::of({s, s2, s2 * s, s4});
        const std::array<double, Polynomial::parts> lead{1.0, s4, s4 * s4};
        LanesOf<D> sum{};
        for (int part = Polynomial::parts - 1; part >= 0; --part) {  // the small terms first
            const Pack<4> c = lead[part] * powers * four_over_factorial(part);
            const Coupled* v = &coupled[static_cast<std::size_t>(4 * part)];
            sum.coupled = sum.coupled + ((by<0>(c, v[0]) + by<1>(c, v[1])) + (by<2>(c, v[2]) + by<3>(c, v[3])));
            const Pack<4> next = c * four_over_next(part);
            for (int j = 0; j < n.angles; ++j) {
                const int speed = angle_speed[j];
                sum.angle[j] += (next * Pack<4>::of({v[0][speed], v[1][speed], v[2][speed], v[3][speed]})).sum();
            }
        }
        for (int j = 0; j < n.angles; ++j) sum.angle[j] = s * (angle_rate[j] + angle_coefficient[j] * sum.angle[j]);
        return sum;
    }

    // By how much the rate of the coupled states changes over s.
    Coupled rate_change(double s) const {
        Coupled sum{};
        for (int k = terms - 1; k > 0; --k) sum = s / k * (coupled[static_cast<std::size_t>(k)] + sum);
        return sum;
    }

    // A form of the motion that does not depend on an angle, as a polynomial in the time [s] from the instant.
    [[gnu::always_inline]] Polynomial polynomial(const LinearForm& form, double value) const {
        Polynomial p(value);
        const Coupled c = lostmotion::coupled<D>(form);
        for (int part = 0; part < Polynomial::parts; ++part) {
            const Coupled* v = &coupled[static_cast<std::size_t>(4 * part)];
            p.part[part] = sums(c * v[0], c * v[1], c * v[2], c * v[3]);
            if (!form.of_inputs().empty()) {
                const auto* u = &input[static_cast<std::size_t>(4 * part + 1)];
                p.part[part] = p.part[part] + Pack<4>::of({input_part(form, u[0]), input_part(form, u[1]),
                                                           input_part(form, u[2]), input_part(form, u[3])});
            }
            p.part[part] = p.part[part] * four_over_factorial(part);
        }
        return p;
    }

 private:
    // A vector times one of four numbers.
    template <int k>
    [[gnu::always_inline]] static auto by(const Pack<4>& c, const Coupled& v) {
        if constexpr (D::coupled == 4)
            return c.spread<k>() * v;
        else
            return c[k] * v;
    }
    // 1/k! and 1/(k + 1) of the four terms of a part.
    static Pack<4> four_over_factorial(int part) {
        return Pack<4>::load(&over_factorial[static_cast<std::size_t>(4 * part + 1)]);
    }
    static Pack<4> four_over_next(int part) {
        static constexpr std::array<double, terms> table = [] {
            std::array<double, terms> c{};
            for (int k = 1; k <= terms; ++k) c[static_cast<std::size_t>(k - 1)] = 1.0 / (k + 1);
            return c;
        }();
        return Pack<4>::load(&table[static_cast<std::size_t>(4 * part)]);
    }
};

// G(h), the integral of exp(A s) from 0 to h. Matrix, Rows: where its numbers are.
template <class D, class Matrix = MatrixOf<D>, class Rows = ArrayOf<D, ColumnOf<D>, D::angles>>
struct IntegralOf {
    using Lanes = LanesOf<D>;

    Matrix coupled;
    Rows angle{};  // the rows of the angles, but for their own rates
    double length = 0.0;
    [[no_unique_address]] CountsOf<D> n;

    // By how much the state changes that had this rate.
    [[gnu::always_inline]] Lanes operator*(const Lanes& rate) const {
        Lanes out{coupled * rate.coupled, angle_changes(rate.coupled)};
        for (int j = 0; j < n.angles; ++j) out.angle[j] += length * rate.angle[j];
        return out;
    }
    [[gnu::always_inline]] Lanes operator*(const ColumnOf<D>& rate) const {
        return {coupled * rate, angle_changes(load(rate))};
    }

 private:
    [[gnu::always_inline]] AnglesOf<D> angle_changes(const CoupledOf<D>& rate) const {
        AnglesOf<D> out;
        if constexpr (std::same_as<D, Any> || D::angles == 1) {
            for (int j = 0; j < n.angles; ++j) out[j] = sum_of(load(angle[static_cast<std::size_t>(j)]) * rate);
        } else {  // at once
            constexpr int last = D::angles - 1;
            const auto of = [&](int j) ALWAYS_INLINE { return load(angle[std::min(j, last)]) * rate; };
            const Pack<4> change = sums(of(0), of(1), of(2), of(3));
            static_assert(D::angles <= 4);
            for (int j = 0; j < D::angles; ++j) out[j] = change[j];
        }
        return out;
    }
};

// What it takes to expand the motions of one regime.
template <class D>
class Taylor {
 public:
    using Coupled = CoupledOf<D>;
    using Lanes = LanesOf<D>;
    using Matrix = MatrixOf<D>;
    using LinearRates = LinearRatesOf<D>;
    using Integral = IntegralOf<D>;
    static constexpr int terms = Expansion<D>::terms;

    void prepare(const LinearRates& rates) {
        rates_ = &rates;
        const Matrix& A = rates.matrix();
        squared_ = A * A;
        cubed_ = A * squared_;
        lostmotion::make_room(input_, rates.n.inputs);
        for (int i = 0; i < rates.n.inputs; ++i) {
            const Coupled B = load(rates.input_column[i]);
            input_[i] = {B, A * B, squared_ * B};
        }
    }

    const LinearRates& rates() const { return *rates_; }

    // About an instant with this rate and these inputs, without the powers of the matrix.
    static void expand_by_rates(const LinearRates& rates, const Lanes& rate, const InputState<D>& input,
                                Expansion<D>& out)
        requires(std::same_as<D, Any>)
    {
        input.template jet<terms + 1>(out.input.data());
        out.angle_rate = rate.angle;
        out.angle_coefficient = rates.angle_coefficient;
        out.angle_speed = rates.angle_speed;
        out.n = rates.n;
        out.coupled[0] = rate.coupled;
        for (std::size_t k = 1; k < terms; ++k)
            out.coupled[k] = rates * out.coupled[k - 1] + rates.forced(out.input[k]);
    }
    // The same by the powers of the matrix.
    [[gnu::always_inline]] void expand(const Lanes& rate, const InputState<D>& input, Expansion<D>& out) const {
        input.template jet<terms + 1>(out.input.data());
        Varies varies;
        for (int i = 0; i < rates_->n.inputs; ++i) varies[i] = input.varies(i);
        expand(rate, varies, out);
    }
    // The answer from rest to a function of the inputs after h.
    Lanes response(const InputBasis& function, double h) const {
        Expansion<D> e{};
        for (int k = 1; k <= terms; ++k) e.input[static_cast<std::size_t>(k)][function.input] = function.derivative(k);
        Varies varies{};
        varies[function.input] = true;
        expand({}, varies, e);
        return e.change(h);
    }

    // Of the coupled states.
    [[gnu::always_inline]] Coupled fourth_derivative(const Coupled& rate, const InputState<D>& input) const {
        Coupled sum = cubed_ * rate;
        for (int i = 0; i < rates_->depends_on.inputs; ++i) {
            if (!input.varies(i)) continue;
            const auto [first, second, third] = input.derivatives(i);
            sum = sum + input_[i].bring(first, second, third);
        }
        return sum;
    }

    // G over at most one base interval.
    Integral integral(double h) const {
        Matrix one = rates_->matrix(), two = squared_, three = cubed_;
        one.scale(h);
        two.scale(h * h);
        three.scale(h * h * h);
        Integral sum{power_series<1>(one, two, three), {}, h, rates_->n};
        sum.coupled.scale(h);
        lostmotion::make_room(sum.angle, rates_->n.angles);
        // An angle is turned by the integral of its speed's row.
        for (int j = 0; j < rates_->n.angles; ++j) {
            const int speed = rates_->angle_speed[j];
            const Coupled first = one.unit(speed), second = one.row(speed), third = two.row(speed);
            Coupled row{};
            for (int k = terms - 3; k >= 0; k -= 3)
                row = three.after(row) + (over_factorial[k + 2] * first +
                                          (over_factorial[k + 3] * second + over_factorial[k + 4] * third));
            store<D>(rates_->angle_coefficient[j] * h * h * row, sum.angle[j]);
        }
        return sum;
    }

    // sum_k B^k/(k + shift)!, from the first three powers of B; its norm is at most that of a base interval.
    template <int shift>
    static Matrix power_series(const Matrix& one, const Matrix& two, const Matrix& three) {
        static_assert(terms == 12);
        Matrix sum = Matrix::like(one);
        for (int k = 9; k >= 0; k -= 3) {
            if (k < 9) sum = three * sum;
            sum.add_identity(over_factorial[k + shift]);
            sum.add(over_factorial[k + 1 + shift], one);
            sum.add(over_factorial[k + 2 + shift], two);
        }
        return sum;
    }

 private:
    // B, A B and A^2 B of one input.
    struct Forcing {
        Coupled now, next, after;

        // To x^(k+3), from the k-th derivative of the input and the two after it.
        [[gnu::always_inline]] auto bring(double first, double second, double third) const {
            return first * after + (second * next + third * now);
        }
    };

    using Varies = ListOf<D, bool, D::inputs>;

    [[gnu::always_inline]] void expand(const Lanes& rate, const Varies& varies, Expansion<D>& out) const {
        out.angle_rate = rate.angle;
        out.angle_coefficient = rates_->angle_coefficient;
        out.angle_speed = rates_->angle_speed;
        out.n = rates_->n;
        const auto recur = [&](auto force) ALWAYS_INLINE {
            auto& v = out.coupled;
            const auto set = [&](Coupled& to, Coupled x, int k) ALWAYS_INLINE {
                force(x, k);
                to = x;
            };
            v[0] = rate.coupled;
            set(v[1], rates_->matrix() * v[0], -2);
            set(v[2], squared_ * v[0], -1);
            for (int k = 0; k + 3 < terms; ++k) set(v[k + 3], cubed_ * v[k], k);
        };
        const auto force = [&](Coupled& x, int k, int i) ALWAYS_INLINE {
            const auto u = [&](int j) { return j < 1 ? 0.0 : out.input[static_cast<std::size_t>(j)][i]; };
            x = x + input_[i].bring(u(k + 1), u(k + 2), u(k + 3));
        };
        const auto free = [](Coupled&, int) ALWAYS_INLINE {};
        if constexpr (D::inputs == 2) {  // every case by itself, for the sake of speed
            if (varies[0] && varies[1])
                recur([&](Coupled& x, int k) ALWAYS_INLINE {
                    force(x, k, 0);
                    force(x, k, 1);
                });
            else if (varies[0])
                recur([&](Coupled& x, int k) ALWAYS_INLINE { force(x, k, 0); });
            else if (varies[1])
                recur([&](Coupled& x, int k) ALWAYS_INLINE { force(x, k, 1); });
            else
                recur(free);
        } else {
            ListOf<D, int, D::inputs> varying;
            int n = 0;
            for (int i = 0; i < rates_->depends_on.inputs; ++i)
                if (varies[i]) varying[n++] = i;
            if (n == 0)
                recur(free);
            else if (n == 1)
                recur([&, i = varying[0]](Coupled& x, int k) ALWAYS_INLINE { force(x, k, i); });
            else
                recur([&](Coupled& x, int k) {
                    for (int j = 0; j < n; ++j) force(x, k, varying[j]);
                });
        }
    }

    const LinearRates* rates_ = nullptr;
    Matrix squared_, cubed_;  // A^2, A^3
    ArrayOf<D, Forcing, D::inputs> input_;
};

}  // namespace lostmotion
