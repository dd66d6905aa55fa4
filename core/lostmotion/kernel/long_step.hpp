// Steps of any length along one regime under sines, at a cost that grows with the logarithm of the length.
//
// State and inputs together are the state z of one autonomous linear system, z' = M z:
//     z = (coupled states, load angle, 1, straight parts of the inputs, their slopes, sine and cosine of every sine).
// D(h) = exp(M h) - 1 comes from its Taylor series over h/2^n and is doubled n times, D(2h) = 2 D(h) + D(h) D(h). The
// error of what neither decays nor returns, such as a load angle or an undamped swing, doubles every time, too: in
// twice the usual precision it stays below the rounding of the result up to some 10^15 time constants.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <vector>

#include "../base/double_double.hpp"
#include "propagator.hpp"

namespace lostmotion {

template <class D>
class LongStep {
 public:
    using State = StateOf<D>;
    using Column = ColumnOf<D>;
    using Lanes = LanesOf<D>;
    using Propagator = lostmotion::Propagator<D>;
    using InputState = lostmotion::InputState<D>;

    // Whether a stretch is so long that it pays to take it at once.
    static bool pays(const Propagator& p, double stretch) { return stretch > p.long_stretch(); }

    // constant: the part of x' that depends on neither state nor inputs. inputs: any state of the same signals.
    LongStep(const Propagator& p, const Column& constant, const InputState& inputs, double length)
        : LongStep(p, constant, inputs, length, doublings(p, length)) {
        for (int n = doublings(p, length); n > 0; --n) twice();
    }
    // The same before its doublings.
    LongStep(const Propagator& p, const Column& constant, const InputState& inputs, double length, int doublings)
        : rates_(p.rates()),
          n_coupled(static_cast<std::size_t>(rates_.n.coupled)),
          n_angles(static_cast<std::size_t>(rates_.n.angles)),
          n_inputs(static_cast<std::size_t>(rates_.n.inputs)),
          constant_(constant),
          h_(std::ldexp(length, -doublings)) {
        for (int q = 0; q < inputs.sines(); ++q)
            sines_.push_back(
                {static_cast<std::size_t>(inputs.basis(2 * q).input), two_pi * inputs.frequency(q), 0.0, 0.0});
        begin();
    }
    static int doublings(const Propagator& p, double length) {
        int n = 0;
        for (; length > 0.25 * p.length(0); length *= 0.5) ++n;
        return n;
    }

    double length() const { return h_; }
    std::size_t size() const { return sine + 2 * sines_.size(); }

    // The state one length later.
    State operator()(const State& x, const InputState& inputs) {
        gather(x, inputs, z_);
        advance(z_.data());
        State out;
        for (std::size_t k = 0; k < n_states; ++k) out[place(k)] = z_[k];
        return out;
    }
    void gather(const State& x, const InputState& inputs, std::vector<double>& z) const {
        z.resize(size());
        for (std::size_t k = 0; k < n_states; ++k) z[k] = x[place(k)];
        z[unit] = 1.0;
        for (std::size_t i = 0; i < n_inputs; ++i) {
            z[line + i] = inputs.linear()[i];
            z[slope + i] = inputs.slope()[i];
        }
        std::copy_n(inputs.weights(), 2 * sines_.size(), z.data() + sine);
    }
    void advance(double* z) const {
        Lanes change{};
        for (std::size_t j = 0; j < size(); ++j) change = change + z[j] * load(rounded_[j]);
        State changed;
        change.store(changed);
        for (std::size_t k = 0; k < n_states; ++k) z[k] += changed[place(k)];
        for (std::size_t i = 0; i < n_inputs; ++i) z[line + i] += h_ * z[slope + i];
        for (std::size_t q = 0; q < sines_.size(); ++q) {
            const auto now = Pack<2>::load(z + sine + 2 * q);
            (now + PhaseRotation{sines_[q].cosine_change.high, sines_[q].sin.high} * now).store(z + sine + 2 * q);
        }
    }

