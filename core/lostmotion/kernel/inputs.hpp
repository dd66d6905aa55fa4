// Commands and disturbances as the outputs of linear systems.
#pragma once

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <numbers>
#include <utility>
#include <vector>

#include "../base/signal.hpp"
#include "form.hpp"

namespace lostmotion {

template <class D>
using SignalsOf = ArrayOf<D, Signal, D::inputs>;

// The same without what is always zero: a sine of no amplitude does not make an input vary.
template <class Signals>
Signals without_idle_sines(Signals signals) {
    for (Signal& s : signals) std::erase_if(s.sines, [](const Sine& sine) { return sine.amplitude == 0.0; });
    return signals;
}

// The first breakpoint of any input after t.
template <class Signals>
double next_breakpoint(const Signals& signals, double t) {
    double next = std::numeric_limits<double>::infinity();
    for (const Signal& s : signals) next = std::min(next, s.next_breakpoint(t));
    return next;
}

// Inputs of which the first will be set to ramps from outside, step by step; the sines are added to them.
template <class D>
SignalsOf<D> ramped_inputs(int count = D::inputs, const InputSines& sines = {}) {
    SignalsOf<D> signals;
    make_room(signals, std::max(count, 1));
    for (int i = 0; i < count; ++i) signals[i].breakpoints[0].slope = 1.0;
    for (const auto& [input, sine] : sines) signals[static_cast<std::size_t>(input)].sines.push_back(sine);
    return signals;
}

// One function of time by which an input departs from its value at an anchor instant:
// cos(omega s) - 1, sin(omega s), or a ramp (omega = 0).
struct InputBasis {
    enum Kind { cosine, sine, ramp, nothing } kind;
    int input;
    double omega;  // [rad/s]

    // Its k-th time derivative at the anchor instant, k > 0.
    double derivative(int k) const {
        if (kind == nothing) return 0.0;
        if (kind == ramp) return k == 1 ? 1.0 : 0.0;
        if ((kind == cosine) != (k % 2 == 0)) return 0.0;
        double d = k % 2 == 0 ? 1.0 : omega;
        for (int n = 2; n <= k; n += 2) d *= -omega * omega;
        return d;
    }

    friend bool operator==(const InputBasis&, const InputBasis&) = default;
};

// In pairs: cosine and sine of each sine of the signals, those of the first input first, then the ramps. At least one
// pair, and if need be with nothing in the last places.
template <class Signals>
std::vector<InputBasis> input_basis(const Signals& signals) {
    const int n_inputs = static_cast<int>(signals.size());
    std::vector<InputBasis> basis;
    for (int i = 0; i < n_inputs; ++i)
        for (const Sine& s : signals[i].sines) {
            const double omega = 2.0 * std::numbers::pi * s.frequency;
            basis.push_back({InputBasis::cosine, i, omega});
            basis.push_back({InputBasis::sine, i, omega});
        }
    for (int i = 0; i < n_inputs; ++i) {
        bool slopes = false;
        for (const Breakpoint& k : signals[i].breakpoints) slopes |= k.slope != 0.0;
        if (slopes) basis.push_back({InputBasis::ramp, i, 0.0});
    }
    while (basis.empty() || basis.size() % 2 != 0) basis.push_back({InputBasis::nothing, 0, 0.0});
    return basis;
}

// Rotation of a pair of functions over a length of time: cos and sin of the angle (of a ramp, 1 and 0).
struct PhaseRotation {
    double cos, sin;

    // A sine and a cosine, turned.
    [[gnu::always_inline]] Pack<2> operator*(const Pack<2>& sine_cosine) const {
        return cos * sine_cosine + Pack<2>::of({sin, -sin}) * sine_cosine.swapped();
    }
};

// By how much the functions of a basis turn over lengths of time that are a unit times a power of two. What several
// regimes ask for is computed once.
class PhaseRotations {
 public:
    PhaseRotations(double unit, std::vector<InputBasis> basis) : unit_(unit), basis_(std::move(basis)) {}

    double unit() const { return unit_; }  // [s]
    const std::vector<InputBasis>& basis() const { return basis_; }
    double fastest() const {  // [rad/s]
        double omega = 0.0;
        for (const InputBasis& b : basis_) omega = std::fmax(omega, b.omega);
        return omega;
    }
    // For each pair; h = unit * 2^exponent.
    const PhaseRotation* over(int exponent) {
        assert(std::abs(exponent) <= reach);
        std::vector<PhaseRotation>& turn = rotations_[static_cast<std::size_t>(exponent + reach)];
        if (turn.empty()) {
            const double h = std::ldexp(unit_, exponent);
            for (std::size_t q = 0; q < basis_.size(); q += 2) {
                const auto [sine, cosine] = sine_cosine(basis_[q].omega * h);
                turn.push_back({cosine, sine});
            }
        }
        return turn.data();
    }

