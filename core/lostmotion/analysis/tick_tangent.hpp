// How what sampled controllers remember and command depends on parameters.
//
// What a tick makes of their numbers s, of what they measure y and of their own parameters is a smooth function but for
// limits and rounding to whole increments. Its derivative is found by differences, of the parameter alone and of the
// motion, along ds/dp and dy/dp: of the values beside, those that no limit parts from the present one. What an encoder
// of finite resolution reads does not depend on anything but at single instants: its derivative is 0.
#pragma once

#include <span>
#include <string>
#include <utility>
#include <vector>

#include "../simulation/train_control.hpp"
#include "reset_tangent.hpp"

namespace lostmotion {

// df/dp from f at p - 2h, p - h, p, p + h, p + 2h; where one side is parted by a limit, from the other. False if both
// are, by more than `noise`.
bool difference_beside_limits(const std::array<double, 5>& f, double h, double noise, double& derivative);

// Whether three values at equal distances lie in a straight line, as far as rounding lets one see, or bend by a share
// of their difference.
bool alike_beside(double left, double here, double right, double bend);

class TickTangent {
 public:
    TickTangent(int parameters, const std::vector<Variation>& variations, const Control& control)
        : parameters_(parameters), variations_(variations), control_(control) {}

    const std::string& error() const { return error_; }

    // A tick that the controllers are about to run. w, derivative: as in InputTangents.
    void step(const Ticks& ticks, std::span<const control::Axis> axes, const ControlCourse& course,
              const FormTangent& form, const VariedTrain& trains, const double* w, const double* derivative) {
        if (beside_.empty()) place(axes, trains);
        const double time = ticks.time(course.next);
        int first = 0;
        for (std::size_t a = 0; a < axes.size(); ++a) {
            const control::Axis& law = axes[a];
            const double* slots = course.slots.data() + first;
            measure(a, law, form, w, derivative, time);
            if (course.next == 0)
                vary(
                    a, first, law.slots(), law, slots,
                    [&](const control::Axis& l, const control::Sampled& y, double* s) { l.start(y, ticks.length, s); });
            vary(a, first, law.slots(), law, slots, [&](const control::Axis& l, const control::Sampled& y, double* s) {
                l.step(course.next, ticks.length, y, s);
            });
            double* own = now_.data();
            std::copy_n(slots, law.slots(), own);
            law.step(course.next, ticks.length, measured_, own);
            commands_[a].value = law.command(own);
            std::copy_n(&slots_[static_cast<std::size_t>((first + law.command_slot()) * parameters_)], parameters_,
                        commands_[a].derivative.begin());
            first += law.slots();
        }
    }
    // The inputs that they give.
    void hold(const InputTangents& inputs, double* w, double* derivative) const {
        for (const Command& c : commands_) inputs.hold(c.input, c.value, c.derivative.data(), w, derivative);
    }
    // Derivatives of a signal of an axis whose numbers begin at `first`.
    const double* signal(int first, int s) const {
        return &slots_[static_cast<std::size_t>((first + s) * parameters_)];
    }
    bool begun() const { return !beside_.empty(); }

 private:
    static constexpr int n_measured = 7;
    // Steps of the motion, in those of the parameter, and by how much a law may bend over them.
    static constexpr std::array<std::pair<double, double>, 3> lengths{{{0x1p6, 0.0}, {1.0, 0.0}, {0x1p-3, 1e-4}}};
    struct Command {
        int input;
        double value = 0.0;
        std::vector<double> derivative;
    };
    // At another value of a parameter.
    struct Beside {
        double offset, weight;
        std::vector<control::Axis> laws;  // none: the same
        std::vector<AxisRows> rows;       // of each axis; none: the same
    };

    void place(std::span<const control::Axis> axes, const VariedTrain& trains) {
        rows_ = axis_rows(trains.base(), control_);
        for (const Variation& v : variations_) {
            std::vector<Beside>& all = beside_.emplace_back();
            for (const Neighbour& at : v.neighbours) {
                Beside& b = all.emplace_back(Beside{at.offset, at.weight, {}, {}});
                if (at.control) b.laws = at.control->laws();
                if (at.train) b.rows = axis_rows(at.train->assembly(), control_);
            }
        }
        for (const AxisRows& r : rows_)
            commands_.push_back({r.command, 0.0, std::vector<double>(static_cast<std::size_t>(parameters_))});
        int slots = 0;
        for (const control::Axis& law : axes) slots += law.slots();
        slots_.resize(static_cast<std::size_t>(slots * parameters_));
        measured_derivative_.resize(static_cast<std::size_t>(n_measured * parameters_));
        for (auto* room : {&now_, &at_}) room->resize(static_cast<std::size_t>(slots));
    }

    // What an axis measures, and its derivatives.
    void measure(std::size_t a, const control::Axis& law, const FormTangent& form, const double* w,
                 const double* derivative, double time);
    control::Sampled measured(int p, double offset) const;

