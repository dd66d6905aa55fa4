// How the motion at the end of a step depends on a torque that is constant over the step.
//
// Within a regime the components y follow y' = A y + b M + ..., so that their derivative D = dy/dM follows
// D' = A D + b. Where a guard g falls through zero at t*, a change of M shifts that instant by
//     dt*/dM = -(g_y D + g_M)/g',
// and D becomes R_y D + (R_y f_before + R_t - f_after) dt*/dM, with R what the switching sets anew (Leine and
// Nijmeijer 2004). This is exact away from grazing, except that the direct part of M in torques which a rest leaves
// open is not followed.
#pragma once

#include <algorithm>
#include <bit>
#include <cstdint>
#include <optional>

#include "lostmotion/solver/exact_solver.hpp"
#include "reset_jacobian.hpp"

namespace lostmotion {

template <class System>
class TorqueResponse final : public Observer<System> {
 public:
    using D = typename System::Dims;
    using Regime = typename System::Regime;
    using State = StateOf<D>;
    using Components = ComponentsOf<D>;

    explicit TorqueResponse(const System& system) : n_(system.counts()), laws_(system) {}

    // input: the number of the torque among the inputs.
    void begin(RegimeCache<System>& cache, int input) {
        cache_ = &cache;
        input_ = input;
        derivative_ = {};
        segments_ = 0;
        inputs_.reset();
    }
    // Of each state, [1/(N m)] times its unit.
    const Components& derivative() const { return derivative_; }

    bool segment(const Segment<System>& s) override {
        if (!inputs_) inputs_.emplace(s.at.input());
        const Regime& r = *s.entry.regime;
        regime_ = &r;
        x_ = s.x_end;
        memory_ = s.memory;
        // Without the rounding of the instants: then nearly all steps are of one regime and one length, and what is
        // kept of the last one is what any other would find.
        const double length = rounded(s.end - s.begin);
        if (!(length > 0.0)) return true;
        const bool first = segments_++ == 0;
        if (first && last_entry_ == &s.entry && last_key_ == r.key && length == last_length_) {
            derivative_ = last_;
            return true;
        }
        State rate{};
        each_rate<D>(r, [&](int row, const LinearForm& f) { rate[row] = by_torque(f); });
        State change;
        (s.entry.propagator.changes(length) * load<D>(rate)).store(change);
        each_state<D>(n_, [&](int row) { derivative_[row] += change[row]; });
        if (first) {
            last_entry_ = &s.entry;
            last_key_ = r.key;
            last_length_ = length;
            last_ = derivative_;
        }
        return true;
    }

    bool wants_switching() const override { return true; }
    void switching(const SwitchingOf<System>& w) override {
        if (!inputs_) return;  // at the start of the step: nothing depends on the torque yet
        ++segments_;
        const Regime &old = *regime_, &next = cache_->regime(w.after);
        inputs_->anchor_left(w.time);
        const auto u = inputs_->template jet<2>();
        auto u_after = u;
        if (w.input_jump) {
            inputs_->anchor(w.time);
            u_after = inputs_->template jet<2>();
        }
        auto jump = JacobianOf<D>::identity(n_);
        const auto reset = laws_.reset({w, old, next, x_, memory_, u, u_after}, jump);
        Components out{};
        each_component<D>(
            n_, [&](int r) { each_component<D>(n_, [&](int k) { out[r] += jump.row[r][k] * derivative_[k]; }); });
        if (w.guard >= 0) {
            const Components before = flow(old, x_, memory_, u[0]), after = flow(next, w.x, w.memory, u_after[0]);
            const auto& g = old.guards[w.guard].form;
            const double change = by_torque(g);
            double fall = 0.0;
            for (const auto& [i, c] : g.of_inputs()) fall += c * u[1][i];
            each_state_of<D>(g, [&](int k, double c) { fall += c * before[k]; });
            if (fall < 0.0) {
                const double shift = -change / fall;
                each_component<D>(n_, [&](int r) {
                    double gap = reset.by_time[r] - after[r];
                    each_component<D>(n_, [&](int k) { gap += jump.row[r][k] * before[k]; });
                    out[r] += gap * shift;
                });
            }
        }
        derivative_ = out;
    }

 private:
    // To 30 bits, which the rounding of instants does not reach.
    static double rounded(double length) {
        constexpr std::uint64_t least = std::uint64_t{1} << 23;
        return std::bit_cast<double>((std::bit_cast<std::uint64_t>(length) + least / 2) & ~(least - 1));
    }
    // How a form depends on the torque.
    double by_torque(const LinearForm& f) const {
        double sum = 0.0;
        for (const auto& [i, c] : f.of_inputs())
            if (i == input_) sum = c;
        each_state_of<D>(f, [&](int k, double c) { sum += c * derivative_[k]; });
        for (const auto& [k, c] : f.of_memory()) sum += c * derivative_[D::states + k];
        return sum;
    }
    Components flow(const Regime& r, const State& x, const typename D::Memory& m, const InputsOf<D>& u) const {
        Components f{};
        each_rate<D>(r, [&](int k, const LinearForm& rate) { f[k] = evaluate<D>(rate, x, m, u); });
        return f;
    }

    const CountsOf<D> n_;
    const ComponentLaws<System> laws_;
    RegimeCache<System>* cache_ = nullptr;
    int input_ = 0;
    Components derivative_{};
    int segments_ = 0;
    std::optional<InputState<D>> inputs_;
    // Where the last segment ended.
    const Regime* regime_ = nullptr;
    State x_{};
    typename D::Memory memory_{};
    // The first segment of an earlier step.
    const void* last_entry_ = nullptr;
    typename System::Key last_key_{};
    double last_length_ = 0.0;
    Components last_{};
};

}  // namespace lostmotion
