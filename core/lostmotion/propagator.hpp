// Exact propagation within one regime.
//
// Over an interval s from an anchor instant,
//     x(s) = x + G(s) x' + sum_q w_q y_q(s),     G(s) = integral of exp(A r) dr from 0 to s,
// where x' is the rate at the anchor and y_q is the response from rest to the q-th function by which the inputs
// depart from their anchor values (a ramp, cos - 1, sin). G and y_q come from their Taylor series over a short base
// interval and are doubled as often as needed:
//     E(2h) = 2 E(h) + E(h) E(h),   G(2h) = 2 G(h) + E(h) G(h),   E = exp(A h) - 1.
// It is E that is doubled, not the exponential: so slow motions keep their relative accuracy beside fast ones, and a
// state at rest stays at rest to the last bit.
#pragma once

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <vector>

#include "linear_rates.hpp"
#include "signal.hpp"

namespace lostmotion {

// Everything needed to step by one length in one regime.
struct Step {
    Matrix change;    // E(h) = exp(A h) - 1
    Matrix integral;  // G(h)
    Matrix growth;    // bound on |exp(A s)|, element by element, for 0 <= s <= h
};

// The response from rest to one function of an input, at the end of a step.
struct Response {
    State x{}, rate{};
};

// Time derivatives of state and inputs at one instant.
struct Expansion {
    static constexpr int most = 12;  // good for two base intervals: 0.25^13/13! < 1e-17

    int terms = 0;
    std::array<State, most> x;                             // from the first derivative on
    std::array<std::array<double, n_inputs>, most + 1> u;  // from the value on
};

class Propagator {
 public:
    static constexpr int max_levels = 40;
    static constexpr int usual_levels = 12;
    static constexpr double base_norm = 0.125;  // |A| h of the base interval, in scaled units

    // turns: its unit is a length of which some power-of-two multiple or fraction is the base interval.
    // scale: natural sizes of the states; only for choosing the base interval.
    // rates and turns must outlive this.
    void prepare(const LinearRates& rates, InputTurns& turns, const State& scale) {
        linear_ = &rates;
        turns_ = &turns;
        basis_ = turns.basis().data();
        n_basis_ = static_cast<int>(turns.basis().size());
        const double fastest = turns.fastest();
        norm_ = fastest;
        for (int r = 0; r < n_states; ++r) {
            double sum = 0.0;
            for (int c = 0; c < Matrix::coupled; ++c) sum += std::fabs(rates.rate(r, c)) * scale[c] / scale[r];
            norm_ = std::fmax(norm_, sum);
        }
        base_ = turns.unit();
        exponent_ = 0;
        for (; norm_ * base_ > base_norm; base_ *= 0.5) --exponent_;
        longest_ = 0;
        while (longest_ + 1 < max_levels && fastest * length(longest_ + 1) <= 1.0) ++longest_;
        turning_ = rates.rate.angle[load_speed];
        levels_ = 0;
        steps_.clear();
        responses_.clear();
        rotations_.clear();
        steps_.reserve(usual_levels);
        responses_.reserve(static_cast<std::size_t>(usual_levels * n_basis_));
        prepare_derivatives();
        add_base();
    }

    bool ready() const { return levels_ > 0; }
    void reset() { levels_ = 0; }

    const LinearRates& rates() const { return *linear_; }
    double turning() const { return turning_; }  // rate of the load angle per load speed: 1 where the load may turn
    // The fourth time derivative of the state, from the first and the input state.
    State fourth_derivative(const State& rate, const double* weights) const {
        State out = cubed_ * rate;
        for (int q = 0; q < n_basis_; ++q) add_scaled(out, weights[q], fourth_[q]);
        return out;
    }

    const Step& level(int k) {
        while (levels_ <= k) add_doubled();
        return steps_[k];
    }
    const Response* responses(int k) const { return responses_.data() + static_cast<std::size_t>(k) * n_basis_; }
    const double* rotations(int k) const { return rotations_[static_cast<std::size_t>(k)]; }

