// Synchronous motors under field-oriented control, between two ticks: their windings as power series, the mechanics by
// the solver of the run, and between both torque and speed.
//
// Over a part of a tick of length h the mechanics get each torque as the straight line with its impulse and moment, the
// windings each speed as the parabola with its ends and its angle. What both leave out is orthogonal to constants and
// straight lines, or to constants and odd: where nothing switches, the states at the end are wrong by O(h^5) for it.
// Which speed belongs to which torque is found by passes on a second solver, each of which takes the error of the mean
// speed to at most (h w)^2/6 of it, w^2 = 1.5 p^2 psi^2/(J L), while nothing switches: no speed of a passive mechanism
// answers more to its torque than at once, by 1/J. The run itself then goes the way that was found.
#pragma once

#include <cmath>
#include <memory>
#include <span>
#include <vector>

#include "lostmotion/base/status.hpp"
#include "lostmotion/control/axis.hpp"
#include "lostmotion/kernel/form.hpp"
#include "lostmotion/model/instant.hpp"

namespace lostmotion {

// An axis in a system: the input of its motor, and the forms that give what is sampled.
struct AxisPlace {
    int input;
    model::OwnForm position_angle, speed_angle, speed, motor_torque;
    model::OwnForm rotor_angle, rotor_speed;
    model::OwnForm shaft_angle;  // of the reference's shaft
};

template <class Solver>
class WindingCoupling {
 public:
    using D = typename Solver::D;

    WindingCoupling(Solver& solver, double tick, std::span<const control::Axis> axes, std::span<const AxisPlace> places)
        : solver_(solver), tick_(tick) {
        int first = 0;
        for (std::size_t k = 0; k < axes.size(); ++k) {
            if (axes[k].field_orientation) motors_.push_back({&axes[k], &places[k], first});
            first += axes[k].slots();
        }
        if (present()) probe_ = solver.twin();
    }

    bool present() const { return !motors_.empty(); }
    // How far torque and speed are known [s].
    double end(std::span<const double> slots) const {
        return motors_[0].axis->course_end(slots.data() + motors_[0].first);
    }

    // From the solver's state on as far as to a part of a tick's end, at most to that of the tick. Sets the inputs.
    Status plan(double tick_end, std::span<double> slots, typename Solver::Observer& observer) {
        const double now = solver_.time();
        for (Motor& m : motors_) m.next = from_now(m, slots);
        double end = first_end(tick_end);
        while (!agree(end, slots) && end - now > 1e-3 * tick_) end = now + 0.5 * (end - now);
        for (Motor& m : motors_) {
            m.axis->set_course(m.next, m.slots(slots));
            set_torque(solver_, m);
        }
        return solver_.inputs_changed(observer);
    }
    // The inputs of other elements have changed: what lies ahead is not known any more.
    void forget_plan(std::span<double> slots) {
        for (Motor& m : motors_) m.axis->set_course(from_now(m, slots), m.slots(slots));
    }

 private:
    static constexpr double agreement = 1e-11;  // of the currents, relative to the largest one
    static constexpr double doubt = 1e-9;       // where rounding may be what keeps the passes from agreeing
    static constexpr double expected = 1e-6;    // left out of the series that the first speed is expected by
    static constexpr int most_passes = 20;

    struct Motor {
        const control::Axis* axis;
        const AxisPlace* place;
        int first;  // slot
        WindingCourse next{};
        double bend = 0.0;  // of its speed, as the last course and the torque make it

