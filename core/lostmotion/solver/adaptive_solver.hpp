// Adaptive solver: Dormand and Prince's embedded Runge-Kutta pair 5(4) with Shampine's dense output, over the same
// regimes, plus what is not piecewise linear: a second opinion on the exact solver. Of a train, what the chords of a
// law leave of it enters as further inputs, so that modes, reactions, guards and energies see it.
//
// J. R. Dormand, P. J. Prince: A family of embedded Runge-Kutta formulae, J. Comput. Appl. Math. 6 (1980) 19-26.
// L. F. Shampine: Some practical Runge-Kutta formulas, Math. Comput. 46 (1986) 135-150.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <memory>
#include <optional>
#include <type_traits>
#include <utility>

#include "../base/powers.hpp"
#include "exact_solver.hpp"

namespace lostmotion {

struct DormandPrince {
    static constexpr int stages = 7;
    static constexpr std::array<double, stages> c{0.0, 1.0 / 5, 3.0 / 10, 4.0 / 5, 8.0 / 9, 1.0, 1.0};
    static constexpr double a[stages][stages] = {
        {},
        {1.0 / 5},
        {3.0 / 40, 9.0 / 40},
        {44.0 / 45, -56.0 / 15, 32.0 / 9},
        {19372.0 / 6561, -25360.0 / 2187, 64448.0 / 6561, -212.0 / 729},
        {9017.0 / 3168, -355.0 / 33, 46732.0 / 5247, 49.0 / 176, -5103.0 / 18656},
        {35.0 / 384, 0.0, 500.0 / 1113, 125.0 / 192, -2187.0 / 6784, 11.0 / 84},
    };
    // Weights of order 5 minus weights of order 4.
    static constexpr std::array<double, stages> error{71.0 / 57600,      0.0,        -71.0 / 16695, 71.0 / 1920,
                                                      -17253.0 / 339200, 22.0 / 525, -1.0 / 40};
    // Quartic dense output: x(t + s h) = x + h sum_i k_i (d[i][0] s + d[i][1] s^2 + d[i][2] s^3 + d[i][3] s^4).
    static constexpr double dense[stages][4] = {
        {1.0, -8048581381.0 / 2820520608.0, 8663915743.0 / 2820520608.0, -12715105075.0 / 11282082432.0},
        {},
        {0.0, 131558114200.0 / 32700410799.0, -68118460800.0 / 10900136933.0, 87487479700.0 / 32700410799.0},
        {0.0, -1754552775.0 / 470086768.0, 14199869525.0 / 1410260304.0, -10690763975.0 / 1880347072.0},
        {0.0, 127303824393.0 / 49829197408.0, -318862633887.0 / 49829197408.0, 701980252875.0 / 199316789632.0},
        {0.0, -282668133.0 / 205662961.0, 2019193451.0 / 616988883.0, -1453857185.0 / 822651844.0},
        {0.0, 40617522.0 / 29380423.0, -110615467.0 / 29380423.0, 69997945.0 / 29380423.0},
    };
};

// A remainder adds to the linear rates; called as remainder(t, x, rate). What holds a contact at rest, the guards and
// the energy do not see it. So it is refused for a drive with dry contacts: one that is stuck would stay so against any
// torque, and gain speed.
struct NoRemainder {
    template <class State>
    void operator()(double, const State&, State&) const {}
};

// One accepted stretch of the solution; evaluates the state anywhere on it.
template <class D>
struct DenseStepOf {
    using State = StateOf<D>;

    double begin = 0.0, length = 0.0, end = 0.0;  // [s]; used up to `end` <= begin + length
    State x{};
    std::array<State, DormandPrince::stages> k{};