    double length(int k) const { return base_ * static_cast<double>(1ull << k); }
    // How many base intervals fit into s.
    std::uint64_t intervals(double s) const {
        auto n = static_cast<std::uint64_t>(s / base_);
        while (n > 0 && base_ * static_cast<double>(n) > s) --n;  // the quotient may have been rounded up
        return n;
    }
    // Steps stay below a sixth of the fastest input period: the doubling formula of a sine loses accuracy beyond it.
    int longest_level() const { return longest_; }
    // The highest level not longer than s (level 0 even if it is longer). Computes no level.
    int level_below(double s) const {
        const double most = length(longest_);
        return s >= most ? longest_ : std::max(0, static_cast<int>(std::bit_width(intervals(s))) - 1);
    }
    // Whether twice the level is a step within s.
    bool can_double(int k, double s) const { return k < longest_ && length(k + 1) <= s; }

    // x after the step of level k; `rate` is x' at the anchor, `weights` the input state there.
    [[gnu::always_inline]] State step(int k, const State& x, const State& rate, const double* weights) {
        const Quad free = level(k).integral * Quad::load(rate.data());
        const Response* response = responses(k);
        Quad forced{};
        for (int q = 0; q < n_basis_; ++q) forced = forced + weights[q] * Quad::load(response[q].x.data());
        State y;
        (Quad::load(x.data()) + (free + forced)).store(y.data());
        store_single(x[load_angle] + angle_step(k, rate.data(), rate[load_angle], weights), &y[load_angle]);
        return y;
    }
    // The same for x and x' at once, without a look at the rates of the regime in between. The angle's own rate is
    // that of the load speed.
    [[gnu::always_inline]] void step(int k, Quad& x, Quad& rate, double& angle, const double* weights) {
        const Step& s = level(k);
        const Response* response = responses(k);
        alignas(32) double from[Matrix::coupled];
        rate.store(from);
        angle += angle_step(k, from, turning_ * x.part[load_speed / vec_width][load_speed % vec_width], weights);
        // What the inputs bring does not wait for the step before, so it is summed up by itself.
        Quad forced{}, forced_rate{};
        for (int q = 0; q < n_basis_; ++q) {
            forced = forced + weights[q] * Quad::load(response[q].x.data());
            forced_rate = forced_rate + weights[q] * Quad::load(response[q].rate.data());
        }
        x = x + (s.integral * rate + forced);
        rate = rate + (s.change * rate + forced_rate);
    }

    // G(h) for any length: whole levels from the longest down, then the Taylor series.
    Matrix integral(double h) {
        Matrix sum;
        const auto append = [&sum](const Matrix& change, const Matrix& integral) {
            sum.add(1.0, change * sum);  // G(s + h) = G(h) + exp(A h) G(s)
            sum.add(1.0, integral);
        };
        for (int k = level_below(h); k >= 0; --k)
            for (; h >= length(k); h -= length(k)) append(level(k).change, level(k).integral);
        if (h > 0.0) {
            const Matrix rest = integral_series(h);
            append(linear_->rate * rest, rest);
        }
        return sum;
    }

    // How many terms of the Taylor series count over s: at most two base intervals, forward or backward. From rest the
    // first derivatives are zero and a later one, up to the fifth (an input, then each state in turn), comes first.
    // An even number.
    int terms(double s) const {
        const double turned = norm_ * s;
        double left = 1.0;  // bound on the relative size of what follows
        int n = 0;
        for (; (n <= n_states || left >= 1e-17) && n < Expansion::most; n += 2)
            left *= turned * turned * (reciprocal[n + 1] * reciprocal[n + 2]);
        return n;
    }
    // Fills in the derivatives of the state after the first, which is given; terms and inputs are there. By A^3, so
    // that three of them are reckoned side by side.
    void expand(const State& rate, Expansion& about) const {
        about.x[0] = rate;
        about.x[1] = linear_->higher(rate, about.u[1]);
        about.x[2] = linear_->higher(about.x[1], about.u[2]);
        for (int k = 3; k < about.terms; ++k) {
            Quad x = cubed_ * Quad::load(about.x[k - 3].data());
            for (int i = 0; i < n_inputs; ++i)
                x = x + ((about.u[k - 2][i] * Quad::load(squared_column_[i].data()) +
                          about.u[k - 1][i] * Quad::load(rate_column_[i].data())) +
                         about.u[k][i] * Quad::load(linear_->input_column[i].data()));
            x.store(about.x[k].data());
            store_single(turning_ * about.x[k - 1][load_speed], &about.x[k][load_angle]);
        }
    }
    static State series(const Expansion& about, double s, const State& x) {
        // Terms of odd and of even order, side by side.
        State sum = x, odd{};
        double power = 1.0;
        for (int k = 2; k <= about.terms; k += 2) {
            add_scaled(odd, power * s * reciprocal[k - 1], about.x[k - 2]);
            power *= s * s * (reciprocal[k - 1] * reciprocal[k]);
            add_scaled(sum, power, about.x[k - 1]);
        }
        add_scaled(sum, 1.0, odd);
        return sum;
    }
    static constexpr std::array<double, Expansion::most + 1> reciprocal = [] {
        std::array<double, Expansion::most + 1> r{};
        for (int k = 1; k <= Expansion::most; ++k) r[k] = 1.0 / k;
        return r;
    }();

