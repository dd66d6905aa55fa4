// The exact solver: from regime to regime, by matrix exponentials.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <optional>
#include <utility>

#include "../base/interruption.hpp"
#include "../kernel/cursor.hpp"
#include "course.hpp"
#include "regime_cache.hpp"
#include "switching.hpp"

namespace lostmotion {

// A stretch of time spent in one regime, from which an observer can evaluate the exact state at any instant.
template <class System>
struct Segment {
    using Entry = typename RegimeCache<System>::Entry;
    const System& system;
    Entry& entry;
    const Cursor<typename System::Dims>& at;  // where it begins
    double begin, end;                        // [s]
    bool last;                                // no further segment follows in this call: `end` belongs to it
    typename System::Dims::Memory memory;
    ColumnOf<typename System::Dims> constant;  // the part of dx/dt that depends on neither state nor inputs
    StateOf<typename System::Dims> x_end;      // at end, before any stop there
};

template <class System_>
class ExactSolver {
 public:
    using System = System_;
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
    using Signals = SignalsOf<D>;
    using Course = CourseOf<D>;
    using Cursor = lostmotion::Cursor<D>;
    using InputState = lostmotion::InputState<D>;
    using Propagator = lostmotion::Propagator<D>;
    using Expansion = lostmotion::Expansion<D>;
    using Observer = lostmotion::Observer<System>;

    // unit: a length of time [s] that is to be a power-of-two multiple of the elementary steps, such as the
    // sampling interval. scale: natural magnitudes of the states.
    // shared: regimes of the same system that an earlier solver has left, if any.
    ExactSolver(const System& system, const Signals& signals, double unit, const State& scale, Cache* shared = nullptr);
    ExactSolver(const ExactSolver&) = delete;
    ExactSolver& operator=(const ExactSolver&) = delete;

    Interruption interruption;
    // Of the search of modes, too.
    void set_interruption(const Interruption& i) { interruption = system_.search().interruption = i; }

    double time() const { return time_; }
    const State& state() const { return now_.x; }
    const Memory& memory() const { return now_.memory; }
    const Key& key() const { return key_; }
    const Regime& regime() { return cache_.regime(key_); }
    const LinearRatesOf<D>& linear_rates() { return cache_.entry(key_).rates; }
    const Regime& regime(const Key& key) { return cache_.regime(key); }
    Cache& cache() { return cache_; }
    const std::vector<InputBasis>& basis() const { return rotations_.basis(); }
    double unit() const { return unit_; }
    // What the last switching was of, or what jams.
    Contact stopped_at() const {
        const int jams = jams_at(system_);
        return jams < 0 ? stopped_at_ : jams;
    }
    long event_checks() const { return event_checks_; }
    std::size_t switchings() const { return switchings_; }

    // Sets the state and finds the regime it is in.
    Status begin(double time, const State& x, const Memory& memory);
    // Continues from a state with a known regime.
    void resume(double time, const State& x, const Memory& memory, const Key& key, const Course& course = {}) {
        set_time(time);
        now_.x = x;
        make_room<D>(now_.x, system_.counts());
        now_.memory = memory;
        key_ = key;
        course_ = course;
    }
    const Course& course() const { return course_; }
    // From now on the input is value + slope * (t - now). Only for signals made with ramped_inputs().
    void set_ramp(int input, double value, double slope) { signals_[input].breakpoints[0] = {time_, value, slope}; }
    // Another solver of the same system, inputs and regimes. Made before a run begins.
    std::unique_ptr<ExactSolver> twin() const;
    // To where another is, with the same inputs. What follows is inputs_changed().
    void follow(const ExactSolver& o);
    // Of the inputs, the left limit.
    InputsOf<D> input_before(double t, const State&) const;
    // The inputs have changed at this instant: finds the regime anew.
    Status inputs_changed(Observer& observer);
    Status inputs_changed() {
        Observer nobody;
        return inputs_changed(nobody);
    }

    // Runs to t_end. The observer gets every segment as it comes and, if it wants them, the switchings between.
    Status advance(double t_end, Observer& observer);

 private:
    static constexpr double converging = 1e-7;  // the next correction is less than the square of the last
    static constexpr int first_level = 6;       // of the first event check
    // The search for the modes after a switching takes up to that much of the time of an event check.
    static constexpr unsigned steps_of_a_search = 8;
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

    Status change_regime(const Guard* fired, Observer& observer);

    enum class Verdict { clear, crossing, uncertain };

