// Exact solver: propagation by matrix exponentials; only switching instants are searched, and none is missed.
//
// An event check covers an interval of length h for a guard that becomes negative. From value and slope of the guard at
// both ends comes its cubic Hermite interpolant, which departs from the guard by at most h^4/384 max|g''''|, its slope
// by at most sqrt(3)/216 h^3 max|g''''| (Birkhoff and Priver 1967). max|g''''| is bounded through the fourth
// derivative of the state at the start and a bound on |exp(A s)|. The Bernstein coefficients of the cubic enclose
// it. So a guard is certified positive, or certified to fall through zero once, or the interval is shortened. There
// is no other step size.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <memory>

#include "../kernel/cursor.hpp"
#include "../kernel/polynomial.hpp"
#include "course.hpp"
#include "regime_cache.hpp"
#include "switching.hpp"

namespace lostmotion {

// A stretch of time spent in one regime, from which an observer can evaluate the exact state at any instant.
template <class System>
struct Segment {
    using Entry = typename RegimeCache<System>::Entry;
    Entry& entry;
    const Cursor<typename System::Dims>& at;  // where it begins
    double begin, end;                        // [s]
    bool last;                                // no further segment follows in this call: `end` belongs to it
    typename System::Dims::Memory memory;
    ColumnOf<typename System::Dims> constant;  // the part of dx/dt that depends on neither state nor inputs
    StateOf<typename System::Dims> x_end;      // at end, before any stop there
};

template <class System>
class ExactSolver {
 public:
    using Cache = RegimeCache<System>;
    using Entry = typename Cache::Entry;
    using D = typename System::Dims;
    using Regime = typename System::Regime;
    using Key = typename System::Key;
    using Guard = typename System::Guard;
    using GuardTable = typename Cache::GuardTable;
    using Guards = typename Cache::Guards;
    using Contact = typename D::Contact;
    using Memory = typename D::Memory;
    using State = StateOf<D>;
    using Coupled = CoupledOf<D>;
    using Lanes = LanesOf<D>;
    using Matrix = MatrixOf<D>;
    using LinearForm = LinearFormOf<D>;
    using Signals = SignalsOf<D>;
    using Course = CourseOf<D>;
    using Cursor = lostmotion::Cursor<D>;
    using InputState = lostmotion::InputState<D>;
    using Propagator = lostmotion::Propagator<D>;
    using Expansion = lostmotion::Expansion<D>;

    // unit: a length of time [s] that is to be a power-of-two multiple of the elementary steps, such as the
    // sampling interval. scale: natural magnitudes of the states.
    // shared: regimes of the same system that an earlier solver has left, if any.
    ExactSolver(const System& system, const Signals& signals, double unit, const State& scale, Cache* shared = nullptr)
        : system_(system),
          signals_(without_idle_sines(signals)),
          own_(shared == nullptr ? std::make_unique<Cache>(system) : nullptr),
          cache_(shared == nullptr ? *own_ : *shared),
          scale_(scale),
          unit_(elementary(unit)),
          rotations_(cache_.serve(unit_, input_basis(signals_))),
          cursors_{start(), start(), start(), start()},
          input_bound_(begin_->input().fourth_derivative_bound()) {}
    ExactSolver(const ExactSolver&) = delete;
    ExactSolver& operator=(const ExactSolver&) = delete;

    // Polled now and then; true ends the run.
    bool (*interrupted)(void*) = nullptr;
    void* interrupted_context = nullptr;

    double time() const { return time_; }
    const State& state() const { return now_.x; }
    const Memory& memory() const { return now_.memory; }
    const Key& key() const { return key_; }
    const Regime& regime() { return cache_.regime(key_); }
    const Regime& regime(const Key& key) { return cache_.regime(key); }
    const std::vector<InputBasis>& basis() const { return rotations_.basis(); }
    double unit() const { return unit_; }
    Contact stopped_at() const { return stopped_at_; }
    long event_checks() const { return event_checks_; }
    std::size_t switchings() const { return switchings_; }