 private:
    [[gnu::always_inline]] double angle_step(int k, const double* rate, double turning, const double* weights) const {
        double sum = steps_[k].integral.angle_row(rate) + steps_[k].integral.angle_own * turning;
        const Response* response = responses(k);
        for (int q = 0; q < n_basis_; ++q) sum += weights[q] * response[q].x[load_angle];
        return sum;
    }

    // x'''' = A^3 x' + A^2 B u' + A B u'' + B u''', the derivatives of the inputs written by the input state.
    void prepare_derivatives() {
        squared_ = linear_->rate * linear_->rate;
        cubed_ = linear_->rate * squared_;
        for (int i = 0; i < n_inputs; ++i) {
            rate_column_[i] = linear_->rate * linear_->input_column[i];
            squared_column_[i] = linear_->rate * rate_column_[i];
        }
        fourth_.assign(n_basis_, State{});
        for (int q = 0; q < n_basis_; ++q) {
            const InputBasis& b = basis_[q];
            const State &B = linear_->input_column[b.input], &A2B = squared_column_[b.input];
            if (b.kind == InputBasis::cosine) {  // its weight is that of the sine: u'' = -omega^2
                add_scaled(fourth_[q], -b.omega * b.omega, rate_column_[b.input]);
            } else if (b.kind == InputBasis::sine) {  // and this one's of the cosine: u' = omega, u''' = -omega^3
                add_scaled(fourth_[q], b.omega, A2B);
                add_scaled(fourth_[q], -b.omega * b.omega * b.omega, B);
            } else {
                fourth_[q] = A2B;
            }
        }
    }

    // G over at most one base interval.
    Matrix integral_series(double h) const {
        Matrix one = linear_->rate, two = squared_, three = cubed_;
        one.scale(h);
        two.scale(h * h);
        three.scale(h * h * h);
        Matrix sum = power_series<1>(one, two, three);
        sum.scale(h);
        return sum;
    }
    // sum_k B^k/(k + shift)!, from the first three powers of B; its norm is at most that of a base interval.
    template <int shift>
    static Matrix power_series(const Matrix& one, const Matrix& two, const Matrix& three) {
        static_assert(Expansion::most == 12);
        static constexpr auto coefficient = [] {
            std::array<double, 12> c{};
            double factorial = 1.0;  // of k + shift
            for (int k = 0; k < 12; ++k) {
                if (k + shift > 1) factorial *= k + shift;
                c[k] = 1.0 / factorial;
            }
            return c;
        }();
        Matrix sum;
        for (int k = 9; k >= 0; k -= 3) {
            if (k < 9) sum = three * sum;
            sum.add_diagonal(coefficient[k]);
            sum.add(coefficient[k + 1], one);
            sum.add(coefficient[k + 2], two);
        }
        return sum;
    }

    void add_base() {
        Step& s = steps_.emplace_back();
        const double h = base_;
        s.integral = integral_series(h);
        s.change = linear_->rate * s.integral;
        // |exp(A s)| from the powers of a matrix without negative entries beside its diagonal.
        Matrix positive = linear_->rate;
        positive.combine(Matrix{}, [h](double a, double) { return h * std::fabs(a); });
        for (int k = 0; k < Matrix::coupled; ++k)
            positive.column[k][k] = h * std::fmax(linear_->rate.column[k][k], 0.0);
        const Matrix twice = positive * positive;
        s.growth = power_series<0>(positive, twice, positive * twice);
        for (int q = 0; q < n_basis_; ++q) {
            const InputBasis& b = basis_[q];
            // y' = A y + b r(s), r = s, cos(omega s) - 1 or sin(omega s), by the series of r.
            State y{}, coefficient{};
            double r = b.kind == InputBasis::cosine ? -b.omega * b.omega : b.kind == InputBasis::sine ? b.omega : 1.0;
            const int first = b.kind == InputBasis::cosine ? 2 : 1;
            double power = h;
            for (int k = 0; k < Expansion::most; ++k) {
                // coefficient: k-th derivative of y at 0; the next is A times it plus b times the derivative of r.
                coefficient = linear_->rate * coefficient;
                if (k == first || (b.kind != InputBasis::ramp && k > first && (k - first) % 2 == 0)) {
                    if (k > first) r *= -b.omega * b.omega;
                    add_scaled(coefficient, r, linear_->input_column[b.input]);
                }
                add_scaled(y, power, coefficient);
                power *= h / (k + 2);
            }
            responses_.push_back({y, {}});
        }
        finish_level();
    }

