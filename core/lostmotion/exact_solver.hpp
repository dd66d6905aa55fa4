// Exact solver: propagation by matrix exponentials; only switching instants are searched, and none is missed.
//
// A look tests an interval of length h for a guard that becomes negative. From value and slope of the guard at both
// ends comes its cubic Hermite interpolant, which departs from the guard by at most h^4/384 max|g''''|, its slope
// by at most sqrt(3)/216 h^3 max|g''''| (Birkhoff and Priver 1967). max|g''''| is bounded through the fourth
// derivative of the state at the start and a bound on |exp(A s)|. The Bernstein coefficients of the cubic enclose
// it. So a guard is certified positive, or certified to fall through zero once, or the interval is halved. There is
// no other step size.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <memory>
#include <optional>

#include "cubic.hpp"
#include "cursor.hpp"
#include "regime_cache.hpp"
#include "switching.hpp"

namespace lostmotion {

// A stretch of time spent in one regime, from which an observer can evaluate the exact state at any instant.
template <class System>
struct Segment {
    typename RegimeCache<System>::Entry& entry;
    const Signals& signals;
    double begin, end;  // [s]
    bool last;          // no further segment follows in this call: `end` belongs to it
    State x;            // at begin
    Memory memory;
    State constant;  // the part of dx/dt that depends on neither state nor inputs
    State x_end{};   // at end, before any stop there
};

// Constant part of a regime's rates.
inline State constant_rate(const Regime& r, const Memory& m) {
    State c{};
    for (int k = 0; k < n_states; ++k) c[k] = constant_part(r.rate[k], m);
    return c;
}

template <class System>
class ExactSolver {
 public:
    using Cache = RegimeCache<System>;

    // unit: a length of time [s] that is to be a power-of-two multiple of the elementary steps, such as the
    // sampling interval. scale: natural sizes of the states.
    // shared: regimes of the same system that an earlier solver has left, if any.
    ExactSolver(const System& system, const Signals& signals, double unit, const State& scale, Cache* shared = nullptr)
        : system_(system),
          signals_(signals),
          own_(shared == nullptr ? std::make_unique<Cache>(system) : nullptr),
          cache_(shared == nullptr ? *own_ : *shared),
          scale_(scale),
          unit_(elementary(unit)),
          basis_(cache_.serve(unit_, input_basis(signals))) {
        const auto bound = InputState(signals_, basis_).fourth_derivative_bound();
        for (int i = 0; i < n_inputs; ++i) input_bound_[i] = bound[i];
    }
    ExactSolver(const ExactSolver&) = delete;
    ExactSolver& operator=(const ExactSolver&) = delete;

    // Polled now and then; true ends the run.
    bool (*interrupted)(void*) = nullptr;
    void* interrupted_context = nullptr;

    double time() const { return time_; }
    const State& state() const { return now_.x; }
    const Memory& memory() const { return now_.memory; }
    const RegimeKey& key() const { return key_; }
    const Regime& regime() { return cache_.regime(key_); }
    const Signals& signals() const { return signals_; }
    const std::vector<InputBasis>& basis() const { return basis_; }
    double unit() const { return unit_; }
    Contact stopped_at() const { return stopped_at_; }
    long looks() const { return looks_; }

    // Sets the state and finds the regime it is in.
    Status begin(double time, const State& x, const Memory& memory) {
        set_time(time);
        now_.x = x;
        now_.memory = memory;
        anchor_inputs();
        return status_of(system_.start(cache_, now_, key_));
    }
    // Continues from a state with a known regime.
    void resume(double time, const State& x, const Memory& memory, const RegimeKey& key) {
        set_time(time);
        now_.x = x;
        now_.memory = memory;
        key_ = key;
    }
    // From now on the input is value + slope * (t - now). Only for signals made with ramped_inputs().
    void set_ramp(int input, double value, double slope) { signals_[input].knots[0] = {time_, value, slope}; }
    // The inputs have changed at this instant: finds the regime anew.
    Status inputs_changed() {
        anchor_inputs();
        return status_of(system_.next(cache_, now_, nullptr, key_));
    }