    // Sets the state and finds the regime it is in.
    Status begin(double time, const State& x, const Memory& memory) {
        set_time(time);
        course_ = {};
        switchings_ = 0;
        now_.x = x;
        now_.memory = memory;
        anchor_inputs();
        course_.input = now_.input[0];
        return status_of(system_.start(cache_, now_, key_));
    }
    // Continues from a state with a known regime.
    void resume(double time, const State& x, const Memory& memory, const Key& key, const Course& course = {}) {
        set_time(time);
        now_.x = x;
        now_.memory = memory;
        key_ = key;
        course_ = course;
    }
    const Course& course() const { return course_; }
    // From now on the input is value + slope * (t - now). Only for signals made with ramped_inputs().
    void set_ramp(int input, double value, double slope) { signals_[input].breakpoints[0] = {time_, value, slope}; }
    // The inputs have changed at this instant: finds the regime anew.
    Status inputs_changed() {
        const Key before = key_;
        anchor_inputs();
        const Status status = status_of(system_.next(cache_, now_, nullptr, key_, course_.input));
        follow_inputs(before);
        return status;
    }

    // Runs to t_end. The observer gets every segment as it comes and, if it wants them, the switchings between.
    template <class Observer>
    Status advance(double t_end, Observer& observer) {
        begin_->inputs().anchor(time_);
        crossings_ = 0;  // so that what follows depends on the state alone
        if (jump_pending_) {
            jump_pending_ = false;
            const Status status = change_regime(nullptr, observer);
            if (status != Status::done) return status;
        }
        while (true) {
            Entry& entry = cache_.entry(key_);
            if (!entry.propagator.ready()) entry.prepare(rotations_, scale_);
            Segment<System> segment{entry, *begin_, time_, t_end, true, now_.memory, entry.rates.constant(now_.memory),
                                    now_.x};
            begin_->place(entry.propagator, segment.constant, now_.x, course_.rate_known ? &course_.rate : nullptr);
            if (begin_->constant_inputs()) {
                if (has_settled(entry.regime, begin_->rate())) begin_->settle();
            } else if (rest_unforced(entry, begin_->rate())) {
                segment.x_end = now_.x;
                begin_->place(entry.propagator, segment.constant, now_.x);
            }
            if (!(time_ < breakpoint_)) breakpoint_ = next_breakpoint(signals_, time_);
            double limit = std::min(t_end, breakpoint_);
            if (const Regime& r = entry.regime; r.driving_input >= 0) [[unlikely]]
                limit = begin_->input().turning(r.driving_input, r.driving_way, limit);
            const Guard* fired = nullptr;
            const Status status = run_regime(segment, limit, fired);
            if (status != Status::done) return status;
            segment.end = time_;
            segment.x_end = now_.x;
            segment.last = fired == nullptr && time_ >= t_end;
            if (!observer.segment(segment)) return Status::interrupted;
            if (segment.last) {
                jump_pending_ = breakpoint_ == t_end;  // it belongs to what comes after
                return Status::done;
            }
            if (fired == nullptr && time_ < limit) continue;  // the motion has settled
            const Status switched = change_regime(fired, observer);
            if (switched != Status::done) return switched;
        }
    }

 private:
    static constexpr double converging = 1e-7;  // the next correction is less than the square of the last
    static constexpr int first_level = 6;       // of the first event check
    static constexpr double settled =
        0x1p-400;  // of a rate [1/s], in natural magnitudes: below it, squares would underflow
    // A third of the length times the error of the slope of a cubic, over the error of its value.
    static constexpr double slope_share = 0.00802 / 3.0 * 384.0;

    Cursor start() const { return Cursor(InputState(signals_, rotations_.basis())); }
    static double elementary(double unit) {
        while (unit > 1e-2) unit *= 0.5;
        return unit;
    }
    void set_time(double time) {
        time_ = time;
        accumulation_ = {};
        jump_pending_ = false;
        breakpoint_ = time;
        last_level_ = first_level;  // so that what follows depends on the state alone
    }
    void anchor_inputs() {
        begin_->inputs().anchor(time_);
        see_inputs(begin_->input(), time_, now_);
    }