    // Guards at one end of an event check.
    struct Ends {
        typename GuardTable::Values value, slope;
    };
    // Guards all through it: a lower bound of their cubics, and how far they may lie from these.
    struct Bounds {
        typename GuardTable::Values lower, error, fourth;
    };

    // What is known beside the state: exact_course.hpp.
    static bool moderate(const State& rate) { return sum_of(absolute(coupled(rate))) < 1e100; }
    [[gnu::noinline]] bool has_settled(const Regime& regime, const State& rate) const;
    bool rest_unforced(Entry& e, const State& rate);
    [[gnu::cold]] void follow_inputs(const Key& before, const State& x_before);
    Coupled bound_ahead(Entry& e, const Coupled& x) const;
    void begin_in_doubt(Entry& e, const Cursor& at, const Memory& memory);
    [[gnu::cold]] void rest(const Segment<System>& segment, const Cursor& at, double limit);
    [[gnu::cold]] void keep_course(const Entry& e, const Cursor& at);
    double twist_speed_rounding(Entry& e, int t, const Cursor& at) const;
    // Where the rate is carried on: how many times the rate of a twist a guard is.
    static typename Entry::TwistSpeed rate_multiple(const Entry& e, const Cursor& at, int g) {
        return at.carries_rate() ? e.twist_speed(g) : typename Entry::TwistSpeed{g, 0, 0.0};
    }

    // Event checks: exact_event_check.hpp.
    // The order of the first derivative of a guard, up to the third, that is not zero; 0 if there is none or it is
    // negative.
    struct Departure {
        std::size_t order = 0;
        std::array<double, 4> derivative{};
    };
    Status run_regime(const Segment<System>& segment, double limit, const Guard*& fired);
    [[gnu::noinline]] bool leap(const Entry& e, double limit);
    [[gnu::always_inline]] static void evaluate(const Entry& e, const typename GuardTable::Values& constant, Cursor& at,
                                                Ends& out);
    [[gnu::always_inline]] void bound_fourth(const GuardTable& guards, Propagator& p, int level,
                                             const Coupled& magnitude);
    Guards enclose(int rows, const Ends& here, const Ends& there, double h);
    Verdict judge(Entry& e, const Memory& memory, const Cursor& cursor, const Ends& here, const Ends& there, double h,
                  bool shortest);
    bool departs(const Entry& e, const Memory& memory, const Cursor& cursor, int g, double h) const;
    Departure departure(const Entry& e, const Memory& memory, const Cursor& cursor, int g) const;

    // Roots: exact_roots.hpp.
    [[gnu::cold]] double first_turn(Entry& e, double limit);
    void first_crossing(Entry& e, const Memory& memory, const Cursor& cursor, const Ends& here, const Ends& there,
                        double h, const Guard*& fired);
    [[gnu::cold]] double first_return(const LinearForm& form, const Cursor& cursor, std::size_t order, double end);
    double find_zero(Entry& e, int g, const Memory& memory, const Cursor& cursor, bool starts_on_zero, double estimate,
                     double h);

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
    // Where the present segment begins, the two ends of an event check, and one that is tried out. They change their
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
        double estimate = 0.0;  // of when, as a share of the event check
    };
    ListOf<D, Crossing, D::guards> crossing_{};
    ListOf<D, double, D::twists> grazing_{};  // by twist: what counts as zero when its speed grazes it
    int n_crossing_ = 0;
    Course course_;
    Accumulation accumulation_;
    bool jump_pending_ = false;
    Contact stopped_at_{};
};

template <class System>
ExactSolver<System>::ExactSolver(const System& system, const Signals& signals, double unit, const State& scale,
                                 Cache* shared)
    : system_(system),
      signals_(without_idle_sines(signals)),
      own_(shared == nullptr ? std::make_unique<Cache>(system) : nullptr),
      cache_(shared == nullptr ? *own_ : *shared),
      scale_(scale),
      unit_(elementary(unit)),
      rotations_(cache_.serve(unit_, input_basis(signals_))),
      cursors_{start(), start(), start(), start()},
      input_bound_(begin_->input().fourth_derivative_bound()) {}

template <class System>
Status ExactSolver<System>::begin(double time, const State& x, const Memory& memory) {
    set_time(time);
    course_ = {};
    switchings_ = 0;
    now_.x = x;
    make_room<D>(now_.x, system_.counts());
    now_.memory = memory;
    anchor_inputs();
    course_.input = now_.input[0];
    return status_of(system_.start(now_, key_));
}