 private:
    static constexpr int reach = 200;

    double unit_;
    std::vector<InputBasis> basis_;
    std::array<std::vector<PhaseRotation>, 2 * reach + 1> rotations_;
};

// The inputs at one instant, as the state of the linear system that generates them.
template <class D>
class InputState {
 public:
    using Inputs = InputsOf<D>;
    using Signals = SignalsOf<D>;

    InputState(const Signals& signals, const std::vector<InputBasis>& basis)
        : signals_(&signals), basis_(basis.data()), size_(static_cast<int>(basis.size())) {
        make_room();
        int end = 0;
        for (int i = 0; i < n_inputs(); ++i) sines_end_[i] = end += 2 * static_cast<int>(signals[i].sines.size());
        anchor(0.0);
    }
    InputState(const InputState& o) : signals_(o.signals_), basis_(o.basis_), size_(o.size_), sines_end_(o.sines_end_) {
        make_room();
        *this = o;
    }
    // Of another with the same signals.
    InputState& operator=(const InputState& o) {
        time_ = o.time_;
        breakpoint_ = o.breakpoint_;
        linear_ = o.linear_;
        slope_ = o.slope_;
        for (int q = 0; q < size_; q += 2) pair_of(o, q).store(weights_ + q);
        return *this;
    }

    // Sets all from absolute time, so that no phase error accumulates however long the run. At a breakpoint: the right
    // limit.
    void anchor(double t) {
        for (int i = 0; i < n_inputs(); ++i) breakpoint_[i] = &(*signals_)[i].breakpoints[(*signals_)[i].segment(t)];
        follow(t);
    }
    // The same, the left limit.
    void anchor_left(double t) {
        for (int i = 0; i < n_inputs(); ++i) {
            const Signal& s = (*signals_)[i];
            std::size_t k = s.segment(t);
            while (k > 0 && s.breakpoints[k].time >= t) --k;
            breakpoint_[i] = &s.breakpoints[k];
        }
        follow(t);
    }
    // The same, on the stretches between breakpoints that were last anchored to, also at their far end.
    void follow(double t) {
        time_ = t;
        for (int i = 0; i < n_inputs(); ++i) {
            const Breakpoint& k = *breakpoint_[i];
            linear_[i] = k.value + k.slope * (t - k.time);
            slope_[i] = k.slope;
        }
        int q = 0;
        for (int i = 0; i < n_inputs(); ++i)
            for (const Sine& s : (*signals_)[i].sines) {
                const auto [sine, cosine] = sine_cosine(s.angle(t));
                weights_[q++] = s.amplitude * sine;
                weights_[q++] = s.amplitude * cosine;
            }
        for (; q < size_ && basis_[q].kind == InputBasis::ramp; ++q) weights_[q] = slope_[basis_[q].input];
    }

    double time() const { return time_; }
    int size() const { return size_; }
    // How many sines there are, those of the first input first, and the frequency [Hz] of one.
    int sines() const { return sines_end_[n_inputs() - 1] / 2; }
    double frequency(int k) const {
        const int i = basis_[2 * k].input, before = i == 0 ? 0 : sines_end_[i - 1] / 2;
        return (*signals_)[i].sines[static_cast<std::size_t>(k - before)].frequency;
    }
    const InputBasis& basis(int q) const { return basis_[q]; }
    const double* weights() const { return weights_; }

    Inputs values() const {
        Inputs out{};
        values(n_inputs(), out);
        return out;
    }
    // Of the first n alone.
    [[gnu::always_inline]] void values(int n, Inputs& out) const {
        sum(n, linear_, [this](int q) { return weights_[q]; }, out);
    }
    [[gnu::always_inline]] void rates(int n, Inputs& out) const {
        sum(n, slope_, [this](int q) { return basis_[q].omega * weights_[q + 1]; }, out);
    }
    // The first three derivatives of one.
    [[gnu::always_inline]] std::array<double, 3> derivatives(int i) const {
        double first = slope_[i], second = 0.0, third = 0.0;
        for (int q = i == 0 ? 0 : sines_end_[i - 1]; q < sines_end_[i]; q += 2) {
            const double omega = basis_[q].omega, turned_twice = -omega * omega, odd = omega * weights_[q + 1];
            first += odd;
            second += weights_[q] * turned_twice;
            third += odd * turned_twice;
        }
        return {first, second, third};
    }