    [[gnu::noinline]] bool has_settled(const Regime& regime, const State& rate) const {
        for (int k = 0; k < D::coupled; ++k) {
            if (regime.following[k]) continue;
            if (!(std::fabs(rate[k]) <= settled * scale_[k])) return false;
        }
        return true;
    }
    // Under inputs that vary, the states that they do not reach decay for ever: once they are below what squares allow,
    // they are zero. Returns whether one has become so.
    bool rest_unforced(const Entry& e, const State& rate) {
        typename Cache::States forced = 0;
        for (int i = 0; i < D::inputs; ++i)
            if (begin_->input().varies(i)) forced |= e.reached[i];
        bool changed = false;
        for (typename Cache::States left = ~forced & Cache::all_states; left != 0; left &= left - 1) {
            const int k = std::countr_zero(left);
            const double limit = settled * scale_[k];
            if (now_.x[k] == 0.0 || !(std::fabs(now_.x[k]) <= limit && std::fabs(rate[k]) <= limit)) continue;
            now_.x[k] = 0.0;
            changed = true;
        }
        return changed;
    }
    static bool moderate(const State& rate) {
        return sum_in_fours<D::coupled>([&](auto k) { return std::fabs(rate[k]); }) < 1e100;
    }
    // After a change of the inputs: if the regime goes on, the rate jumps by no more than what they bring.
    [[gnu::cold]] void follow_inputs(const Key& before) {
        if (!course_.rate_known || !(key_ == before)) {
            course_.forget();
            return;
        }
        Entry& e = cache_.entry(key_);
        Lanes rate = load(course_.rate);
        for (int i = 0; i < D::inputs; ++i)
            rate.coupled = rate.coupled + (now_.input[0][i] - course_.input[i]) * load(e.rates.input_column[i]);
        const Coupled before_jump = bound_ahead(e, coupled(course_.rate)), after_jump = bound_ahead(e, rate.coupled);
        for (int t = 0; t < e.n_twists; ++t) {
            auto& twist = course_.twist[t];
            const double was = before_jump[e.twists[t].state], is = after_jump[e.twists[t].state];
            twist.doubt = is > 0.0 ? std::fmin(1.0, twist.doubt * was / is) : 0.0;
            twist.off_zero = false;
            twist.grazing_magnitude = 0.0;
        }
        rate.store(course_.rate.data());
    }
    // Bound on the coupled states over the first event check, from what they are.
    [[gnu::cold]] Coupled bound_ahead(Entry& e, const Coupled& x) const {
        if (!e.propagator.ready()) e.prepare(rotations_, scale_);
        return e.propagator.level(first_level).exponential_bound * absolute(x);
    }
    // Rounding of a rate that is computed from the state, where a regime begins, as far as it acts on the twists. What
    // the search for the modes takes for zero must not be seen to fall at once.
    [[gnu::cold]] void begin_in_doubt(Entry& e, const Cursor& at, const Memory& memory) {
        State magnitude = e.rates.magnitude(magnitudes(at.x()), magnitudes(memory), at.input().magnitudes());
        for (int t = 0; t < e.n_twists; ++t)
            if (const int k = e.twists[t].state; at.rate()[k] == 0.0) magnitude[k] = 0.0;  // it starts from rest
        const Coupled ahead = bound_ahead(e, coupled(at.rate())), rounding_ahead = bound_ahead(e, coupled(magnitude));
        for (int t = 0; t < e.n_twists; ++t) {
            auto& twist = course_.twist[t];
            const double bound = ahead[e.twists[t].state];
            twist.most_doubt = rounding * rounding_ahead[e.twists[t].state];
            twist.doubt = bound > twist.most_doubt ? twist.most_doubt / bound : 1.0;
        }
    }

    template <class Observer>
    Status change_regime(const Guard* fired, Observer& observer) {
        if (fired != nullptr) {
            std::swap(begin_, there_);
            if (++crossings_ % 8 == 0) begin_->inputs().anchor(time_);
        }
        const Key before = key_;
        const Status status = switch_regime(system_, cache_, begin_->inputs(), time_, fired, now_, key_, observer);
        if (fired != nullptr) stopped_at_ = fired->contact;
        if (status != Status::done) return status;
        if (fired == nullptr)
            follow_inputs(before);
        else
            course_.forget();
        ++switchings_;
        return accumulation_.add(time_, unit_) ? Status::zeno : Status::done;
    }

