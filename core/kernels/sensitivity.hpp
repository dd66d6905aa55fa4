// How the state at the end of a run depends on that at its beginning: the product of the matrix exponentials of the
// regimes and of the jump (saltation) matrices at the switchings. Exact away from grazing.
#pragma once

#include <algorithm>
#include <optional>

#include "lostmotion/solver/components.hpp"
#include "lostmotion/solver/exact_solver.hpp"

namespace lostmotion {

// Observer of the exact solver. At a switching where a guard g falls through zero the components jump from y to R(y,
// t); a disturbance of y shifts the instant, too, so that it becomes (Leine and Nijmeijer 2004)
//     (dR + (f_after - dR f_before - R_t) grad g / g') times itself.
template <class System>
class SensitivityOf final : public Observer<System> {
 public:
    using D = typename System::Dims;
    using Regime = typename System::Regime;
    using State = StateOf<D>;
    using Components = ComponentsOf<D>;
    using Jacobian = JacobianOf<D>;

    SensitivityOf(const CountsOf<D>& n, const ComponentLaws<System>& laws, RegimeCache<System>& cache)
        : jacobian(Jacobian::identity(n)), n_(n), laws_(laws), cache_(cache) {}

    Jacobian jacobian;
    State magnitude{};   // largest magnitude of each state at the ends of the segments
    bool smooth = true;  // false: a switching by grazing, or with a rate that is lost in rounding

    bool segment(const Segment<System>& s) override {
        if (!input_) input_.emplace(s.at.input());
        each_state<D>(n_, [&](int k) {
            magnitude[k] = std::fmax(magnitude[k], std::fmax(std::fabs(s.at.x()[k]), std::fabs(s.x_end[k])));
        });
        const Regime& r = *s.entry.regime;
        regime_ = &r;
        x_ = s.x_end;
        memory_ = s.memory;
        if (!(s.end > s.begin)) return true;
        const auto G = s.entry.propagator.changes(s.end - s.begin);
        ByState<D, Components> rates;
        rates.make_room(n_);
        each_rate<D>(r, [&](int row, const LinearForm& f) { rates[row] = gradient<D>(f); });
        // x(s) = x + G x', column by column.
        each_component<D>(n_, [&](int c) {
            State rate{};
            each_state<D>(n_, [&](int row) {
                each_component<D>(n_, [&](int k) { rate[row] += rates[row][k] * jacobian.row[k][c]; });
            });
            State change;
            (G * load<D>(rate)).store(change);
            each_state<D>(n_, [&](int row) { jacobian.row[row][c] += change[row]; });
        });
        return true;
    }

    bool wants_switching() const override { return true; }
    void switching(const SwitchingOf<System>& w) override {
        const Regime &old = *regime_, &next = cache_.regime(w.after);
        input_->anchor_left(w.time);
        const auto u = input_->template jet<2>();
        std::array<InputsOf<D>, 2> u_after = u;
        if (w.input_jump) {
            input_->anchor(w.time);
            u_after = input_->template jet<2>();
        }
        Jacobian jump = Jacobian::identity(n_);
        const auto reset = laws_.reset({w, old, next, x_, memory_, u, u_after}, jump);
        smooth = smooth && reset.exact;
        if (w.guard >= 0) {
            const auto& form = old.guards[w.guard].form;
            const Components f = flow(old, x_, memory_, u[0]), after = flow(next, w.x, w.memory, u[0]);
            State rate{};
            each_state<D>(n_, [&](int k) { rate[k] = f[k]; });
            const double fall = evaluate_rate<D>(form, rate, u[1]);
            double noise = 0.0;
            each_state_of<D>(form, [&](int k, double c) { noise += std::fabs(c * rate[k]); });
            for (const auto& [i, c] : form.of_inputs()) noise += std::fabs(c * u[1][i]);
            if (!(fall < -rounding * noise)) {
                smooth = false;
            } else {
                const Components g = gradient<D>(form);
                Components gap = after;
                each_component<D>(n_, [&](int r) {
                    gap[r] -= reset.by_time[r];
                    each_component<D>(n_, [&](int k) { gap[r] -= jump.row[r][k] * f[k]; });
                });
                each_component<D>(
                    n_, [&](int r) { each_component<D>(n_, [&](int c) { jump.row[r][c] += gap[r] * g[c] / fall; }); });
            }
        }
        jacobian = jump * jacobian;
    }

 private:
    Components flow(const Regime& r, const State& x, const typename D::Memory& m, const InputsOf<D>& u) const {
        Components f{};
        each_rate<D>(r, [&](int k, const LinearForm& rate) { f[k] = evaluate<D>(rate, x, m, u); });
        return f;
    }

    const CountsOf<D> n_;
    const ComponentLaws<System>& laws_;
    RegimeCache<System>& cache_;
    std::optional<InputState<D>> input_;
    // Where the last segment ended.
    const Regime* regime_ = nullptr;
    State x_{};
    typename D::Memory memory_{};
};

}  // namespace lostmotion
