// Equal steps along one regime, as sampling takes them.
//
// What does not change from step to step is summed up beforehand:
//     x(t + h) = x + (E x + f + sum_q (s_q Y_q + c_q Z_q)),
// with f from all that is constant (growing by a constant if the inputs ramp) and Y_q, Z_q the whole answers to the
// sine and the cosine of the q-th sine of the inputs. Of all this, only E x waits for the step before.
#pragma once

#include <vector>

#include "cursor.hpp"

namespace lostmotion {

// States and inputs at up to `most` instants of one regime, variable by variable.
template <class D, int most = 64>
struct InstantsOf {
    static constexpr int max_count = most;
    static_assert(max_count % vec_width == 0);
    using Column = std::array<double, max_count>;

    alignas(64) ByState<D, Column> x{};
    alignas(64) ArrayOf<D, Column, D::inputs> u{};

    [[gnu::always_inline]] void set(int k, const LanesOf<D>& state, const InputsOf<D>& input) {
        if constexpr (std::same_as<D, Any>) {
            const auto widen = [](auto& columns, int size) {
                columns.resize(std::max(columns.size(), static_cast<std::size_t>(size)));
            };
            widen(x.coupled, state.coupled.size());
            widen(x.angle, state.angle.size());
            widen(u, input.size());
            for (std::size_t j = 0; j < x.coupled.size(); ++j) x.coupled[j][k] = state.coupled[j];
            for (std::size_t j = 0; j < x.angle.size(); ++j) x.angle[j][k] = state.angle[j];
            for (std::size_t i = 0; i < u.size(); ++i) u[i][k] = input[i];
        } else {
            for (int j = 0; j < D::coupled; ++j) x[j][k] = state.coupled[j];
            for (int j = 0; j < D::angles; ++j) x[D::coupled + j][k] = state.angle[j];
            for (int i = 0; i < D::inputs; ++i) u[i][k] = input[i];
        }
    }
};

template <class D>
class Stride {
 public:
    using Coupled = CoupledOf<D>;
    using State = StateOf<D>;
    using Lanes = LanesOf<D>;

    // On a regime, with steps of one doubling level, from where a cursor is.
    void place(Propagator<D>& propagator, int level, const ColumnOf<D>& constant, const Cursor<D>& from) {
        propagator_ = &propagator;
        level_ = level;
        const auto& step = propagator.level(level);
        const double length = propagator.length(level);
        const InputState<D>& input = from.input();
        const LinearRatesOf<D>& rates = propagator.rates();
        const auto responses = propagator.responses(level);
        const PhaseRotation* rotations = propagator.rotations(level);
        n_ = rates.n;
        make_room(angle_row_, n_.angles);
        for (int j = 0; j < n_.angles; ++j)
            angle_row_[j] = rates.angle_coefficient[j] * step.integral.coupled.row(rates.angle_speed[j]);
        x_ = from.x();
        linear_ = input.linear();
        Coupled driving = load(constant), ramp{};
        for (int i = 0; i < n_.inputs; ++i) {
            increase_[i] = input.slope()[i] * length;
            driving = driving + linear_[i] * load(rates.input_column[i]);
            ramp = ramp + increase_[i] * load(rates.input_column[i]);
        }
        forced_ = step.integral * Lanes{driving};
        growth_ = step.integral * Lanes{ramp};
        std::size_t sines = 0;
        sines_.resize(static_cast<std::size_t>(input.size() / 2));
        sines_end_ = {};
        for (int q = 0; q < input.size(); q += 2) {
            const InputBasis& basis = input.basis(q);
            const auto& response = responses[q / 2];
            const double* weights = input.weights() + q;
            if (basis.kind == InputBasis::cosine) {
                sines_end_[basis.input] = sines + 1;
                RotatingSine& t = sines_[sines++];  // in place, for the sake of speed
                t.sine_cosine = Pack<2>::load(weights);
                t.rotation = rotations[q / 2];
                t.by_sine = step.integral * rates.input_column[basis.input] + response.of(0);
                t.by_cosine = response.of(1);
            } else {
                forced_ = forced_ + response * weights;
            }
        }
        sines_.resize(sines);
    }

    // Where the cursor stood and n - 1 steps on from there.
    void run(int n, InstantsOf<D>& to) {
        const auto& step = propagator_->level(level_);
        Lanes x = load(x_), forced = forced_;
        for (int k = 0;; ++k) {
            InputsOf<D> u = linear_;
            std::size_t q = 0;
            for (int i = 0; i < n_.inputs; ++i)
                for (; q < sines_end_[i]; ++q) u[i] += sines_[q].sine_cosine[0];
            to.set(k, x, u);
            if (k + 1 == n) {
                x.store(x_);
                return;
            }
            Lanes driven = forced;
            for (RotatingSine& t : sines_) {
                driven = driven + (t.sine_cosine[0] * t.by_sine + t.sine_cosine[1] * t.by_cosine);
                t.sine_cosine = t.rotation * t.sine_cosine;
            }
            Lanes own{step.change * x.coupled, {}};
            for (int j = 0; j < n_.angles; ++j) own.angle[j] = sum_of(angle_row_[j] * x.coupled);
            x = own + (x + driven);  // so that one sum less waits for the step before
            forced = forced + growth_;
            for (int i = 0; i < n_.inputs; ++i) linear_[i] += increase_[i];
        }
    }
    // At the last of them.
    const State& x() const { return x_; }

 private:
    struct RotatingSine {
        Pack<2> sine_cosine;  // the sine itself, and its derivative over omega
        PhaseRotation rotation;
        Lanes by_sine, by_cosine;
    };

    Propagator<D>* propagator_ = nullptr;
    int level_ = 0;
    [[no_unique_address]] CountsOf<D> n_;
    ArrayOf<D, Coupled, D::angles> angle_row_;  // the rows of the angles in exp(A h) - 1
    State x_{};
    Lanes forced_, growth_;
    InputsOf<D> linear_{}, increase_{};
    std::vector<RotatingSine> sines_;  // input by input
    ListOf<D, std::size_t, D::inputs> sines_end_{};
};

}  // namespace lostmotion