    enum class Verdict { clear, crossing, uncertain };

    // Guards at one end of a event check.
    struct Ends {
        typename GuardTable::Values value, slope;
    };
    // Guards all through it: a lower bound of their cubics, and how far they may lie from these.
    struct Bounds {
        typename GuardTable::Values lower, error, fourth;
    };

    // Advances within the regime until a guard reaches zero (fired) or `limit`.
    Status run_regime(const Segment<System>& segment, double limit, const Guard*& fired) {
        Entry& e = segment.entry;
        Propagator& p = e.propagator;
        typename GuardTable::Values constant;
        e.guards.constants(segment.memory, constant);
        Cursor *cursor = begin_, *end = there_;
        Ends *here = &ends_[0], *there = &ends_[1];
        const bool constant_inputs = cursor->constant_inputs();
        if (!course_.rate_known && cursor->carries_rate()) begin_in_doubt(e, *cursor, segment.memory);
        if (e.regime.n_guards == 0 && LongStep<D>::pays(p, limit - time_) && leap(e, limit)) return Status::done;
        evaluate(e, constant, *cursor, *here);
        Coupled forced{};  // bound on what the fourth derivatives of the inputs add to that of the state, per second
        for (int i = 0; i < e.rates.depends_on.inputs; ++i)
            forced = forced + input_bound_[i] * absolute(load(e.rates.input_column[i]));
        int level = std::min(last_level_, p.level_below(limit - time_));
        const double shortest = 1e-7 * p.length(0);
        for (long count = 1; time_ < limit; ++count) {
            ++event_checks_;
            if (event_checks_ % 1024 == 0 && interrupted != nullptr && interrupted(interrupted_context))
                return Status::interrupted;
            if (count % 64 == 0) cursor->anchor(time_);
            const State& rate = cursor->rate();
            if (constant_inputs && has_settled(e.regime, rate)) {
                rest(segment, *cursor, limit);
                return Status::done;
            }
            if (!moderate(rate)) return Status::outside;
            const Coupled fourth = absolute(cursor->fourth_derivative());
            const double left = limit - time_;
            level = p.bounded_level(level);
            double h = std::min(p.length(level), left);
            while (true) {
                if (h == p.length(level)) {
                    end->step_from(*cursor, level);
                } else {
                    end->advance_from(*cursor, h);
                }
                evaluate(e, constant, *end, *there);
                bound_fourth(e.guards, p.level(level).exponential_bound, fourth + h * forced);
                const Verdict verdict = judge(e, segment.memory, *cursor, *here, *there, h, h < shortest);
                if (verdict == Verdict::uncertain) {  // below the shortest doubling level, by plain halves
                    h = level > 0 ? std::min(p.length(level = std::max(0, level - halvings_)), left) : 0.5 * h;
                    continue;
                }
                if (verdict == Verdict::crossing) {
                    first_crossing(e, segment.memory, *cursor, *here, *there, h, fired);
                    time_ = there_->time();
                    now_.x = there_->x();
                    last_level_ = level;
                    return Status::done;
                }
                time_ = h == left ? limit : time_ + h;
                break;
            }
            cursor = end;
            std::swap(here_, there_);
            end = there_;
            std::swap(here, there);
            // Twice the length has at least sixteen times the error; try it where there is room for more than that.
            if (roomy_ && p.can_double(level, limit - time_)) ++level;
        }
        now_.x = cursor->x();
        last_level_ = level;
        keep_course(e, *cursor);
        return Status::done;
    }

    // The motion has settled.
    [[gnu::cold]] void rest(const Segment<System>& segment, const Cursor& at, double limit) {
        now_.x = at.x();
        if (time_ == segment.begin) {
            for (int j = D::coupled; j < D::states; ++j) now_.x[j] += at.rate()[j] * (limit - time_);
            time_ = limit;
        }
        keep_course(segment.entry, at);
        for (int k = 0; k < D::coupled; ++k) course_.rate[k] = 0.0;
        course_.rate_known = true;
    }

