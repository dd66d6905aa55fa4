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
#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <type_traits>
#include <variant>
#include <vector>

#include "series.hpp"
#include "taylor.hpp"

namespace lostmotion {

// Everything needed to step by one length h in one regime.
template <class D>
struct StepOf {
    static constexpr bool any = std::same_as<D, Any>;
    using Matrix = std::conditional_t<any, MatrixAt, MatrixOf<D>>;
    using Integral = std::conditional_t<any, IntegralOf<D, MatrixAt, NumbersRows>, IntegralOf<D>>;

    Integral integral;         // G(h)
    Matrix exponential_bound;  // bound on |exp(A s)|, element by element, for 0 <= s <= h; 1e200 if it is no less
    Matrix change;             // E(h) = exp(A h) - 1
};

// What a pair of functions of the inputs brings over one length: changes of x, of its angles and of x'.
template <class D>
struct ResponseOf {
    static constexpr bool any = std::same_as<D, Any>;

    std::conditional_t<any, NumbersRows, std::array<ColumnOf<D>, 2>> change;
    std::conditional_t<any, NumbersRows, std::array<AnglesOf<D>, 2>> angle;
    std::conditional_t<any, NumbersRows, std::array<ColumnOf<D>, 2>> rate;

    [[gnu::always_inline]] auto of(int c) const {
        if constexpr (any)
            return LanesIn{load(change[c]), load(angle[c])};
        else
            return LanesOf<D>{load(change[c]), angle[c]};
    }
    void set(int c, const LanesOf<D>& x) {
        store<D>(x.coupled, change[c]);
        angle[c] = x.angle;
    }
    // From the weights of the pair.
    [[gnu::always_inline]] auto operator*(const double* weights) const {
        return weights[0] * of(0) + weights[1] * of(1);
    }
    [[gnu::always_inline]] auto rates(const double* weights) const {
        return weights[0] * load(rate[0]) + weights[1] * load(rate[1]);
    }
};

// The steps of all levels, each with its responses, in one block. What an earlier use has left there is written over.
inline constexpr std::size_t usual_levels = 12;
template <class D>
class LevelsOf {
 public:
    void reach(std::size_t levels, const CountsOf<D>&, int pairs) {
        const std::size_t stride = (sizeof(StepOf<D>) + static_cast<std::size_t>(pairs) * sizeof(ResponseOf<D>)) / unit;
        if (stride != stride_) made_ = 0;
        stride_ = stride;
        if (levels <= made_) return;
        if (levels * stride > room_) {
            room_ = std::max(2 * made_, usual_levels) * stride;
            std::unique_ptr<Unit[]> grown = std::make_unique_for_overwrite<Unit[]>(room_);
            std::copy_n(block_.get(), made_ * stride, grown.get());
            block_ = std::move(grown);
        }
        std::fill(block_.get() + made_ * stride, block_.get() + levels * stride, Unit{});
        made_ = levels;
    }
    StepOf<D>& step(int k, double) { return *reinterpret_cast<StepOf<D>*>(level(k)); }
    ResponseOf<D>* responses(int k) { return reinterpret_cast<ResponseOf<D>*>(level(k) + sizeof(StepOf<D>) / unit); }

 private:
    static constexpr std::size_t unit = alignof(StepOf<D>);
    static_assert(sizeof(ResponseOf<D>) % unit == 0 && unit % alignof(ResponseOf<D>) == 0);
    static_assert(std::is_trivially_copyable_v<StepOf<D>> && std::is_trivially_copyable_v<ResponseOf<D>>);
    struct alignas(unit) Unit {
        std::byte bytes[unit];
    };

    Unit* level(int k) { return block_.get() + static_cast<std::size_t>(k) * stride_; }

