// Periodic motion under periodic inputs, by shooting: Newton's method on the map of the state over one period (the
// Poincare map), with its exact Jacobian. Where Newton does not converge, the transient is followed for a while. Under
// constant inputs the period of a limit cycle is one more unknown, and the phase is fixed by one more equation.
#pragma once

#include <limits>
#include <vector>

#include "lostmotion/analysis/rank_solve.hpp"
#include "sensitivity.hpp"

namespace lostmotion {

// All that it takes to continue a motion.
template <class System>
struct HybridStateOf {
    StateOf<typename System::Dims> x{};
    typename System::Dims::Memory memory{};
    typename System::Key key;
};

template <class System>
struct PeriodicMotionOf {
    using D = typename System::Dims;

    Status status = Status::done;
    double time = 0.0;  // [s] reached, if the status is not done
    typename D::Contact contact{};
    bool converged = false;
    bool smooth = true;           // whether the Jacobian is exact: no grazing among the switchings
    double period = 0.0;          // [s]
    int periods = 0;              // followed, all in all
    int newton_steps = 0;         // of the attempt that converged
    double residual = 0.0;        // largest change of a state over one period / its largest magnitude within it
    StateOf<D> advance{};         // of each state over one period: zero but for angles
    HybridStateOf<System> start;  // at t = 0
    JacobianOf<D> jacobian;       // of the map over one period, at the start
};

struct ShootingOptions {
    double period = 1.0;       // [s]; of a limit cycle a first estimate
    bool limit_cycle = false;  // the inputs are constant, and the period is to be found
    int max_periods = 20000;   // to follow
    double tolerance = 1e-10;  // of the residual
    bool (*interrupted)(void*) = nullptr;
    void* interrupted_context = nullptr;
};

template <class System>
class ShootingOf {
 public:
    using D = typename System::Dims;
    using HybridState = HybridStateOf<System>;
    using Motion = PeriodicMotionOf<System>;

    // The inputs must repeat with the period. Workspace: a system and its regimes. unit: as of ExactSolver.
    template <class Workspace>
    ShootingOf(Workspace& workspace, const SignalsOf<D>& signals, double unit, const ShootingOptions& options)
        : system_(workspace.system),
          cache_(workspace.cache),
          laws_(system_),
          options_(options),
          period_(options.period),
          input_(constants(signals)),
          solver_(system_, signals, unit, workspace.balanced_scale(), &cache_) {
        solver_.set_interruption({options.interrupted, options.interrupted_context});
    }

    Motion solve(const StartOf<D>& start) {
        Motion motion;
        motion.status = solver_.begin(0.0, start.x, start.memory);
        if (motion.status != Status::done) return motion;
        HybridState here{solver_.state(), solver_.memory(), solver_.key()};
        for (int follow = first_follow; motion.periods < options_.max_periods; follow *= 2) {
            for (int k = 0; k < follow; ++k, ++motion.periods) {
                Image image(system_.counts(), laws_, cache_);
                if (!advance(here, image, motion)) return motion;
                motion.residual = residual(here, image);
                // A motion that repeats to the last bit needs no more.
                if (motion.residual == 0.0) return finish(motion, here, image, 0);
                here = image.end;
                laws_.rewind(here.x, here.memory);
            }
            if (newton(here, motion)) return motion;
            if (motion.status == Status::interrupted) return motion;
            motion.status = Status::done;  // a trial that strayed is no failure of the motion
            period_ = options_.period;
        }
        return motion;
    }

    // Runs through one period from a station.
    Status run(const HybridState& start, Observer<System>& observer) {
        const Status status = enter(start);
        return status == Status::done ? solver_.advance(period_, observer) : status;
    }

 private:
    static constexpr int first_follow = 2;
    static constexpr int max_newton = 15;
    static constexpr double neutral = 1e-9;  // of a pivot, in units of the scales

    // A station after one period, and how it depends on the one before.
    struct Image {
        Image(const CountsOf<D>& n, const ComponentLaws<System>& laws, RegimeCache<System>& cache)
            : sensitivity(n, laws, cache) {}
        HybridState end;
        SensitivityOf<System> sensitivity;
    };

    static InputsOf<D> constants(const SignalsOf<D>& signals) {
        InputsOf<D> u{};
        for (std::size_t i = 0; i < signals.size(); ++i) u[i] = signals[i].breakpoints[0].value;
        return u;
    }

    Status enter(const HybridState& s) {
        solver_.resume(0.0, s.x, s.memory, s.key);
        return solver_.inputs_changed();
    }

    bool advance(const HybridState& from, Image& image, Motion& motion) {
        motion.status = enter(from);
        if (motion.status == Status::done) motion.status = solver_.advance(period_, image.sensitivity);
        motion.time = solver_.time();
        motion.contact = solver_.stopped_at();
        if (motion.status != Status::done) return false;
        image.end = {solver_.state(), solver_.memory(), solver_.key()};
        return true;
    }

    static double value(const HybridState& s, int k) { return k < D::states ? s.x[k] : s.memory[k - D::states]; }
    double change(const HybridState& a, const HybridState& b, int k) const {
        return laws_.change(k, value(a, k), value(b, k));
    }