    // At the end of a stretch that no guard ends.
    [[gnu::cold]] void keep_course(const Entry& e, const Cursor& at) {
        // Carried on for long, the speeds that a stuck twist ties together drift apart by rounding.
        if constexpr (requires(std::array<bool, D::contacts> at_rest) { system_.stop(now_.x, at_rest); }) {
            std::array<bool, D::contacts> at_rest = e.regime.at_rest;
            if (at.carries_rate() && e.followed) system_.stop(now_.x, at_rest);
        }
        course_.rate = at.rate();
        course_.rate_known = at.carries_rate();
        course_.input = at.input().values();
    }

    // All the way to `limit`, where there is no guard. False if the motion leaves the range of the arithmetic: then the
    // event_checks find out when.
    [[gnu::noinline]] bool leap(const Entry& e, double limit) {
        *there_ = *begin_;
        there_->leap_to(limit);
        if (!moderate(there_->rate())) return false;
        ++event_checks_;
        time_ = limit;
        now_.x = there_->x();
        keep_course(e, *there_);
        return true;
    }

    // Speeds that are multiples of the rate of the twist are as accurate as that.
    [[gnu::always_inline]] static void evaluate(const Entry& e, const typename GuardTable::Values& constant, Cursor& at,
                                                Ends& out) {
        e.guards.evaluate(constant, at.x(), at.input(), out.value);
        e.guards.rates(at.rate(), at.input(), out.slope);
        if (!at.carries_rate()) return;
        for (int k = 0; k < e.n_twist_speeds; ++k) {
            const auto& s = e.twist_speeds[k];
            out.value[s.guard] = s.factor * at.rate()[e.twists[s.twist].state];
        }
    }

    // |g''''| over the event check, from a bound on the fourth derivative of the state that the flow carries on.
    [[gnu::always_inline]] void bound_fourth(const GuardTable& guards, const Matrix& exponential_bound,
                                             const Coupled& magnitude) {
        State bound;
        (exponential_bound * magnitude).store(bound.data());
        guards.rate_magnitudes(bound, input_bound_, bounds_.fourth);
    }

    // Encloses all guards over a event check of length h. Returns, as bits, those that are not certain to be positive
    // all through it.
    Guards enclose(int rows, const Ends& here, const Ends& there, double h) {
        const double third = h / 3.0, share = h * h * h * h / 384.0;
        Guards doubtful = 0;
        unsigned tight = 0;
        for (int g = 0; g < rows; g += vec_width) {
            const Vec begin = load(&here.value[g]), end = load(&there.value[g]);
            const Vec c1 = begin + third * load(&here.slope[g]), c2 = end - third * load(&there.slope[g]);
            const Vec low = min_of(min_of(begin, end), min_of(c1, c2)), error = share * load(&bounds_.fourth[g]);
            store(low, &bounds_.lower[g]);
            store(error, &bounds_.error[g]);
            const unsigned clear = above(low, error);
            // One that starts on zero or above and rises all through is certain, too.
            const Vec rise = min_of(c1 - begin, min_of(c2 - c1, end - c2));
            const unsigned rises = above(rise, slope_share * error) & ~above(Vec{}, begin);
            doubtful |= Guards{all_bits & ~(clear | rises)} << g;
            tight |= clear & ~above(low, 64.0 * error);
        }
        roomy_ = tight == 0;
        return doubtful;
    }