    // Doubles the length.
    void twice() {
        doubled_ = change_;
        for (std::size_t j = 0; j < size(); ++j)
            for (std::size_t r = 0; r < n_states; ++r) {
                DoubleDouble& d = doubled_[j][r];
                d += d;
                for (std::size_t k = 0; k < n_coupled; ++k) d += change_[k][r] * change_[j][k];
            }
        for (std::size_t r = 0; r < n_states; ++r) {
            for (std::size_t i = 0; i < n_inputs; ++i) doubled_[slope + i][r] += h_ * change_[line + i][r];
            for (std::size_t q = 0; q < sines_.size(); ++q) {
                const DoubleDouble &s = change_[sine + 2 * q][r], &c = change_[sine + 2 * q + 1][r];
                doubled_[sine + 2 * q][r] += sines_[q].cosine_change * s + -sines_[q].sin * c;
                doubled_[sine + 2 * q + 1][r] += sines_[q].cosine_change * c + sines_[q].sin * s;
            }
        }
        change_.swap(doubled_);
        round();
        for (RotatingSine& t : sines_) {
            const DoubleDouble c = t.cosine_change, s = t.sin;
            t.cosine_change = 2.0 * c + (c * c + -s * s);
            t.sin = 2.0 * (s + c * s);
        }
        h_ *= 2.0;
    }

    // The next term of the Taylor series of z over one length, from the k-th term before it: h M z/(k + 1).
    template <class Number>
    std::vector<Number> next_term(const std::vector<Number>& z, int k) const {
        const auto scaled = [&](const Number& rate) { return rate * h_ / (k + 1.0); };
        std::vector<Number> out(size()), u(n_inputs);
        for (std::size_t i = 0; i < n_inputs; ++i) {
            u[i] = z[line + i];
            out[line + i] = scaled(z[slope + i]);
        }
        for (std::size_t q = 0; q < sines_.size(); ++q) {
            const Number &s = z[sine + 2 * q], &c = z[sine + 2 * q + 1], omega = static_cast<Number>(sines_[q].omega);
            u[sines_[q].input] += s;
            out[sine + 2 * q] = scaled(omega * c);
            out[sine + 2 * q + 1] = scaled(-omega * s);
        }
        for (std::size_t r = 0; r < n_coupled; ++r) {
            if (ties_[r].factor != 0.0) {
                out[r] = ties_[r].factor * out[ties_[r].to];
                continue;
            }
            Number rate = constant_[r] * z[unit];
            for (std::size_t i = 0; i < n_inputs; ++i) rate += rates_.input_column[i][r] * u[i];
            rates_.each_in_row(static_cast<int>(r),
                               [&](int c, double factor) { rate += factor * z[static_cast<std::size_t>(c)]; });
            out[r] = scaled(rate);
        }
        for (std::size_t j = 0; j < n_angles; ++j)
            out[n_coupled + j] = scaled(rates_.angle_coefficient[j] * z[rates_.angle_speed[static_cast<int>(j)]]);
        return out;
    }

    // A form of state and inputs as coefficients of z.
    template <int N>
    std::vector<double> coefficients(const FormTable<D, N>& forms, int row, double constant) const {
        std::vector<double> c(size());
        for (std::size_t k = 0; k < n_coupled; ++k) c[k] = forms.of_coupled(row, static_cast<int>(k));
        c[unit] = constant;
        for (std::size_t i = 0; i < n_inputs; ++i) c[line + i] = forms.of_input(row, static_cast<int>(i));
        for (std::size_t q = 0; q < sines_.size(); ++q) c[sine + 2 * q] = c[line + sines_[q].input];
        return c;
    }

 private:
    static constexpr int terms = 24;  // 16^-24/24! < 1e-52

    struct RotatingSine {
        std::size_t input;
        DoubleDouble omega;               // [rad/s]
        DoubleDouble cosine_change, sin;  // over the length
    };

    // A rate that is a multiple of another: speeds that a gear without play makes one must not drift apart by the
    // rounding of their coefficients.
    struct Tie {
        std::size_t to = 0;
        double factor = 0.0;  // 0: there is none
    };