template <class System>
std::unique_ptr<ExactSolver<System>> ExactSolver<System>::twin() const {
    return std::make_unique<ExactSolver>(system_, signals_, unit_, scale_, &cache_);
}

template <class System>
void ExactSolver<System>::follow(const ExactSolver& o) {
    resume(o.time_, o.now_.x, o.now_.memory, o.key_, o.course_);
    for (std::size_t i = 0; i < signals_.size(); ++i)
        if (signals_[i].breakpoints.size() == 1) signals_[i].breakpoints[0] = o.signals_[i].breakpoints[0];
}

template <class System>
InputsOf<typename System::Dims> ExactSolver<System>::input_before(double t, const State&) const {
    InputState input(signals_, rotations_.basis());
    input.anchor_left(t);
    return input.values();
}

template <class System>
Status ExactSolver<System>::inputs_changed(Observer& observer) {
    const Key before = key_;
    const State x_before = now_.x;
    anchor_inputs();
    bool changed = false;
    const Status status =
        follow_change<System, Cache, D>(system_, cache_, course_.input, now_, key_, observer, changed);
    switchings_ += changed;
    follow_inputs(before, x_before);
    return status;
}

template <class System>
Status ExactSolver<System>::advance(double t_end, Observer& observer) {
    begin_->inputs().anchor(time_);
    crossings_ = 0;  // so that what follows depends on the state alone
    if (jump_pending_) {
        jump_pending_ = false;
        const Status status = change_regime(nullptr, observer);
        if (status != Status::done) return status;
    }
    while (true) {
        if (interruption(steps_of_a_search)) return Status::interrupted;
        if (cache_.is_full()) [[unlikely]] {
            if (!observer.flush()) return Status::interrupted;  // what has been seen refers to regimes
            cache_.forget();
        }
        Entry& entry = cache_.entry(key_);
        if (!entry.propagator.ready()) cache_.prepare(entry, rotations_, scale_);
        Segment<System> segment{
            system_, entry, *begin_, time_, t_end, true, now_.memory, entry.rates.constant(now_.memory), now_.x};
        begin_->place(entry.propagator, segment.constant, now_.x, course_.rate_known ? &course_.rate : nullptr);
        if (begin_->constant_inputs()) {
            if (has_settled(*entry.regime, begin_->rate())) begin_->settle();
        } else if (rest_unforced(entry, begin_->rate())) {
            segment.x_end = now_.x;
            begin_->place(entry.propagator, segment.constant, now_.x);
        }
        if (!(time_ < breakpoint_)) breakpoint_ = next_breakpoint(signals_, time_);
        double limit = std::min(t_end, breakpoint_);
        if (const Regime& r = *entry.regime; r.driving_input >= 0) [[unlikely]]
            limit = begin_->input().turning(r.driving_input, r.driving_way, limit, interruption);
        else if (follows_inputs(r)) [[unlikely]]
            limit = first_turn(entry, limit);
        if (interruption.requested()) [[unlikely]]
            return Status::interrupted;
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

template <class System>
Status ExactSolver<System>::change_regime(const Guard* fired, Observer& observer) {
    if (fired != nullptr) {
        std::swap(begin_, there_);
        const auto* given = begin_->given();
        if (++crossings_ % 8 == 0 || given != nullptr) begin_->inputs().anchor(time_);
        if (given != nullptr) [[unlikely]]
            for (const GivenState& g : *given)
                now_.x[static_cast<std::size_t>(g.state)] = begin_->input().given_at(g, time_);
    }
    std::optional<std::pair<Key, State>> before;
    if (fired == nullptr) before.emplace(key_, now_.x);
    const Status status = switch_regime(system_, cache_, begin_->inputs(), time_, fired, now_, key_, observer);
    if (fired != nullptr) stopped_at_ = fired->subject();
    if (status != Status::done) return status;
    if (before)
        follow_inputs(before->first, before->second);
    else
        course_.forget();
    ++switchings_;
    const Status crowded = accumulation_.add(time_, unit_, [this]() -> auto& { return linear_rates(); });
    if (crowded != Status::zeno || !accumulation_.may_begin_anew()) return crowded;
    // Speeds that have come to nothing in ever shorter times are at rest for a run that begins here.
    course_ = {};
    course_.input = now_.input[0];
    return status_of(system_.start(now_, key_));
}

}  // namespace lostmotion