    std::size_t stride_ = 0, made_ = 0, room_ = 0;  // units of a level, levels, units
    std::unique_ptr<Unit[]> block_;
};
// The same of a train of any size: level by level in one block.
template <>
class LevelsOf<Any> {
 public:
    struct Responses {
        double* at;
        int n, angles;
        ResponseOf<Any> operator[](int pair) const {
            double* const of = at + pair * (4 * n + 2 * angles);
            return {{of, n}, {of + 4 * n, angles}, {of + 2 * n, n}};
        }
    };
    void reach(std::size_t levels, const CountsOf<Any>& n, int pairs) {
        n_ = n;
        angles_ = (n.angles + 3) / 4 * 4;
        responses_ = pairs * (4 * n.coupled + 2 * angles_);
        stride_ = responses_ + n.coupled * (3 * n.coupled + n.angles);
        const std::size_t fours = static_cast<std::size_t>(stride_) / 4;
        if (block_.empty()) block_.reserve(usual_levels * fours);
        if (block_.size() < levels * fours) block_.resize(levels * fours);
    }
    std::size_t bytes() const { return block_.size() * sizeof(FourInRow); }
    StepOf<Any> step(int k, double length) {
        const int n = n_.coupled;
        double *const integral = level(k) + responses_, *const rows = integral + n * n,
                      *const bound = rows + n * n_.angles, *const change = bound + n * n;
        return {{{integral, n}, {rows, n}, length, n_}, {bound, n}, {change, n}};
    }
    Responses responses(int k) { return {level(k), n_.coupled, angles_}; }

 private:
    double* level(int k) { return block_.data()->number + static_cast<std::ptrdiff_t>(k) * stride_; }

    CountsOf<Any> n_;
    int angles_ = 0, responses_ = 0, stride_ = 0;
    std::vector<FourInRow> block_;
};

// Doubling level k, for short level: the step of 2^k base intervals, made from two of level k - 1.
template <class D>
class Propagator {
 public:
    using Coupled = CoupledOf<D>;
    using Column = ColumnOf<D>;
    using State = StateOf<D>;
    using Lanes = LanesOf<D>;
    using Matrix = MatrixOf<D>;
    using LinearRates = LinearRatesOf<D>;
    using Integral = IntegralOf<D>;

    static constexpr int max_levels = 40;
    static constexpr double unbounded = 1e200;  // exponential_bound from here on is no longer computed
    static constexpr double max_norm = 1e18;    // |A| [1/s] of which time can be resolved
    static constexpr double base_norm = 0.25;   // |A| h of the base interval, in scaled units

    // rotations: its unit is a length of which some power-of-two multiple or fraction is the base interval.
    // scale: natural magnitudes of the states; only for choosing the base interval.
    // rates and rotations must outlive this.
    void prepare(const LinearRates& rates, PhaseRotations& rotations, const State& scale) {
        rotations_ = &rotations;
        n_pairs_ = static_cast<int>(rotations.basis().size() / 2);
        const double fastest = rotations.fastest();
        double norm = fastest;  // of A in scaled units, or the highest input frequency [1/s]
        resolved_ = true;
        for (int r = 0; r < rates.n.coupled; ++r) {
            double sum = 0.0;
            rates.each_in_row(r,
                              [&](int c, double rate) ALWAYS_INLINE { sum += std::fabs(rate) * scale[c] / scale[r]; });
            norm = std::fmax(norm, sum);
            resolved_ = resolved_ && sum < max_norm;  // nor is it if that is no number
        }
        for (int j = 0; j < rates.n.angles; ++j)
            norm = std::fmax(
                norm, std::fabs(rates.angle_coefficient[j]) * scale[rates.angle_speed[j]] / scale[D::coupled + j]);
        if (!resolved_) norm = fastest;
        base_ = rotations.unit();
        exponent_ = 0;
        for (; norm * base_ > base_norm; base_ *= 0.5) --exponent_;
        per_first_ = 0.5 / base_;
        longest_ = 0;
        while (longest_ + 1 < max_levels && fastest * length(longest_ + 1) <= 1.0) ++longest_;
        long_stretch_ = 16384.0 * length(longest_);
        levels_ = 0;
        norm_ = norm;
        rates_ = &rates;
        if constexpr (std::same_as<D, Any>) {
            // By the data of the regime alone, so that no result depends on what has been met before.
            const double swing = std::fmax(rates.fastest_swing(), fastest);
            by_series_ =
                rates.n.coupled > few_states && resolved_ && rates.fastest_decay() <= swing && norm <= 8.0 * swing;
            if (by_series_) {
                while (longest_ > 0 && theta(length(longest_)) > Series::longest) --longest_;
                long_stretch_ = std::numeric_limits<double>::infinity();
            }
        }
        if (!by_series()) begin_levels();
        ready_ = true;
    }