    State operator()(double t) const {
        const double s = length > 0.0 ? (t - begin) / length : 0.0;
        State out = x;
        for (int i = 0; i < DormandPrince::stages; ++i) {
            const double* d = DormandPrince::dense[i];
            add_scaled(out, length * s * (d[0] + s * (d[1] + s * (d[2] + s * d[3]))), k[i]);
        }
        return out;
    }
};

template <class System_, class Remainder = NoRemainder>
class AdaptiveSolver {
 public:
    using System = System_;
    using D = typename System::Dims;
    using Cache = RegimeCache<System>;
    using Regime = typename System::Regime;
    using Key = typename System::Key;
    using Guard = typename System::Guard;
    using GuardTable = typename Cache::GuardTable;
    using Contact = typename D::Contact;
    using Memory = typename D::Memory;
    using State = StateOf<D>;
    using Signals = SignalsOf<D>;
    using Inputs = InputsOf<D>;
    using DenseStep = DenseStepOf<D>;
    using Observer = lostmotion::Observer<System>;

    AdaptiveSolver(const System& system, const Signals& signals, double relative_tolerance, const State& scale,
                   Remainder remainder = {})
        : system_(system),
          signals_(without_idle_sines(signals)),
          basis_(input_basis(signals_)),
          cache_(system),
          tolerance_(relative_tolerance),
          scale_(scale),
          remainder_(remainder),
          input_(signals_, basis_) {
        // A drive at rest has nothing to control the error of; its inputs are to be looked at all the same.
        for (const InputBasis& b : basis_)
            if (b.omega > 0.0) longest_step_ = std::min(longest_step_, 0.4 / b.omega);
    }
    AdaptiveSolver(const AdaptiveSolver&) = delete;
    AdaptiveSolver& operator=(const AdaptiveSolver&) = delete;

    Interruption interruption;
    void set_interruption(const Interruption& i) { interruption = system_.search().interruption = i; }

    double time() const { return time_; }
    const State& state() const { return now_.x; }
    const Memory& memory() const { return now_.memory; }
    const Regime& regime() { return cache_.regime(key_); }
    const LinearRatesOf<D>& linear_rates() { return cache_.entry(key_).rates; }
    const std::vector<InputBasis>& basis() const { return basis_; }
    Contact stopped_at() const {
        const int jams = jams_at(system_);
        return jams < 0 ? stopped_at_ : jams;
    }
    long steps() const { return steps_; }
    std::size_t switchings() const { return switchings_; }

    Status begin(double time, const State& x, const Memory& memory) {
        if (!std::is_same_v<Remainder, NoRemainder> && system_.has_dry_contacts()) return Status::unseen;
        time_ = time;
        now_.x = x;
        make_room<D>(now_.x, system_.counts());
        now_.memory = memory;
        input_.anchor(time_);
        see_inputs(system_, input_, time_, now_);
        step_ = 0.0;
        switchings_ = 0;
        left_.reset();
        return status_of(system_.start(now_, key_));
    }

    // As of the exact solver.
    std::unique_ptr<AdaptiveSolver> twin() const {
        return std::make_unique<AdaptiveSolver>(system_, signals_, tolerance_, scale_, remainder_);
    }
    void follow(const AdaptiveSolver& o) {
        time_ = o.time_;
        now_ = o.now_;
        key_ = o.key_;
        step_ = o.step_;
        for (std::size_t i = 0; i < signals_.size(); ++i)
            if (signals_[i].breakpoints.size() == 1) signals_[i].breakpoints[0] = o.signals_[i].breakpoints[0];
        left_.reset();
    }
    void set_ramp(int input, double value, double slope) {
        if (!left_) left_ = input_before(time_, now_.x);
        signals_[input].breakpoints[0] = {time_, value, slope};
    }
    Status inputs_changed(Observer& observer) {
        input_.anchor(time_);
        see_inputs(system_, input_, time_, now_);
        bool changed = false;
        const Status status = follow_change<System, Cache, D>(system_, cache_, *std::exchange(left_, std::nullopt),
                                                              now_, key_, observer, changed);
        switchings_ += changed;
        return status;
    }