    // Runs to t_end. The observer gets every segment and every switching as they come.
    template <class Observer>
    Status advance(double t_end, Observer& observer) {
        input_.anchor(time_);
        if (jump_pending_) {
            jump_pending_ = false;
            const Status status = change_regime(nullptr, observer);
            if (status != Status::done) return status;
        }
        while (true) {
            typename Cache::Entry& entry = cache_.entry(key_);
            if (!entry.propagator.ready()) entry.propagator.prepare(entry.regime, unit_, scale_, basis_);
            Segment<System> segment{entry, signals_, time_,       t_end,
                                    true,  now_.x,   now_.memory, constant_rate(entry.regime, now_.memory)};
            const double knot = next_knot(signals_, time_);
            const double limit = std::fmin(t_end, knot);
            const Guard* fired = nullptr;
            const Status status = run_regime(segment, limit, fired);
            if (status != Status::done) return status;
            segment.end = time_;
            segment.x_end = now_.x;
            segment.last = fired == nullptr && time_ >= t_end;
            if (!observer.segment(segment, basis_)) return Status::interrupted;
            if (segment.last) {
                jump_pending_ = knot == t_end;  // it belongs to what comes after
                return Status::done;
            }
            const Status switched = change_regime(fired, observer);
            if (switched != Status::done) return switched;
        }
    }

 private:
    static constexpr double settled = 1e-8;
    static constexpr int first_level = 6;  // of the first look

    static double elementary(double unit) {
        while (unit > 1e-2) unit *= 0.5;
        return unit;
    }
    void set_time(double time) {
        time_ = time;
        accumulation_ = {};
        jump_pending_ = false;
        last_level_ = first_level;  // so that what follows depends on the state alone
    }
    void anchor_inputs() { see_inputs(input_, time_, now_); }

    template <class Observer>
    Status change_regime(const Guard* fired, Observer& observer) {
        Switching s;
        const Status status = switch_regime(system_, cache_, input_, time_, fired, now_, key_, s);
        if (fired != nullptr) stopped_at_ = fired->contact;
        if (status != Status::done) return status;
        observer.switching(s);
        return accumulation_.add(time_, unit_) ? Status::zeno : Status::done;
    }

    enum class Verdict { clear, crossing, uncertain };

    // Guards of one segment at the start of a look and at its end.
    struct Look {
        std::array<double, max_guards> value, slope, end_value, end_slope, fourth;
        std::array<double, max_guards> least,
            error;  // of the cubic: a lower bound, and how far the guard may lie from it

        void enclose(double h, int lanes) {
            const double third = h / 3.0, share = h * h * h * h / 384.0;
            for (int g = 0; g < lanes; ++g) {
                const double c1 = value[g] + third * slope[g], c2 = end_value[g] - third * end_slope[g];
                const double outer = value[g] < end_value[g] ? value[g] : end_value[g], inner = c1 < c2 ? c1 : c2;
                least[g] = outer < inner ? outer : inner;
                error[g] = share * fourth[g];
            }
        }
    };

    // Advances within the regime until a guard reaches zero (fired) or `limit`.
    Status run_regime(const Segment<System>& segment, double limit, const Guard*& fired) {
        typename Cache::Entry& e = segment.entry;
        Propagator& p = e.propagator;
        const std::array<double, max_guards> constant = e.guard_constants(segment.memory);
        Cursor &cursor = cursor_, &end = end_;
        cursor.place(p, segment.constant, input_, now_.x);
        Look look;
        off_zero_ = false;
        touch_size_ = 0.0;
        e.evaluate_guards(&constant, cursor.x(), cursor.input().values(), look.value);
        e.evaluate_guards(nullptr, cursor.rate(), cursor.input().jet<2>()[1], look.slope);
        int level = std::min(last_level_, p.level_below(limit - time_));
        const double shortest = 1e-7 * p.level(0).length;
        for (long count = 1; time_ < limit; ++count) {
            ++looks_;
            if (looks_ % 1024 == 0 && interrupted != nullptr && interrupted(interrupted_context))
                return Status::interrupted;
            if (count % 64 == 0) cursor.anchor(time_);
            const auto u = cursor.input().template jet<4>();
            const State& rate = cursor.rate();
            if (!(std::fabs(rate[0]) + std::fabs(rate[1]) + std::fabs(rate[2]) < 1e100)) return Status::outside;
            const State fourth = p.higher_rate(p.higher_rate(p.higher_rate(rate, u[1]), u[2]), u[3]);
            const double left = limit - time_;
            double h = std::min(p.level(level).length, left);
            while (true) {
                const bool whole = h == p.level(level).length;
                end = cursor;
                if (whole)
                    end.step(level);
                else
                    end.advance(h);
                const auto v = end.input().jet<2>();
                e.evaluate_guards(&constant, end.x(), v[0], look.end_value);
                e.evaluate_guards(nullptr, end.rate(), v[1], look.end_slope);
                bound_fourth(e, p.level(level).growth, fourth, h, look.fourth);
                const Verdict verdict = judge(e, segment.memory, cursor, look, h, h < shortest);
                if (verdict == Verdict::uncertain) {  // below the shortest level, by plain halves
                    h = level > 0 ? std::min(p.level(--level).length, left) : 0.5 * h;
                    continue;
                }
                if (verdict == Verdict::crossing) {
                    first_crossing(e, segment.memory, cursor, look, h, end, fired);
                    time_ = end.time();
                    now_.x = end.x();
                    last_level_ = level;
                    return Status::done;
                }
                time_ = h == left ? limit : time_ + h;
                break;
            }
            cursor = end;
            std::swap(look.value, look.end_value);
            std::swap(look.slope, look.end_slope);
            // Twice the length has at least sixteen times the error; try it where there is room for more than that.
            if (room_ > 64.0 && p.can_double(level, limit - time_)) ++level;
        }
        now_.x = cursor.x();
        last_level_ = level;
        return Status::done;
    }