    bool ready() const { return ready_; }
    void reset() {
        levels_ = 0;
        ready_ = false;
    }
    // Whether motions are followed by their series alone: those of large trains that are not stiff. Its levels are only
    // lengths then, and matrices are made for those who ask for them.
    bool by_series() const {
        if constexpr (std::same_as<D, Any>)
            return by_series_;
        else
            return false;
    }
    double theta(double h) const { return norm_ * std::fabs(h); }
    // How many steps by series a length needs.
    double series_parts(double h) const { return std::fmax(1.0, std::ceil(h / length(longest_))); }
    // Of the last step that was taken with it.
    auto& series() { return series_; }
    // What its levels take [bytes], of trains of any size; then without them, until it is prepared again.
    std::size_t bytes() const
        requires(std::same_as<D, Any>)
    {
        return computed_.bytes();
    }
    void release() {
        reset();
        computed_ = {};
        taylor_ = {};
    }

    const LinearRates& rates() const { return *rates_; }
    const Taylor<D>& taylor() const { return taylor_; }

    [[gnu::always_inline]] decltype(auto) level(int k) {
        if (levels_ <= k) [[unlikely]]
            make_levels(k);
        return computed_.step(k, length(k));
    }
    // The level or, if the motion grows beyond all bounds before it ends, the highest whose `exponential_bound` is a
    // bound.
    int bounded_level(int k) {
        level(k);
        return std::min(k, bounded_);
    }
    auto responses(int k) { return computed_.responses(k); }
    const PhaseRotation* rotations(int k) const { return rotations_of_level_[k]; }

    // Whether the regime is slow enough to be followed in time.
    bool resolved() const { return resolved_; }
    double length(int k) const { return base_ * power_of_two[k]; }
    double per_first() const { return per_first_; }  // 1 / length(1), rounded
    // Steps stay below a sixth of the fastest input period: the doubling formula of a sine loses accuracy beyond it.
    int longest_level() const { return longest_; }
    // [s] beyond which it pays to take a stretch at once (long_step.hpp).
    double long_stretch() const { return long_stretch_; }
    // The highest level not longer than s (level 0 even if it is longer). Computes no level.
    int level_below(double s) const {
        if (s >= length(longest_)) return longest_;
        const int k = std::max(0, binary_exponent(s) - binary_exponent(base_));
        return k > 0 && length(k) > s ? k - 1 : k;
    }
    // The lowest level that is no shorter than s; the longest if all are. Computes no level.
    int level_above(double s) const {
        int k = 0;
        while (k < longest_ && length(k) < s) ++k;
        return k;
    }
    // The level of just this length, or -1. Computes no level.
    int level_of(double s) const {
        const int k = binary_exponent(s) - binary_exponent(base_);
        return k >= 0 && k <= longest_ && length(k) == s ? k : -1;
    }
    // Whether twice the level is a step within s.
    bool can_double(int k, double s) const { return k < longest_ && length(k + 1) <= s; }

    // x after the step of level k; `rate` is x' at the anchor, `weights` the input state there.
    [[gnu::always_inline]] Lanes step(int k, const Lanes& x, const Lanes& rate, const double* weights) {
        const Lanes free = level(k).integral * rate;
        const auto response = responses(k);
        Lanes forced = response[0] * weights;
        for (int p = 1; p < n_pairs_; ++p) forced = forced + response[p] * (weights + 2 * p);
        return x + (free + forced);
    }
    // The same for x and x' at once, without the rates of the regime in between.
    [[gnu::always_inline]] void step(int k, Lanes& x, Lanes& rate, const double* weights) {
        const auto& s = level(k);
        const auto response = responses(k);
        // What the inputs bring does not wait for the step before, so it is summed up by itself.
        Lanes forced = response[0] * weights;
        Coupled forced_rate = response[0].rates(weights);
        for (int p = 1; p < n_pairs_; ++p) {
            forced = forced + response[p] * (weights + 2 * p);
            forced_rate = forced_rate + response[p].rates(weights + 2 * p);
        }
        x = x + (s.integral * rate + forced);
        rate.coupled = s.change * rate.coupled + (rate.coupled + forced_rate);
        rate.angle = rates().angle_rate(x.coupled);
    }

    // What multiplies rates by G(h).
    struct Changes {
        Propagator& propagator;
        double h;
        std::optional<Integral> integral;