    double residual(const HybridState& a, const Image& image) const {
        double worst = 0.0;
        each_component<D>(system_.counts(), [&](int k) {
            if (laws_.neutral(k) || !laws_.matters(image.end.key, k)) return;
            const double scale = k < D::states ? image.sensitivity.magnitude[k] : laws_.magnitude(k);
            if (scale > 0.0) worst = std::fmax(worst, std::fabs(change(a, image.end, k)) / scale);
        });
        return worst;
    }

    Motion& finish(Motion& motion, const HybridState& start, const Image& image, int steps) const {
        motion.converged = true;
        motion.smooth = image.sensitivity.smooth;
        motion.period = period_;
        motion.newton_steps = steps;
        motion.start = start;
        motion.jacobian = image.sensitivity.jacobian;
        each_state<D>(system_.counts(), [&](int k) { motion.advance[k] = image.end.x[k] - start.x[k]; });
        return motion;
    }

    // Newton's method from a station, as long as each step gains; true if it ends within the tolerance.
    bool newton(HybridState y, Motion& motion) {
        double best = std::numeric_limits<double>::infinity();
        for (int step = 0; step <= max_newton; ++step) {
            Image image(system_.counts(), laws_, cache_);
            if (!advance(y, image, motion)) return false;
            const double now = residual(y, image), before = best;
            if (now < best) {
                best = motion.residual = now;
                finish(motion, y, image, step);
                motion.converged = now <= options_.tolerance;
            }
            // Rounding ends the descent; above the tolerance, a step that gains nothing is no convergence.
            if (now == 0.0 || now >= (motion.converged ? 0.5 : 1.0) * before || !step_from(y, image)) break;
        }
        return motion.converged;
    }

    // y + (1 - J)^-1 (image - y), leaving out the directions in which the motion is neutral.
    bool step_from(HybridState& y, const Image& image) {
        std::vector<int> active;
        each_component<D>(system_.counts(), [&](int k) {
            if (!laws_.neutral(k)) active.push_back(k);
        });
        const std::size_t n = active.size();
        std::vector<std::vector<double>> M(n, std::vector<double>(n));
        std::vector<double> rhs(n), scale(n);
        for (std::size_t r = 0; r < n; ++r) {
            scale[r] = active[r] < D::states ? image.sensitivity.magnitude[active[r]] : laws_.magnitude(active[r]);
            if (!(scale[r] > 0.0)) scale[r] = 1.0;
        }
        for (std::size_t r = 0; r < n; ++r) {
            rhs[r] = change(y, image.end, active[r]) / scale[r];
            for (std::size_t c = 0; c < n; ++c)
                M[r][c] =
                    (r == c ? 1.0 : 0.0) - image.sensitivity.jacobian.row[active[r]][active[c]] * scale[c] / scale[r];
        }
        for (const ComponentsOf<D>& kept : laws_.constraints(y.key)) {
            M.emplace_back();
            double largest = 0.0;
            for (std::size_t c = 0; c < n; ++c) {
                M.back().push_back(kept[active[c]] * scale[c]);
                largest = std::fmax(largest, std::fabs(M.back()[c]));
            }
            for (double& v : M.back()) v /= largest;
            rhs.push_back(0.0);
        }
        if (options_.limit_cycle) free_period(image, active, scale, M, rhs);
        const std::size_t unknowns = M[0].size();
        const std::vector<double> delta = solve_leaving_neutral(std::move(M), std::move(rhs), unknowns, neutral);
        if (unknowns > n) {
            if (!(std::fabs(delta[n]) < 0.5)) return false;
            period_ *= 1.0 + delta[n];
        }
        for (std::size_t k = 0; k < n; ++k) {
            const double change = delta[k] * scale[k];
            if (!std::isfinite(change)) return false;
            laws_.add(y.x, y.memory, active[k], change);
        }
        // What is at rest at the end of the period is at rest at its beginning, to the last bit.
        y.key = image.end.key;
        auto at_rest = cache_.regime(y.key).at_rest;
        system_.stop(y, at_rest);
        laws_.direct(y.x, y.key);
        return true;
    }

    // The change of the period, relative to it, as the last unknown: the image moves along the flow. The start is not
    // to move along it. Where nothing moves, there is no period.
    void free_period(const Image& image, const std::vector<int>& active, const std::vector<double>& scale,
                     std::vector<std::vector<double>>& M, std::vector<double>& rhs) {
        ComponentsOf<D> rate{};
        each_rate<D>(cache_.regime(image.end.key), [&](int k, const LinearForm& f) {
            rate[k] = evaluate<D>(f, image.end.x, image.end.memory, input_);
        });
        std::vector<double> flow;
        double fastest = 0.0;
        for (std::size_t k = 0; k < active.size(); ++k) {
            flow.push_back(period_ / scale[k] * rate[active[k]]);
            fastest = std::fmax(fastest, std::fabs(flow.back()));
        }
        if (fastest == 0.0) return;
        for (std::size_t row = 0; row < M.size(); ++row) M[row].push_back(row < flow.size() ? -flow[row] : 0.0);
        for (double& f : flow) f /= fastest;
        flow.push_back(0.0);
        M.push_back(std::move(flow));
        rhs.push_back(0.0);
    }

    const System& system_;
    RegimeCache<System>& cache_;
    const ComponentLaws<System> laws_;
    ShootingOptions options_;
    double period_;            // [s] at present
    const InputsOf<D> input_;  // at the beginning
    ExactSolver<System> solver_;
};

}  // namespace lostmotion