    Verdict judge(Entry& e, const Memory& memory, const Cursor& cursor, const Ends& here, const Ends& there, double h,
                  bool shortest) {
        Guards doubtful = enclose(e.guards.rows(), here, there, h);
        n_crossing_ = 0;
        // What counts as zero when the speed of a twist grazes it.
        std::array<double, D::twists> grazing{};
        for (int t = 0; t < e.n_twists; ++t) {
            const int g = e.twists[t].grazing_guard;
            if (g < 0) continue;
            auto& twist = course_.twist[t];
            twist.grazing_magnitude = std::max(twist.grazing_magnitude, e.grazing_magnitude(e.twists[t], cursor.x()));
            grazing[t] =
                cursor.carries_rate() ? twist_speed_rounding(e, t, cursor) : rounding * twist.grazing_magnitude;
            twist.off_zero |= here.value[g] > grazing[t];
            if (bounds_.lower[g] <= grazing[t]) doubtful |= Guards{1} << g;
        }
        doubtful &= ~e.behind;
        if (doubtful == 0) return Verdict::clear;
        const Memory memory_magnitudes = magnitudes(memory);
        const State state_magnitudes = magnitudes(cursor.x());
        for (; doubtful != 0; doubtful &= doubtful - 1) {
            const int g = std::countr_zero(doubtful);
            const double low = bounds_.lower[g], error = bounds_.error[g];
            const Cubic c(here.value[g], here.slope[g], there.value[g], there.slope[g], h);
            const int t = e.grazing_twist(g);
            const double near = t >= 0 ? grazing[t] : 0.0;
            const bool grazes = t >= 0 && course_.twist[t].off_zero && low - error <= near && c.c3 > near;
            if (low > error && !grazes) continue;
            const double magnitude = e.guards.magnitude(g, memory_magnitudes, state_magnitudes, cursor.input());
            const auto of_rate = rate_multiple(e, cursor, g);
            const double resolution = of_rate.factor != 0.0
                                          ? std::fabs(of_rate.factor) * twist_speed_rounding(e, of_rate.twist, cursor)
                                          : rounding * magnitude;
            const double tolerance = resolution + time_rounding * std::fabs(time_) *
                                                      std::max(std::fabs(here.slope[g]), std::fabs(there.slope[g]));
            if (low - error >= -tolerance && !grazes) continue;
            const double d0 = c.c1 - c.c0, d1 = c.c2 - c.c1, d2 = c.c3 - c.c2;
            const bool rises = std::min(d0, std::min(d1, d2)) > slope_share * error;
            const bool falls = std::max(d0, std::max(d1, d2)) < -slope_share * error;
            if (rises && c.c0 >= -tolerance && !(grazes && c.c0 <= near)) continue;
            if (falls && c.c3 >= -tolerance) continue;
            const bool starts_on_zero = c.c0 <= rounding * magnitude;
            if (falls) {
                crossing_[n_crossing_++] = {g, false, starts_on_zero};
                continue;
            }
            if (c.c0 <= tolerance && !grazes && departs(e, memory, cursor, g, h)) continue;
            const double resolved = grazes ? near : tolerance;
            if (error > resolved && !shortest) {
                // Half the length has a sixteenth of the error, which ought to be small beside what the guard does.
                const double course = std::max(std::max(std::fabs(c.c0), std::fabs(c.c3)),
                                               h * std::max(std::fabs(here.slope[g]), std::fabs(there.slope[g])));
                halvings_ = 1;
                for (double left = error / 16.0; left > 0.25 * course && halvings_ < 10; left /= 16.0) ++halvings_;
                return Verdict::uncertain;
            }
            // The cubic is the guard to rounding, or as near as the shortest event check comes; does it dip below zero?
            const double lowest = c(c.lowest_at());
            if (lowest < -std::max(tolerance, error))
                crossing_[n_crossing_++] = {g, false, starts_on_zero};
            else if (grazes && lowest <= resolved)
                crossing_[n_crossing_++] = {g, true, starts_on_zero};
        }
        return n_crossing_ > 0 ? Verdict::crossing : Verdict::clear;
    }

    // Rounding of the speed of the twist where it is its rate, carried on from where the regime began. The doubt there
    // dies out with the motion; where the motion grows, it is one that began with another rounding.
    double twist_speed_rounding(Entry& e, int t, const Cursor& at) const {
        const double bound = bound_ahead(e, coupled(at.rate()))[e.twists[t].state];
        return rounding * bound + std::fmin(course_.twist[t].doubt * bound, course_.twist[t].most_doubt);
    }
    // Where the rate is carried on: how many times the rate of a twist a guard is.
    static typename Entry::TwistSpeed rate_multiple(const Entry& e, const Cursor& at, int g) {
        return at.carries_rate() ? e.twist_speed(g) : typename Entry::TwistSpeed{g, 0, 0.0};
    }