    // cos(omega length) - 1 of the function q, without cancellation.
    double cosine_change(int k, int q) {
        const double half = turns_->over(exponent_ + k - 1)[q + 1];
        return -2.0 * half * half;
    }

    void add_doubled() {
        const int k = levels_ - 1;
        steps_.emplace_back();
        const Step& a = steps_[k];
        Step& b = steps_[k + 1];
        b.change = a.change * a.change;
        b.change.add(2.0, a.change);
        b.integral = a.change * a.integral;
        b.integral.add(2.0, a.integral);
        // |exp(A (h + s))| <= |exp(A s)| |exp(A h)|, of which the second is known.
        Matrix size = Matrix::diagonal(1.0);
        size.combine(a.change, [](double one, double change) { return std::fabs(one + change); });
        b.growth = a.growth * size;
        b.growth.combine(a.growth, [](double x, double y) { return std::max(x, y); });
        responses_.resize(responses_.size() + n_basis_);
        const Response* from = responses(k);
        for (int q = 0; q < n_basis_; ++q) {
            const InputBasis& basis = basis_[q];
            State y = a.change * from[q].x;
            add_scaled(y, 1.0, from[q].x);
            const State constant = a.integral * linear_->input_column[basis.input];
            if (basis.kind == InputBasis::ramp) {
                add_scaled(y, 1.0, from[q].x);
                add_scaled(y, length(k), constant);
            } else {
                const int cosine = basis.kind == InputBasis::cosine ? q : q - 1, sine = cosine + 1;
                const double c = rotations(k)[cosine], s = rotations(k)[sine];
                if (basis.kind == InputBasis::cosine) {
                    add_scaled(y, c, from[cosine].x);
                    add_scaled(y, -s, from[sine].x);
                    add_scaled(y, cosine_change(k, q), constant);
                } else {
                    add_scaled(y, s, from[cosine].x);
                    add_scaled(y, c, from[sine].x);
                    add_scaled(y, s, constant);
                }
            }
            responses_[static_cast<std::size_t>(k + 1) * n_basis_ + q].x = y;
        }
        finish_level();
    }

    // What follows from length and responses: the rotations of the inputs, and the rates.
    void finish_level() {
        const int k = levels_++;
        const double* turn = turns_->over(exponent_ + k);
        rotations_.push_back(turn);
        for (int q = 0; q < n_basis_; ++q) {
            const InputBasis& b = basis_[q];
            const double input = b.kind == InputBasis::ramp     ? length(k)
                                 : b.kind == InputBasis::cosine ? cosine_change(k, q)
                                                                : turn[q];
            Response& r = responses_[static_cast<std::size_t>(k) * n_basis_ + q];
            r.rate = linear_->rate * r.x;
            add_scaled(r.rate, input, linear_->input_column[b.input]);
        }
    }

    const LinearRates* linear_ = nullptr;
    Matrix squared_, cubed_;                                        // A^2, A^3
    std::array<State, n_inputs> rate_column_{}, squared_column_{};  // A B, A^2 B
    std::vector<State> fourth_;  // n_basis: what each contributes to the fourth derivative
    double norm_ = 0.0;          // of A in scaled units, or the highest input frequency [1/s]
    double base_ = 0.0;          // length of level 0 [s]
    int exponent_ = 0;           // of two: base / unit
    int longest_ = 0;            // level
    double turning_ = 0.0;
    int n_basis_ = 0;
    InputTurns* turns_ = nullptr;
    const InputBasis* basis_ = nullptr;
    int levels_ = 0;
    std::vector<Step> steps_;               // one a level
    std::vector<Response> responses_;       // levels x n_basis
    std::vector<const double*> rotations_;  // one a level: cos and sin of omega * length
};

}  // namespace lostmotion