    // |g''''| over the look.
    void bound_fourth(const typename Cache::Entry& e, const Matrix& growth, const State& fourth, double h,
                      std::array<double, max_guards>& out) const {
        State size{};
        double any = input_bound_[0] + input_bound_[1];
        for (int k = 0; k < n_states; ++k) {
            size[k] = std::fabs(fourth[k]);
            for (int i = 0; i < n_inputs; ++i)
                size[k] += h * std::fabs(e.propagator.input_column(i)[k]) * input_bound_[i];
            any += size[k];
        }
        if (any == 0.0) {  // at rest; growth may have overflowed
            out.fill(0.0);
            return;
        }
        size = growth * size;
        const auto& c = e.guard_sizes;
        for (int g = 0; g < e.guard_lanes; ++g)
            out[g] = c[0][g] * size[0] + c[1][g] * size[1] + c[2][g] * size[2] + c[3][g] * size[3] + c[4][g] * size[4] +
                     c[5][g] * input_bound_[0] + c[6][g] * input_bound_[1];
    }

    Verdict judge(const typename Cache::Entry& e, const Memory& memory, const Cursor& cursor, Look& look, double h,
                  bool shortest) {
        const Regime& r = e.regime;
        look.enclose(h, e.guard_lanes);
        n_crossing_ = 0;
        room_ = std::numeric_limits<double>::infinity();
        std::optional<Instant> instant;  // made when a guard needs it
        std::optional<Flow> flow;
        for (int g = 0; g < r.n_guards; ++g) {
            const bool by_touch = r.guards[g].by_touch;
            const double least = look.least[g], error = look.error[g];
            double apart = error;  // beyond this a guard is clear
            if (by_touch) {
                touch_size_ = std::max(touch_size_, e.speed_size(g, cursor.x()));
                off_zero_ |= look.value[g] > rounding * touch_size_;
                apart = std::max(error, rounding * touch_size_);
            }
            if (least > apart) {
                room_ = std::min(room_, error > 0.0 ? least / error : room_);
                continue;
            }
            if (!instant) {
                instant.emplace(Instant{time_, cursor.x(), memory, cursor.input().jet(), cursor.input().sizes()});
                flow.emplace(r, *instant);
            }
            const Cubic c(look.value[g], look.slope[g], look.end_value[g], look.end_slope[g], h);
            const double bound = h * h * h * look.fourth[g];
            const double size = magnitude(r.guards[g].form, instant->x, memory, instant->input_size);
            const double tolerance =
                rounding * size +
                time_rounding * std::fabs(time_) * std::max(std::fabs(look.slope[g]), std::fabs(look.end_slope[g]));
            const bool touches =
                by_touch && off_zero_ && least - error <= rounding * touch_size_ && c.c3 > rounding * touch_size_;
            if (least > error && !touches) {
                room_ = std::min(room_, error > 0.0 ? least / error : room_);
                continue;
            }
            if (least - error >= -tolerance && !touches) continue;
            const double slope_error = 0.00802 * bound;
            const double d0 = 3.0 / h * (c.c1 - c.c0), d1 = 3.0 / h * (c.c2 - c.c1), d2 = 3.0 / h * (c.c3 - c.c2);
            const bool rises = std::fmin(d0, std::fmin(d1, d2)) > slope_error;
            const bool falls = std::fmax(d0, std::fmax(d1, d2)) < -slope_error;
            if (rises && c.c0 >= -tolerance && !(touches && c.c0 <= rounding * touch_size_)) continue;
            if (falls && c.c3 >= -tolerance) continue;
            if (falls) {
                crossing_[n_crossing_++] = {g, false};
                continue;
            }
            if (c.c0 <= tolerance && !touches && departs(r.guards[g].form, *flow, h, look.fourth[g])) continue;
            const double resolved = touches ? rounding * touch_size_ : tolerance;
            if (error > resolved && !shortest) return Verdict::uncertain;
            // The cubic is the guard to rounding; does it dip below zero?
            const double lowest = c(c.lowest_at());
            if (lowest < -tolerance)
                crossing_[n_crossing_++] = {g, false};
            else if (touches && lowest <= resolved)
                crossing_[n_crossing_++] = {g, true};
        }
        return n_crossing_ > 0 ? Verdict::crossing : Verdict::clear;
    }