    // The observer finds the inputs at any time through `input_at`.
    Status advance(double t_end, Observer& observer) {
        t_end_ = t_end;
        while (time_ < t_end) {
            if (cache_.is_full()) cache_.forget();
            double limit = std::fmin(t_end, next_breakpoint(signals_, time_));
            if (const Regime& r = cache_.regime(key_); r.driving_input >= 0) {
                input_.anchor(time_);
                limit = input_.turning(r.driving_input, r.driving_way, limit, interruption);
                if (interruption.requested()) return Status::interrupted;
            }
            const Guard* fired = nullptr;
            const Status status = run_regime(limit, fired, observer);
            if (status != Status::done) return status;
            if (fired == nullptr && time_ >= t_end) break;
            const Status switched = change_regime(fired, observer);
            if (switched != Status::done) return switched;
        }
        return Status::done;
    }

    Inputs input_at(double t, const State& x) {
        input_.anchor(t);
        return with_remainders(x);
    }
    // The left limit, for the end of the last step.
    Inputs input_before(double t, const State& x) {
        input_.anchor_left(t);
        return with_remainders(x);
    }

 private:
    Inputs with_remainders(const State& x) const {
        Inputs u = input_.values();
        if constexpr (requires { system_.set_remainders(key_, x, now_.memory, u); })
            system_.set_remainders(key_, x, now_.memory, u);
        return u;
    }

    Status change_regime(const Guard* fired, Observer& observer) {
        if (fired != nullptr) input_.anchor(time_);
        const Status status = switch_regime(system_, cache_, input_, time_, fired, now_, key_, observer);
        if (fired != nullptr) stopped_at_ = fired->subject();
        if (status != Status::done) return status;
        ++switchings_;
        return accumulation_.add(time_, 1.0, [this] { return linear_rates(); });
    }

    State rates(const LinearRatesOf<D>& linear, const ColumnOf<D>& constant, double t, const State& x) {
        State out = linear(x, constant, input_at(t, x));
        remainder_(t, x, out);
        return out;
    }

    // Guards at one end of a step.
    struct Ends {
        typename GuardTable::Values value, slope;
    };
    // What a step is taken with: the regime and its parts that are constant in it.
    struct Motion {
        const typename Cache::Entry& entry;
        ColumnOf<D> fixed;
        typename GuardTable::Values constant;
        double limit;
    };

    Status run_regime(double limit, const Guard*& fired, Observer& observer) {
        const auto& entry = cache_.entry(key_);
        Motion motion{entry, entry.rates.constant(now_.memory), {}, limit};
        entry.guards.constants(now_.memory, motion.constant);
        DenseStep dense;
        Ends here, there;
        double h = step_ > 0.0 ? step_ : 1e-6;
        off_zero_ = {};
        dense.k[0] = rates(entry.rates, motion.fixed, time_, now_.x);
        evaluate_guards(motion, time_, now_.x, dense.k[0], here);
        while (time_ < limit) {
            ++steps_;
            if (interruption()) return Status::interrupted;
            h = std::min(h, longest_step_);
            const bool last = h >= limit - time_;
            if (last) h = limit - time_;
            State x;
            const double error = take_step(motion, h, dense, x);
            if (!(error < 1.0)) {
                if (!(h > 1e-14 * std::max(1.0, time_))) return Status::outside;
                h *= std::isfinite(error) ? std::clamp(0.9 * inverse_fifth_root(error), 0.2, 0.9) : 0.1;
                continue;
            }
            const double end = last ? std::nextafter(limit, time_) : time_ + h;
            evaluate_guards(motion, end, x, dense.k[DormandPrince::stages - 1], there);
            double t_event = end;
            fired = first_event(entry, here, there, dense, t_event);
            const bool turned = first_turn(entry, dense, end, t_event);
            if (turned) fired = nullptr;
            const bool ended = fired != nullptr || turned;
            dense.end = ended ? t_event : last ? limit : end;
            observer.step(*entry.regime, now_.memory, dense, !ended && last && limit >= t_end_);
            now_.x = ended ? dense(t_event) : x;
            time_ = dense.end;
            step_ = h;
            if (ended) return Status::done;
            dense.k[0] = dense.k[DormandPrince::stages - 1];
            std::swap(here, there);
            step_ = h *= std::clamp(0.9 * inverse_fifth_root(std::max(error, 1e-10)), 0.2, 5.0);
        }
        return Status::done;
    }