    // A guard that starts on zero: does its first derivative that is not zero carry it away, all through the event
    // check?
    bool departs(const Entry& e, const Memory& memory, const Cursor& cursor, int g, double h) const {
        const auto [first, derivative] = departure(e, memory, cursor, g);
        if (first == 0) return false;
        // value = h^k (derivative_k / k! + what follows), bounded at the far end.
        double lower = derivative[first] * over_factorial[first], power = h;
        for (int k = first + 1; k < 4; ++k, power *= h)
            lower += power * std::min(0.0, derivative[k]) * over_factorial[k];
        return lower > power * bounds_.fourth[g] * over_factorial[4];
    }
    // The order of the first derivative of a guard, up to the third, that is not zero; 0 if there is none or it is
    // negative.
    struct Departure {
        std::size_t order = 0;
        std::array<double, 4> derivative{};
    };
    Departure departure(const Entry& e, const Memory& memory, const Cursor& cursor, int g) const {
        const InstantOf<D> now{time_, cursor.x(), memory, cursor.input().jet(), cursor.input().magnitudes()};
        Flow<D> flow(e.rates, now);
        const LinearForm form = e.guards.form(g);
        Departure out;
        for (std::size_t k = 1; k < 4; ++k) {
            const double value = out.derivative[k] = flow.rate(form, static_cast<int>(k));
            if (out.order > 0) continue;
            const double resolution = rounding * flow.rate_magnitude(form, static_cast<int>(k));
            if (value < -resolution) return out;
            if (value > resolution) out.order = k;
        }
        return out;
    }

    // Earliest of the certified crossings; there_ is left at it.
    void first_crossing(Entry& e, const Memory& memory, const Cursor& cursor, const Ends& here, const Ends& there,
                        double h, const Guard*& fired) {
        double best = std::numeric_limits<double>::infinity();
        const auto cubic = [&](int g) {
            return Cubic(here.value[g], here.slope[g], there.value[g], there.slope[g], h);
        };
        std::array<double, D::guards> estimate;
        for (int k = 0; k < n_crossing_; ++k) {
            const auto& [g, grazing, starts_on_zero] = crossing_[k];
            const Cubic c = cubic(g);
            estimate[g] = grazing ? c.lowest_at() : c.zero(c.c3 < 0.0 && c.slope(1.0) <= 0.0 ? 1.0 : c.lowest_at());
        }
        if (n_crossing_ > 1)
            std::sort(crossing_.begin(), crossing_.begin() + n_crossing_,
                      [&](const Crossing& a, const Crossing& b) { return estimate[a.guard] < estimate[b.guard]; });
        for (int k = 0; k < n_crossing_; ++k) {
            const auto& [g, grazing, starts_on_zero] = crossing_[k];
            // Still positive where another has crossed: later.
            if (k > 0 && cubic(g)(best / h) > bounds_.error[g]) continue;
            double s = estimate[g] * h;
            if (grazing) {
                trial_->advance_from(cursor, s);
            } else {
                s = find_zero(e, g, memory, cursor, starts_on_zero, s, h);
            }
            if (s < best) {
                best = s;
                std::swap(there_, trial_);
                fired = &e.regime.guards[g];
            }
        }
    }

    // A guard that starts on zero and rises, by the derivative of this order: where it comes back to zero before `end`,
    // at most one base interval on; else `end`. Leaves trial_ there.
    [[gnu::cold]] double first_return(const LinearForm& form, const Cursor& cursor, std::size_t order, double end) {
        cursor.expand(expansion_);
        Polynomial guard = expansion_.polynomial(form, 0.0);
        for (std::size_t k = 1; k < order; ++k) guard.part[0].set(static_cast<int>(k - 1), 0.0);
        double low = 0.0, high = end;
        if (guard.value(end) < 0.0)
            while (high - low > 4.0 * std::numeric_limits<double>::epsilon() * high) {
                const double middle = 0.5 * (low + high);
                (guard.value(middle) > 0.0 ? low : high) = middle;
            }
        *trial_ = cursor;
        trial_->taylor_step(expansion_, high);
        return high;
    }