        Lanes operator*(Lanes rate) const {
            if constexpr (std::same_as<D, Any>)
                if (!integral) {
                    Lanes sum;
                    const double parts = propagator.series_parts(h);
                    Series& series = propagator.series_;
                    for (double k = 0.0; k < parts; ++k) {
                        series.expand(propagator.rates(), rate, h / parts, propagator.theta(h / parts));
                        const Lanes change = series.change();
                        sum = sum + change;
                        rate.coupled = rate.coupled + series.rate_change();
                        rate.angle = rate.angle + propagator.rates().angle_rate(change.coupled);
                    }
                    return sum;
                }
            return *integral * rate;
        }
    };
    Changes changes(double h) {
        return {*this, h, by_series() ? std::nullopt : std::optional<Integral>(this->integral(h))};
    }
    // G(h) for any length: whole levels from the longest down, then the Taylor series.
    Integral integral(double h) {
        level(0);
        Integral sum{Matrix::like(rates().matrix()), {}, 0.0, rates().n};
        lostmotion::make_room(sum.angle, rates().n.angles);
        const auto append = [this, &sum](const auto& change, const auto& next) {
            // G(s + h) = G(h) + exp(A h) G(s)
            for (int j = 0; j < rates().n.angles; ++j)
                store<D>(load(sum.angle[j]) + (sum.coupled.after(angle_change(next, j)) + load(next.angle[j])),
                         sum.angle[j]);
            sum.coupled.add(1.0, change * sum.coupled);
            sum.coupled.add(1.0, next.coupled);
            sum.length += next.length;
        };
        for (int k = level_below(h); k >= 0; --k)
            for (; h >= length(k); h -= length(k)) append(level(k).change, level(k).integral);
        if (h > 0.0) {
            const Integral rest = taylor_.integral(h);
            append(rates().matrix() * rest.coupled, rest);
        }
        return sum;
    }

 private:
    static constexpr std::array<double, max_levels> power_of_two = [] {
        std::array<double, max_levels> p{};
        for (int k = 0; k < max_levels; ++k) p[k] = static_cast<double>(1ull << k);
        return p;
    }();

    static int binary_exponent(double positive) {
        return static_cast<int>(std::bit_cast<std::uint64_t>(positive) >> 52);
    }

    // The row of an angle in exp(A h) - 1.
    Coupled angle_change(const auto& over_h, int j) const {
        return rates().angle_coefficient[j] * over_h.coupled.row(rates().angle_speed[j]);
    }

    // Room for one level more.
    void make_room() { computed_.reach(static_cast<std::size_t>(levels_ + 1), rates().n, n_pairs_); }

    [[gnu::noinline]] void make_levels(int k) {
        if (levels_ == 0) begin_levels();
        while (levels_ <= k) add_doubled();
    }
    void begin_levels() {
        taylor_.prepare(rates());
        add_base();
    }
    void add_base() {
        make_room();
        auto&& s = computed_.step(0, base_);
        bounded_ = max_levels;
        const double h = base_;
        const Integral integral = taylor_.integral(h);
        s.integral.coupled.assign(integral.coupled);
        for (int j = 0; j < rates().n.angles; ++j) store<D>(load(integral.angle[j]), s.integral.angle[j]);
        s.integral.length = h;
        s.change.assign(rates().matrix() * integral.coupled);
        // |exp(A s)| from the powers of a matrix without negative entries beside its diagonal.
        Matrix positive = rates().matrix().magnitudes();
        for (int k = 0; k < positive.size(); ++k) positive(k, k) = std::fmax(rates().matrix()(k, k), 0.0);
        positive.scale(h);
        const Matrix twice = positive * positive;
        s.exponential_bound.assign(Taylor<D>::template power_series<0>(positive, twice, positive * twice));
        for (int p = 0; p < n_pairs_; ++p)
            for (int c = 0; c < 2; ++c) {
                const InputBasis& function = rotations_->basis()[static_cast<std::size_t>(2 * p + c)];
                responses(0)[p].set(c, function.kind == InputBasis::nothing ? Lanes{} : taylor_.response(function, h));
            }
        finish_level();
    }

    // cos(omega length) - 1 of a pair, without cancellation.
    double cosine_change(int k, int pair) {
        const double half = rotations_->over(exponent_ + k - 1)[pair].sin;
        return -2.0 * half * half;
    }