        const SynchronousWinding& winding() const { return axis->field_orientation->winding; }
        double* slots(std::span<double> all) const { return all.data() + first; }
        WindingCourse course(std::span<const double> all) const { return axis->course(all.data() + first); }
        // What a speed that is wrong for a time h changes of the current at most [A s], and a current of the torque.
        double current_per_speed(double h) const {
            const SynchronousWinding& w = winding();
            const double flux = w.flux_linkage + w.inductance_d * axis->field_orientation->current_limit;
            return w.pole_pairs * flux * h / std::fmin(w.inductance_d, w.inductance_q);
        }
        double torque_per_current() const {
            const SynchronousWinding& w = winding();
            const double most = w.flux_linkage + std::fabs(w.saliency()) * axis->field_orientation->current_limit;
            return 1.5 * w.pole_pairs * most;
        }
    };
    static double value(const LinearForm& form, const Solver& solver) {
        return evaluate<D>(form, solver.state(), solver.memory(), InputsOf<D>{});
    }
    static void set_torque(Solver& solver, const Motor& m) {
        const Ramp& torque = m.next.torque;
        solver.set_ramp(m.place->input, torque.value / m.axis->rated_torque, torque.slope / m.axis->rated_torque);
    }
    // By how much a torque of the motor changes the rate of its speed [1/(kg m2)], in the regime that the solver has.
    double inverse_inertia(const Motor& m) const {
        const auto& column = solver_.linear_rates().input_column[m.place->input];
        double sum = 0.0;
        for (const auto& [k, c] : m.place->rotor_speed.of_coupled()) sum += c * column[static_cast<std::size_t>(k)];
        return sum / m.axis->rated_torque;
    }
    // Currents, voltages and speed of this instant.
    WindingCourse from_now(const Motor& m, std::span<double> slots) const {
        const double now = solver_.time();
        const WindingCourse last = m.course(slots);
        const double angle = value(m.place->rotor_angle, solver_);
        return WindingCourse::at(m.winding(), now, last.current(now),
                                 m.axis->field_orientation->voltage(angle, m.slots(slots)),
                                 value(m.place->rotor_speed, solver_));
    }
    double first_end(double tick_end) const {
        const double left = tick_end - solver_.time();
        int parts = 1;
        double fastest = 0.0;
        for (const Motor& m : motors_) {
            parts = std::max(parts, m.axis->field_orientation->parts);
            fastest = std::max(fastest, m.winding().fastest(m.next.speed.c[0]));
        }
        parts *= std::max(1, static_cast<int>(std::ceil(fastest * tick_ / WindingCourse::reach)));
        const double count = std::ceil(left * parts / tick_ - 1e-9);
        return count > 1.0 ? solver_.time() + left / count : tick_end;
    }

    // Whether torques and speeds until `end` agree; then they are in the motors' courses.
    bool agree(double end, std::span<double> slots) {
        const double h = end - solver_.time();
        double factor = 0.0;  // at most that of a pass
        for (Motor& m : motors_) {
            m.next.end = end;
            const double response = inverse_inertia(m);
            expect_speed(m, m.course(slots), response);
            m.next.solve(m.winding());
            factor += m.torque_per_current() * m.current_per_speed(h) * response * h / 6.0;
        }
        double before = 0.0;
        for (int pass = 0; pass < most_passes; ++pass) {
            probe_->follow(solver_);
            for (Motor& m : motors_) set_torque(*probe_, m);
            const std::size_t switchings = probe_->switchings();
            typename Solver::Observer nobody;
            if (probe_->inputs_changed(nobody) != Status::done || probe_->advance(end, nobody) != Status::done)
                return true;  // the run will see for itself
            double change = 0.0;
            for (Motor& m : motors_) {
                change = std::fmax(change, see_speed(m, h));
                m.next.solve(m.winding());
            }
            // What the next pass would change, and with it the currents as they are now.
            if (pass > 0)
                factor = change / before;
            else if (probe_->switchings() != switchings)
                factor = 1.0;
            if (!(change * std::fmin(1.0, factor) > agreement)) return true;
            if (pass > 1 && change > 0.5 * before) return change < doubt;
            before = change;
        }
        return true;
    }
    // The speed goes on as before, but for what the torque changes, and what the mechanics have changed the last time.
    static void expect_speed(Motor& m, const WindingCourse& last, double response) {
        WindingCourse& next = m.next;
        const double h = next.length(), first = next.speed.c[0];
        if (!(last.length() > 0.0)) {
            next.speed = {{first, 0.0, 0.0}};
            m.bend = 0.0;
            return;
        }
        const double share = h / last.length(), squared = share * share;
        const double rise = share * (last.speed.c[1] + 2.0 * last.speed.c[2]), bend = squared * last.speed.c[2];
        next.speed = {{first, rise, bend}};
        next.solve(m.winding(), expected);
        const double jump = next.torque.value - (last.torque.value + last.torque.slope * last.length()),
                     slope = next.torque.slope - last.torque.slope;
        m.bend = bend + 0.5 * h * h * response * slope;
        next.speed = {{first, rise + h * response * jump, m.bend + share * squared * last.bend_change}};
    }
    // The speed that the mechanics have made of the torque. Returns what that changes of the current, of the largest.
    double see_speed(Motor& m, double h) {
        const AxisPlace& p = *m.place;
        const double first = value(p.rotor_speed, solver_), last = value(p.rotor_speed, *probe_),
                     mean = (value(p.rotor_angle, *probe_) - value(p.rotor_angle, solver_)) / h;
        const PowerSeries<3> seen = parabola(first, last, mean);
        const double change =
            std::fmax(std::fabs(seen(0.5) - m.next.speed(0.5)), std::fabs(seen(1.0) - m.next.speed(1.0)));
        m.next.speed = seen;
        m.next.bend_change = seen.c[2] - m.bend;
        return m.current_per_speed(h) * change / m.axis->field_orientation->current_limit;
    }

    Solver& solver_;
    double tick_;
    std::vector<Motor> motors_;
    std::unique_ptr<Solver> probe_;
};

}  // namespace lostmotion