    // A guard that starts on zero: does its first derivative that is not zero carry it away, all through the look?
    static bool departs(const LinearForm& form, Flow& flow, double h, double fourth) {
        std::array<double, 4> derivative{};
        int first = 0;
        for (int k = 1; k < 4; ++k) {
            const auto [value, size] = flow.derivative(form, k);
            derivative[k] = value;
            if (first == 0 && value < -rounding * size) return false;
            if (first == 0 && value > rounding * size) first = k;
        }
        if (first == 0) return false;
        // value = h^k (derivative_k / k! + what follows), bounded at the far end.
        constexpr std::array<double, 4> factorial{1.0, 1.0, 2.0, 6.0};
        double least = derivative[first] / factorial[first] - fourth * std::pow(h, 4 - first) / 24.0;
        for (int k = first + 1; k < 4; ++k)
            least += std::min(0.0, derivative[k]) * std::pow(h, k - first) / factorial[k];
        return least > 0.0;
    }

    // Earliest of the certified crossings; `end` is left there.
    void first_crossing(typename Cache::Entry& e, const Memory& memory, const Cursor& cursor, const Look& look,
                        double h, Cursor& end, const Guard*& fired) {
        const Regime& r = e.regime;
        double best = std::numeric_limits<double>::infinity();
        Cursor& at = trial_;
        const auto cubic = [&](int g) {
            return Cubic(look.value[g], look.slope[g], look.end_value[g], look.end_slope[g], h);
        };
        std::array<double, max_guards> estimate{};
        for (int k = 0; k < n_crossing_; ++k) {
            const auto [g, touch] = crossing_[k];
            const Cubic c = cubic(g);
            estimate[g] = touch ? c.lowest_at() : c.root(c.c3 < 0.0 && c.slope(1.0) <= 0.0 ? 1.0 : c.lowest_at());
        }
        std::sort(crossing_.begin(), crossing_.begin() + n_crossing_,
                  [&](const Crossing& a, const Crossing& b) { return estimate[a.guard] < estimate[b.guard]; });
        for (int k = 0; k < n_crossing_; ++k) {
            const auto [g, touch] = crossing_[k];
            const double z = estimate[g];
            // Still positive where another has crossed: later.
            if (k > 0 && cubic(g)(best / h) > h * h * h * h / 384.0 * look.fourth[g]) continue;
            // Newton on the guard itself, kept within its bracket by bisection.
            double low = 0.0, high = h, s = z * h;
            at = cursor;
            at.advance(s);
            for (int m = 0; m < 100 && !touch; ++m) {
                const Guard& guard = r.guards[g];
                const InputJet u = at.input().jet();
                const double value = evaluate(guard.form, at.x(), memory, u[0]);
                (value > 0.0 ? low : high) = s;
                double next = s - value / evaluate_rate(guard.form, at.rate(), u[1]);
                if (!(next >= low && next <= high)) next = 0.5 * (low + high);
                const double moved = next - s;
                if (value == 0.0 || at.time() + moved == at.time()) break;
                if (std::fabs(moved) < e.propagator.level(0).length) {
                    at.nudge(moved);
                } else {
                    at = cursor;
                    at.advance(next);
                }
                s = next;
                if (std::fabs(moved) < settled * s) break;  // Newton has converged: the next correction is its square
            }
            if (s < best) {
                best = s;
                end = at;
                fired = &r.guards[g];
            }
        }
    }

    const System& system_;
    Signals signals_;
    std::unique_ptr<Cache> own_;
    Cache& cache_;
    State scale_;
    double unit_;
    std::array<double, n_inputs> input_bound_{};

    double time_ = 0.0;
    Instant now_;
    RegimeKey key_;
    int last_level_ = first_level;
    long looks_ = 0;
    const std::vector<InputBasis>& basis_;
    InputState input_{signals_, basis_};
    Cursor cursor_{signals_, basis_}, end_ = cursor_, trial_ = cursor_;
    double room_ = 0.0;  // least value of a guard / error of its cubic, in the last look
    struct Crossing {
        int guard;
        bool touch;
    };
    std::array<Crossing, max_guards> crossing_{};
    int n_crossing_ = 0;
    // Of the guard that may end this regime by a touch: has it been off zero, and the largest size of its terms. What
    // rounding leaves of a zero is relative to the latter. (A regime has at most one such guard.)
    bool off_zero_ = false;
    double touch_size_ = 0.0;
    Accumulation accumulation_;
    bool jump_pending_ = false;
    Contact stopped_at_ = input_contact;
};

}  // namespace lostmotion