    // The derivatives of one up to the order n, from the first on.
    void derivatives(int i, int n, double* out) const {
        for (int k = 1; k <= n; ++k) out[k] = k == 1 ? slope_[i] : 0.0;
        for (int q = i == 0 ? 0 : sines_end_[i - 1]; q < sines_end_[i]; q += 2) {
            const double omega = basis_[q].omega, turned_twice = -omega * omega;
            double even = weights_[q] * turned_twice, odd = omega * weights_[q + 1];
            for (int k = 1; k <= n; k += 2) {
                out[k] += odd;
                odd *= turned_twice;
                if (k + 1 <= n) out[k + 1] += even;
                even *= turned_twice;
            }
        }
    }

    // A given speed at an instant of the present stretch, from absolute time, so that no error accumulates. Between
    // breakpoints it is the integral of its rate, which runs in a straight line; the sines of both belong together.
    double given_at(const GivenSpeed& given, double t) const {
        const Breakpoint &speed = *breakpoint_[given.speed], &rate = *breakpoint_[given.acceleration];
        const double s = t - speed.time;
        double value = rate.time == speed.time ? speed.value + s * (rate.value + 0.5 * s * rate.slope)
                                               : speed.value + s * speed.slope;
        for (const Sine& sine : (*signals_)[given.speed].sines) value += sine.at(t);
        return given.share * value;
    }
    double given_at(const GivenState& given, double t) const {
        double value = 0.0;
        for (const GivenSpeed& g : given.shares) value += given_at(g, t);
        return value;
    }

    // Sums of the magnitudes of the parts: what the rounding of the values is relative to.
    Inputs magnitudes() const {
        Inputs out{};
        sum(
            n_inputs(), lostmotion::magnitudes(linear_),
            [this](int q) { return std::fabs(weights_[q]) + std::fabs(weights_[q + 1]); }, out);
        return out;
    }
    const Inputs& slope() const { return slope_; }
    // The piecewise-linear parts alone.
    const Inputs& linear() const { return linear_; }

    // Value and derivatives up to order N - 1.
    template <int N = n_derivatives>
    std::array<Inputs, N> jet() const {
        std::array<Inputs, N> u;
        jet<N>(u.data());
        return u;
    }
    template <int N>
    void jet(Inputs* u) const {
        u[0] = linear_;
        if constexpr (N > 1) u[1] = slope_;
        for (int k = 2; k < N; ++k) clear(u[k], n_inputs());
        for (int q = 0; q < sines_end_[n_inputs() - 1]; q += 2) {
            const int i = basis_[q].input;
            const double omega = basis_[q].omega, turned_twice = -omega * omega;
            double even = weights_[q], odd = omega * weights_[q + 1];
            for (int k = 0; k < N; k += 2) {
                u[k][i] += even;
                even *= turned_twice;
                if (k + 1 < N) u[k + 1][i] += odd;
                odd *= turned_twice;
            }
        }
    }

    // Whether an input is other than constant.
    bool varies(int i) const { return slope_[i] != 0.0 || sines_end_[i] > (i == 0 ? 0 : sines_end_[i - 1]); }

    bool constant() const {
        for (int i = 0; i < n_inputs(); ++i)
            if (varies(i)) return false;
        return true;
    }

    // Bound on the fourth derivative of each input for all time.
    Inputs fourth_derivative_bound() const {
        Inputs bound{};
        for (int i = 0; i < n_inputs(); ++i)
            for (const Sine& s : (*signals_)[i].sines) {
                const double omega = 2.0 * std::numbers::pi * s.frequency;
                bound[i] += std::fabs(s.amplitude) * omega * omega * omega * omega;
            }
        return bound;
    }
    // The first instant from now on at which an input no longer goes this way, before `limit` and the next breakpoint;
    // else, or if it is interrupted, `limit`. From slope v and curvature a follows v + a s - B s^2/2 <= its slope after
    // s, where B bounds the third derivative, so that none is stepped over. Where the slope only touches zero, v and a
    // vanish together, and with them the step: there a slope above -`least`, its rounding, goes on.
    template <class Interruption>
    double turning(int i, double way, double limit, Interruption& interruption) const {
        double B = 0.0, least = std::fabs(slope_[i]);
        for (const Sine& s : (*signals_)[i].sines) {
            const double omega = 2.0 * std::numbers::pi * s.frequency;
            B += std::fabs(s.amplitude) * omega * omega * omega;
            least += std::fabs(s.amplitude) * omega;
        }
        if (B == 0.0) return limit;
        least *= 4.0 * std::numeric_limits<double>::epsilon();
        for (InputState at = *this; at.time_ < limit && !interruption();) {
            const auto u = at.jet<3>();
            const double v = way * u[1][i], a = way * u[2][i];
            if (v < 0.0) return at.time_;
            double safe = at.time_ + (a + std::sqrt(a * a + 2.0 * B * v)) / B;
            if (v <= least && a * a <= 4.0 * B * least)
                safe = std::fmax(safe, at.time_ + (a + std::sqrt(a * a + 2.0 * B * least)) / B);
            at.follow(std::fmax(safe, std::nextafter(at.time_, limit)));
        }
        return limit;
    }