    void evaluate_guards(const Motion& motion, double t, const State& x, const State& rate, Ends& out) {
        input_.anchor(t);
        auto u = input_.template jet<2>();
        if constexpr (requires { system_.set_remainders(key_, x, now_.memory, u[0], &u[1]); })
            system_.set_remainders(key_, x, now_.memory, u[0], &u[1]);
        motion.entry.guards.evaluate(motion.constant, x, u[0], out.value);
        motion.entry.guards.rates(rate, u[1], out.slope);
    }

    // One step of length h from where dense.k[0] is known, to x. Returns the estimate of its error over what is
    // allowed.
    double take_step(const Motion& motion, double h, DenseStep& dense, State& x) {
        using DP = DormandPrince;
        dense.x = now_.x;
        dense.begin = time_;
        dense.length = h;
        // At a breakpoint the inputs of this regime are those before it.
        const double latest = std::nextafter(motion.limit, time_);
        x = {};
        for (int stage = 1; stage < DP::stages; ++stage) {
            x = now_.x;
            for (int j = 0; j < stage; ++j) add_scaled(x, h * DP::a[stage][j], dense.k[j]);
            dense.k[stage] = rates(motion.entry.rates, motion.fixed, std::min(time_ + DP::c[stage] * h, latest), x);
        }
        double error = 0.0;
        const CountsOf<D>& counts = system_.counts();
        each_state<D>(counts, [&](int n) {
            double e = 0.0;
            for (int j = 0; j < DP::stages; ++j) e += DP::error[j] * dense.k[j][n];
            const double allowed = tolerance_ * (scale_[n] + std::max(std::fabs(now_.x[n]), std::fabs(x[n])));
            error += (h * e / allowed) * (h * e / allowed);
        });
        return std::sqrt(error / (counts.coupled + counts.angles));
    }

    // The guard that ends the regime within the step, and when; nullptr if none does.
    const Guard* first_event(const typename Cache::Entry& entry, const Ends& here, const Ends& there,
                             const DenseStep& dense, double& t_event) {
        const double end = t_event;
        const Guard* crossed = nullptr;
        for (int g = 0; g < entry.n_guards; ++g) {
            if (entry.behind[g]) continue;
            const Guard& guard = entry.regime->guards[g];
            const Cubic c(here.value[g], here.slope[g], there.value[g], there.slope[g], dense.length);
            if (c.min() <= 0.0) refine_crossing(guard, dense, end, t_event, crossed);
            if (guard.by_grazing) find_grazing(g, guard, c, dense, t_event, crossed);
        }
        return crossed;
    }

    // Does a torque that goes along with the limit of a contact turn back within the step, before t_event? It leaves
    // that instant there.
    bool first_turn(const typename Cache::Entry& entry, const DenseStep& dense, double end, double& t_event) {
        bool turned = false;
        for (const auto& driver : entry.regime->drivers) {
            if (entry.regime->driving_input >= 0) break;  // the limit of the step
            const auto rate = [&](double t) {
                const State x = dense(t);
                const Inputs u = input_at(t, x), u_rate = input_.template jet<2>()[1];
                double sum = evaluate<D>(driver.rate, x, now_.memory, u),
                       size = solution_error(driver.rate, x) + rounding * magnitude<D>(driver.rate, x, now_.memory, u);
                for (const auto& [i, c] : driver.torque.of_inputs()) {
                    sum += c * u_rate[i];
                    size += rounding * std::fabs(c * u_rate[i]);
                }
                return sum + 2.0 * size;
            };
            turned = first_fall(rate, 0.0, dense, end, false, t_event) || turned;
        }
        return turned;
    }