    // Where a guard falls through zero within h, near an estimate. Leaves trial_ there,
    // returns when. About the nearest instant that whole levels lead to, the guard is a polynomial to rounding.
    double find_zero(Entry& e, int g, const Memory& memory, const Cursor& cursor, bool starts_on_zero, double estimate,
                     double h) {
        const LinearForm form = e.guards.form(g);
        const double base = e.propagator.length(0);
        double low = 0.0, high = h, s = estimate;
        if (starts_on_zero) {
            if (const auto order = departure(e, memory, cursor, g).order; order > 0) {
                const double end = std::min(h, base);
                if (const double z = first_return(form, cursor, order, end); z < end) return z;
                low = end;
                s = std::clamp(estimate, low, h);
            }
        }
        const double earliest = low;
        for (int m = 0; m < 100; ++m) {
            const double rest = trial_->advance_by_levels(cursor, s), from = s - rest;
            const auto of_rate = rate_multiple(e, *trial_, g);
            const double value = of_rate.factor != 0.0
                                     ? of_rate.factor * trial_->rate()[e.twists[of_rate.twist].state]
                                     : lostmotion::evaluate<D>(form, trial_->x(), memory, trial_->input().values());
            trial_->expand(expansion_);
            const Polynomial guard = expansion_.polynomial(form, value);
            const double reach = std::fabs(rest) + 0.25 * base, at = trial_->time();
            double z = rest;
            bool found = false;
            for (int n = 0; n < 60 && !found && std::fabs(z) <= reach; ++n) {
                // Halley's method
                const double f = guard.value(z), slope = guard.slope(z);
                const double moved = -f * slope / (slope * slope - f * guard.half_curvature(z));
                z += moved;
                found = std::fabs(moved) <= converging * std::fabs(z) || at + moved == at;
            }
            if (found && std::fabs(z) <= reach && (from + z >= earliest || earliest == 0.0)) {
                s = std::clamp(from + z, 0.0, h);
                trial_->taylor_step(expansion_, s - from);
                return s;
            }
            // The zero lies elsewhere: where the last step led, or in half of what is left.
            (value > 0.0 ? low : high) = from;
            s = from + z;
            if (!(s > low && s < high)) s = 0.5 * (low + high);
        }
        trial_->advance_from(cursor, s);
        return s;
    }

    const System& system_;
    Signals signals_;
    std::unique_ptr<Cache> own_;
    Cache& cache_;
    State scale_;
    double unit_;

    double time_ = 0.0;
    double breakpoint_ = 0.0;  // [s], the next of the inputs; it has been found if it lies ahead
    InstantOf<D> now_;
    Key key_;
    int last_level_ = first_level;
    long event_checks_ = 0;
    std::size_t switchings_ = 0;
    PhaseRotations& rotations_;
    // Where the present segment begins, the two ends of a event check, and one that is tried out. They change their
    // roles, not their contents.
    std::array<Cursor, 4> cursors_;
    Cursor *begin_ = &cursors_[0], *here_ = &cursors_[1], *there_ = &cursors_[2], *trial_ = &cursors_[3];
    InputsOf<D> input_bound_;  // on the fourth derivative of each, for all time
    Expansion expansion_;
    int crossings_ = 0;
    Ends ends_[2];
    Bounds bounds_;
    int halvings_ = 1;    // how many times an uncertain event check ought to be halved
    bool roomy_ = false;  // in the last event check the guards that were clear were so by far
    struct Crossing {
        int guard;
        bool grazing, starts_on_zero;
    };
    std::array<Crossing, D::guards> crossing_{};
    int n_crossing_ = 0;
    Course course_;
    Accumulation accumulation_;
    bool jump_pending_ = false;
    Contact stopped_at_{};
};

}  // namespace lostmotion