    void tie() {
        const auto row = [this](std::size_t r) {
            std::vector<double> c(n_coupled + n_inputs + 1);
            rates_.each_in_row(static_cast<int>(r),
                               [&](int k, double factor) { c[static_cast<std::size_t>(k)] = factor; });
            for (std::size_t i = 0; i < n_inputs; ++i) c[n_coupled + i] = rates_.input_column[i][r];
            c.back() = constant_[r];
            return c;
        };
        for (std::size_t r = 1; r < n_coupled; ++r)
            for (std::size_t to = 0; to < r && ties_[r].factor == 0.0; ++to) {
                const auto a = row(to), b = row(r);
                std::size_t pivot = 0;
                while (pivot < a.size() && a[pivot] == 0.0) ++pivot;
                if (pivot == a.size()) continue;
                const double factor = b[pivot] / a[pivot];
                bool same = true;
                for (std::size_t k = 0; k < a.size(); ++k)
                    same = same && std::fabs(b[k] - factor * a[k]) <= 0x1p-50 * std::fabs(b[k]);
                if (same) ties_[r] = {to, factor};
            }
    }
    void round() {
        for (std::size_t j = 0; j < size(); ++j)
            for (std::size_t r = 0; r < n_states; ++r) rounded_[j][place(r)] = change_[j][r].high;
    }
    void begin() {
        make_room(ties_, rates_.n.coupled);
        tie();
        change_.resize(size());
        for (auto& c : change_) make_room(c, static_cast<int>(n_states));
        rounded_.resize(size());
        std::vector<DoubleDouble> z;
        for (std::size_t j = 0; j < size(); ++j) {
            z.assign(size(), {});
            z[j] = 1.0;
            for (int k = 0; k < terms; ++k) {
                z = next_term(z, k);
                for (std::size_t r = 0; r < n_states; ++r) change_[j][r] += z[r];
                if (j > sine && (j - sine) % 2 == 1) {  // of a cosine
                    RotatingSine& t = sines_[(j - sine) / 2];
                    t.sin += z[j - 1];
                    t.cosine_change += z[j];
                }
            }
        }
        round();
    }

    // Of what in z is a state, its place.
    int place(std::size_t k) const {
        return static_cast<int>(k < n_coupled ? k : static_cast<std::size_t>(D::coupled) + k - n_coupled);
    }

    LinearRatesOf<D> rates_;
    const std::size_t n_coupled, n_angles, n_inputs;

 public:
    // The places in z.
    const std::size_t n_states = n_coupled + n_angles, unit = n_states, line = unit + 1, slope = line + n_inputs,
                      sine = slope + n_inputs;

 private:
    Column constant_;
    ArrayOf<D, Tie, D::coupled> ties_{};
    double h_;
    std::vector<RotatingSine> sines_;
    std::vector<ArrayOf<D, DoubleDouble, D::states>> change_, doubled_;  // D(h), column by column
    std::vector<State> rounded_;
    std::vector<double> z_;
};

// The integral of z z^T over a stretch: all that energies need, products of two forms.
template <class D>
class LongProducts {
 public:
    using LongStep = lostmotion::LongStep<D>;
    using State = typename LongStep::State;
    using Column = typename LongStep::Column;
    using Propagator = typename LongStep::Propagator;
    using InputState = typename LongStep::InputState;

    LongProducts(const Propagator& p, const Column& constant, const State& x, const InputState& inputs, double length)
        : step_(p, constant, inputs, length, LongStep::doublings(p, length)), size_(step_.size()) {
        begin(x, inputs);
        for (int n = LongStep::doublings(p, length); n > 0; --n) {
            // What follows is the same of the state one length later.
            std::vector<double> later = sum_;
            for (int side = 0; side < 2; ++side) {
                for (std::size_t r = 0; r < size_; ++r) step_.advance(&later[r * size_]);
                for (std::size_t r = 0; r < size_; ++r)
                    for (std::size_t c = 0; c < r; ++c) std::swap(later[r * size_ + c], later[c * size_ + r]);
            }
            for (std::size_t k = 0; k < later.size(); ++k) sum_[k] += later[k];
            step_.twice();
        }
    }

    const LongStep& step() const { return step_; }
    // Of two forms, given as coefficients of z.
    double operator()(const std::vector<double>& a, const std::vector<double>& b) const {
        double sum = 0.0;
        for (std::size_t r = 0; r < size_; ++r) {
            if (a[r] == 0.0) continue;
            double row = 0.0;
            for (std::size_t c = 0; c < size_; ++c) row += sum_[r * size_ + c] * b[c];
            sum += a[r] * row;
        }
        return sum;
    }

 private:
    static constexpr int terms = 12;  // 16^-12/12! < 1e-23

    void begin(const State& x, const InputState& inputs) {
        std::array<std::vector<double>, terms> z;
        step_.gather(x, inputs, z[0]);
        for (int k = 1; k < terms; ++k) z[k] = step_.next_term(z[k - 1], k - 1);
        sum_.resize(size_ * size_);
        for (std::size_t r = 0; r < size_; ++r)
            for (int j = 0; j < terms; ++j)
                for (int k = 0; k < terms; ++k) {
                    const double factor = step_.length() / (j + k + 1.0) * z[j][r];
                    for (std::size_t c = 0; c < size_; ++c) sum_[r * size_ + c] += factor * z[k][c];
                }
    }

    LongStep step_;
    std::size_t size_;
    std::vector<double> sum_;
};

}  // namespace lostmotion