    // Moves on by h, for once; sines and cosines of small angles from their series.
    void rotate(double h) {
        time_ += h;
        add_slopes(*this, h);
        for (int q = 0; q < sines_end_[n_inputs() - 1]; q += 2) {
            const double a = basis_[q].omega * h, a2 = a * a;
            const auto [sine, cosine] =
                a2 < 1e-6 ? SineCosine{a * (1.0 - a2 / 6.0 * (1.0 - a2 / 20.0)), 1.0 - a2 / 2.0 * (1.0 - a2 / 12.0)}
                          : sine_cosine(a);
            (PhaseRotation{cosine, sine} * pair_of(*this, q)).store(weights_ + q);
        }
    }

    // Moves on by h, by which the pairs turn as given.
    [[gnu::always_inline]] void advance(double h, const PhaseRotation* rotations) { advance_from(*this, h, rotations); }
    // To h beyond where another with the same signals is, on the same stretch between breakpoints.
    [[gnu::always_inline]] void advance_from(const InputState& from, double h, const PhaseRotation* rotations) {
        time_ = from.time_ + h;
        breakpoint_ = from.breakpoint_;
        slope_ = from.slope_;
        add_slopes(from, h);
        for (int q = 0; q < size_; q += 2) (*rotations++ * pair_of(from, q)).store(weights_ + q);
    }

 private:
    void make_room() {
        if (size_ > static_cast<int>(few_.size())) many_.resize(static_cast<std::size_t>(size_));
        weights_ = many_.empty() ? few_.data() : many_.data();
    }
    // The linear parts h after `from`, in the vectors in which they are copied: a processor waits long for a vector of
    // what has just been written number by number.
    [[gnu::always_inline]] void add_slopes(const InputState& from, double h) {
        if constexpr (std::same_as<D, Any>) {
            linear_ = from.linear_ + h * slope_;
        } else {
            constexpr int n = D::inputs, width = vec_width < n ? vec_width : n, whole = n / width * width;
            const auto add = [&]<int count>(std::integral_constant<int, count>, int i) ALWAYS_INLINE {
                (Pack<count>::load(&from.linear_[i]) + h * Pack<count>::load(&slope_[i])).store(&linear_[i]);
            };
            for (int i = 0; i < whole; i += width) add(std::integral_constant<int, width>{}, i);
            if constexpr (whole < n) add(std::integral_constant<int, n - whole>{}, whole);
        }
    }
    static Pack<2> pair_of(const InputState& s, int q) { return Pack<2>::load(s.weights_ + q); }
    // For each of the first n inputs, what it begins with and the terms of its sines. Number by number, and nothing is
    // copied: see add_slopes().
    template <class Term>
    [[gnu::always_inline]] void sum([[maybe_unused]] int n, const Inputs& begin, Term&& term, Inputs& out) const {
        if constexpr (D::inputs > 2) {  // of many inputs few have a sine
            if constexpr (std::same_as<D, Any>)
                out = begin;
            else
                for (int i = 0; i < n; ++i) out[i] = begin[i];
            for (int q = 0; q < sines_end_[n - 1]; q += 2) out[basis_[q].input] += term(q);
        } else {
            int q = 0;
            const auto add = [&](std::size_t i) ALWAYS_INLINE {
                double sum = begin[i];
                for (; q < sines_end_[i]; q += 2) sum += term(q);
                out[i] = sum;
            };
            [&]<std::size_t... i>(std::index_sequence<i...>)
                ALWAYS_INLINE { (add(i), ...); }(std::make_index_sequence<D::inputs>{});
        }
    }

    int n_inputs() const {
        if constexpr (std::same_as<D, Any>)
            return static_cast<int>(signals_->size());
        else
            return D::inputs;
    }

    const Signals* signals_;
    const InputBasis* basis_;
    int size_;
    ListOf<D, int, D::inputs> sines_end_{};  // of each input
    double time_ = 0.0;
    ListOf<D, const Breakpoint*, D::inputs> breakpoint_{};
    Inputs linear_{}, slope_{};
    double* weights_;  // of cosine: a sin(psi); sine: a cos(psi); ramp: slope
    std::array<double, 4> few_{};
    std::vector<double> many_;  // instead, if they do not fit
};

}  // namespace lostmotion