    // Derivatives of what `act` makes of the numbers of an axis.
    template <class Act>
    void vary(std::size_t a, int first, int count, const control::Axis& law, const double* slots, const Act& act) {
        std::copy_n(slots, count, now_.begin());
        act(law, measured_, now_.data());
        double noise = 0.0;  // of what small numbers are differences of large ones
        for (int k = 0; k < count; ++k) noise = std::fmax(noise, 1e-10 * std::fabs(slots[k]));
        values_.resize(static_cast<std::size_t>(5 * count));
        for (int p = 0; p < parameters_; ++p) {
            const std::vector<Beside>& all = beside_[static_cast<std::size_t>(p)];
            const bool of_law = std::any_of(all.begin(), all.end(), [](const Beside& b) { return !b.laws.empty(); });
            const bool of_motion = moves(p, first, count);
            by_law_.assign(static_cast<std::size_t>(count), 0.0);
            if (of_law) vary_law(a, p, count, law, slots, act, noise);
            if (of_motion) vary_motion(p, first, count, law, slots, act, noise);
            if (of_law || of_motion)
                for (int k = 0; k < count; ++k) derivative(p, first + k) += by_law_[static_cast<std::size_t>(k)];
        }
    }
    double& derivative(int p, int slot) { return slots_[static_cast<std::size_t>(slot * parameters_ + p)]; }
    // Whether anything that an axis remembers or measures changes with a parameter.
    bool moves(int p, int first, int count) const;
    // What `act` makes of numbers and measurements: values_[5 k + to].
    template <class Act>
    void put(int to, int count, const control::Axis& law, const control::Sampled& y, const Act& act) {
        act(law, y, at_.data());
        for (int k = 0; k < count; ++k)
            values_[static_cast<std::size_t>(5 * k + to)] = at_[static_cast<std::size_t>(k)];
    }
    // The derivative of a number by what was put.
    double taken(int k, double h, double noise);
    // As far as the law itself depends on the parameter. Where it does not, exactly 0.
    template <class Act>
    void vary_law(std::size_t a, int p, int count, const control::Axis& law, const double* slots, const Act& act,
                  double noise) {
        const std::vector<Beside>& all = beside_[static_cast<std::size_t>(p)];
        const bool central = all.size() == 4 && all[0].offset < 0.0 && all[3].offset > 0.0;
        for (std::size_t j = 0; j < all.size(); ++j) {
            std::copy_n(slots, count, at_.begin());
            put(static_cast<int>(j) + (central && j > 1 ? 1 : 0), count, all[j].laws.empty() ? law : all[j].laws[a],
                measured_, act);
        }
        for (int k = 0; k < count; ++k) {
            double& out = by_law_[static_cast<std::size_t>(k)];
            if (central) {
                out = taken(k, all[2].offset, noise);
                continue;
            }
            for (std::size_t j = 0; j < all.size(); ++j)
                out +=
                    all[j].weight * (values_[static_cast<std::size_t>(5 * k) + j] - now_[static_cast<std::size_t>(k)]);
        }
    }
    // As far as the motion does. Most laws are straight but for limits: then a long step, with little rounding, gives
    // the derivative; otherwise a short one, within which few limits lie, with two more values beside if one does.
    template <class Act>
    void vary_motion(int p, int first, int count, const control::Axis& law, const double* slots, const Act& act,
                     double noise) {
        double offset = std::numeric_limits<double>::infinity(), h = offset;
        for (const Beside& b : beside_[static_cast<std::size_t>(p)]) offset = std::fmin(offset, std::fabs(b.offset));
        const auto put_at = [&](int to, double step) {
            for (int k = 0; k < count; ++k)
                at_[static_cast<std::size_t>(k)] = slots[k] + step * derivative(p, first + k);
            put(to, count, law, measured(p, step), act);
        };
        const auto alike = [&](double step, double bend) {
            put_at(1, -step);
            put_at(3, step);
            for (int k = 0; k < count; ++k) {
                const double* f = &values_[static_cast<std::size_t>(5 * k)];
                if (!alike_beside(f[1], now_[static_cast<std::size_t>(k)], f[3], bend)) return false;
            }
            return true;
        };
        bool smooth = false;
        for (const auto& [factor, bend] : lengths)
            if (!smooth) smooth = alike(h = factor * offset, bend);
        if (!smooth) {
            put_at(0, -2.0 * h);
            put_at(4, 2.0 * h);
        }
        for (int k = 0; k < count; ++k) {
            const double* f = &values_[static_cast<std::size_t>(5 * k)];
            derivative(p, first + k) = smooth ? (f[3] - f[1]) / (2.0 * h) : taken(k, h, noise);
        }
    }

    int parameters_;
    const std::vector<Variation>& variations_;
    const Control& control_;
    std::vector<AxisRows> rows_;
    std::vector<std::vector<Beside>> beside_;
    std::vector<Command> commands_;
    std::vector<double> slots_;  // derivatives of the numbers of all axes
    control::Sampled measured_;
    std::vector<double> measured_derivative_, now_, at_, values_, by_law_;
    std::string error_;
};

}  // namespace lostmotion