    void add_doubled() {
        make_room();
        const int k = levels_ - 1;
        const auto& a = computed_.step(k, length(k));
        auto&& b = computed_.step(k + 1, length(k + 1));
        const int size = a.change.size(), angles = rates().n.angles;
        for (int c = 0; c < size; ++c) {
            const auto change = a.change.at(c), integral = a.integral.coupled.at(c);
            b.change.set_column(c, 2.0 * change + a.change * change);
            b.integral.coupled.set_column(c, 2.0 * integral + a.change * integral);
            // |exp(A (h + s))| <= |exp(A s)| |exp(A h)|, of which the second is known.
            const Coupled magnitude = absolute(a.change.unit(c) + change);
            b.exponential_bound.set_column(
                c, at_most(max_of(a.exponential_bound.at(c), a.exponential_bound * magnitude), unbounded));
        }
        for (int c = 0; c < size; ++c)
            for (int r = 0; r < size; ++r)
                if (!(b.exponential_bound(r, c) < unbounded)) bounded_ = std::min(bounded_, k);
        ArrayOf<D, Coupled, D::angles> angle;
        lostmotion::make_room(angle, angles);
        for (int j = 0; j < angles; ++j) {
            angle[j] = angle_change(a.integral, j);
            store<D>(2.0 * load(a.integral.angle[j]) + a.integral.coupled.after(angle[j]), b.integral.angle[j]);
        }
        b.integral.length = 2.0 * a.integral.length;
        for (int p = 0; p < n_pairs_; ++p) {
            const InputBasis* basis = &rotations_->basis()[static_cast<std::size_t>(2 * p)];
            const auto& from = responses(k)[p];
            auto&& to = responses(k + 1)[p];
            const auto held = [&](int input) { return a.integral * rates().input_column[input]; };
            const auto kept = [&](int c) {
                const Lanes own = from.of(c);
                Lanes out = own;
                out.coupled = own.coupled + a.change * load(from.change[c]);
                for (int j = 0; j < angles; ++j) out.angle[j] = own.angle[j] + sum_of(angle[j] * own.coupled);
                return out;
            };
            if (basis->kind == InputBasis::cosine) {
                const PhaseRotation turn = rotations(k)[p];
                const Lanes cosine = from.of(0), sine = from.of(1), constant = held(basis->input);
                to.set(0, kept(0) + (turn.cos * cosine + (-turn.sin * sine + cosine_change(k, p) * constant)));
                to.set(1, kept(1) + (turn.cos * sine + (turn.sin * cosine + turn.sin * constant)));
            } else {
                for (int c = 0; c < 2; ++c)
                    to.set(c, basis[c].kind == InputBasis::nothing
                                  ? Lanes{}
                                  : kept(c) + (from.of(c) + length(k) * held(basis[c].input)));
            }
        }
        finish_level();
    }

    // What follows from length and responses: the phase rotations of the inputs, and the rates.
    void finish_level() {
        const int k = levels_++;
        const PhaseRotation* turn = rotations_of_level_[k] = rotations_->over(exponent_ + k);
        for (int p = 0; p < n_pairs_; ++p) {
            const InputBasis* basis = &rotations_->basis()[static_cast<std::size_t>(2 * p)];
            auto&& r = responses(k)[p];
            for (int c = 0; c < 2; ++c) {
                const double input = basis[c].kind == InputBasis::nothing  ? 0.0
                                     : basis[c].kind == InputBasis::ramp   ? length(k)
                                     : basis[c].kind == InputBasis::cosine ? cosine_change(k, p)
                                                                           : turn[p].sin;
                store<D>(rates().matrix() * load(r.change[c]) + input * load(rates().input_column[basis[c].input]),
                         r.rate[c]);
            }
        }
    }

    Taylor<D> taylor_;
    const LinearRates* rates_ = nullptr;
    double norm_ = 0.0;
    bool ready_ = false, by_series_ = false;
    [[no_unique_address]] std::conditional_t<std::same_as<D, Any>, Series, std::monostate> series_;
    double base_ = 0.0;  // length of level 0 [s]
    double per_first_ = 0.0;
    double long_stretch_ = 0.0;  // [s]
    bool resolved_ = true;
    int exponent_ = 0;          // of two: base / unit
    int longest_ = 0;           // level
    int bounded_ = max_levels;  // the highest level whose exponential_bound is bounded, as far as they are computed
    int n_pairs_ = 0;           // of functions of the inputs
    PhaseRotations* rotations_ = nullptr;
    int levels_ = 0;
    LevelsOf<D> computed_;
    std::array<const PhaseRotation*, max_levels> rotations_of_level_{};
};

}  // namespace lostmotion