    // Does the guard fall below zero within the step, before t_event?
    void refine_crossing(const Guard& guard, const DenseStep& dense, double end, double& t_event,
                         const Guard*& crossed) {
        const auto value = [&](double t) {
            const State x = dense(t);
            return evaluate<D>(guard.form, x, now_.memory, input_at(t, x));
        };
        // A solution of finite accuracy may tremble about a guard that the exact one only approaches.
        double noise = rounding * std::fmax(guard.size_at_least(), magnitude<D>(guard.form, dense.x, now_.memory,
                                                                                input_at(dense.begin, dense.x)));
        each_state_of<D>(guard.form, [&](int k, double c) { noise += noise_factor * std::fabs(c) * scale_[k]; });
        // The speed of the twist is a small difference, and each of its zeros sets the hysteresis anew: one that the
        // error of the solution may make is none.
        if (guard.by_grazing) noise += solution_error(guard.form, dense.x);
        if (first_fall(value, noise, dense, end, crossed == nullptr, t_event)) crossed = &guard;
    }

    // Looks for the first fall of a value below zero on a grid within the step, before t_event (or up to it), and
    // refines it by bisection on the dense output.
    template <class Value>
    static bool first_fall(const Value& value, double noise, const DenseStep& dense, double end, bool up_to,
                           double& t_event) {
        constexpr int parts_checked = 16;
        double low = dense.begin;
        for (int k = 1; k <= parts_checked; ++k) {
            double high = k == parts_checked ? end : dense.begin + dense.length * k / parts_checked;
            if (low >= t_event) return false;
            if (value(high) >= -noise) {
                low = high;
                continue;
            }
            const double resolution = 2.0 * std::numeric_limits<double>::epsilon() * std::max(1e-3, high);
            while (high - low > resolution) {
                const double middle = 0.5 * (low + high);
                (value(middle) > 0.0 ? low : high) = middle;
            }
            if (!(high < t_event || up_to)) return false;
            t_event = high;
            return true;
        }
        return false;
    }

    // Does the guard touch zero, as far as this solution can tell, and rise again?
    void find_grazing(int number, const Guard& guard, const Cubic& c, const DenseStep& dense, double& t_event,
                      const Guard*& crossed) {
        const double t = dense.begin + dense.length * c.lowest_at();
        const double near = grazing_factor * solution_error(guard.form, dense.x);
        if (c.c0 > near) off_zero_.set(number);
        if (!off_zero_[number] || c.c3 <= near || t >= t_event ||
            std::fabs(evaluate<D>(guard.form, dense(t), now_.memory, input_at(t, dense(t)))) > near)
            return;
        t_event = t;
        crossed = &guard;
    }

    // What the tolerance allows for in a form.
    double solution_error(const LinearForm& form, const State& x) const {
        double error = 0.0;
        each_state_of<D>(form,
                         [&](int k, double c) { error += tolerance_ * std::fabs(c) * (scale_[k] + std::fabs(x[k])); });
        return error;
    }

    static constexpr double noise_factor = 1e-14;
    static constexpr double grazing_factor = 10.0;

    const System& system_;
    Signals signals_;
    std::vector<InputBasis> basis_;
    Cache cache_;
    double tolerance_;
    State scale_;
    Remainder remainder_;
    InputState<D> input_;

    double longest_step_ = std::numeric_limits<double>::infinity();
    double time_ = 0.0, step_ = 0.0, t_end_ = 0.0;
    InstantOf<D> now_;
    std::optional<Inputs> left_;  // inputs before they were changed
    Key key_;
    long steps_ = 0;
    std::size_t switchings_ = 0;
    Accumulation accumulation_;
    typename Cache::Guards off_zero_;  // guards that may touch zero and have been off it in this regime
    Contact stopped_at_{};
};

}  // namespace lostmotion
