// The controller of one motor: reference, position, speed and current loop at their sample times.
//
//   tick k:  sample        compute, outermost first                                       apply
//            encoders -> [position loop] -> w* -> [speed loop] -> M* -> [current loop] -> E, `delay` ticks later
//
// All loops that are due at a tick use its samples; what is not due keeps its last output.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstring>
#include <limits>
#include <optional>
#include <type_traits>
#include <vector>

#include "camera.hpp"
#include "current_loop.hpp"
#include "encoder.hpp"
#include "feedforward.hpp"
#include "field_orientation.hpp"
#include "filter.hpp"
#include "inverse_model.hpp"
#include "load_observer.hpp"
#include "own_law.hpp"
#include "position_loop.hpp"
#include "speed_estimate.hpp"
#include "speed_loop.hpp"
#include "tracker.hpp"

namespace lostmotion::control {

// When a loop runs: at the ticks phase, phase + every, ...
struct Schedule {
    int every = 1, phase = 0;

    bool due(std::int64_t tick) const { return tick >= phase && (tick - phase) % every == 0; }
    std::int64_t sample(std::int64_t tick) const { return (tick - phase) / every; }
};

// An encoder, and how often the shaft that a loop works on turns for one turn of the encoder's shaft.
struct Sensor {
    Encoder encoder;
    double scale = 1.0;
};

// What is sampled of the drive.
struct Sampled {
    double position_angle = 0.0;  // of the shaft with the encoder of the position loop [rad]
    double speed_angle = 0.0;     // of the shaft with the encoder of the speed loop [rad]
    double speed = 0.0;           // of that shaft [rad/s]
    double motor_torque = 0.0;    // [N m]
    double rotor_angle = 0.0;     // of the motor itself [rad]
    double rotor_speed = 0.0;     // [rad/s]
    double shaft_angle = 0.0;     // of the reference's shaft [rad]
    double time = 0.0;            // [s]
};

// What an axis shows, held from tick to tick.
enum AxisSignal : int {
    position_reference,  // [rad], of the reference's shaft
    measured_position,   // the same
    speed_reference,     // [rad/s], of the motor
    measured_speed,      // the same
    torque_reference,    // [N m], of the motor
    loss_factor,         // of the inverse model
    friction_torque,     // the same [N m]
    load_torque,         // [N m], of the load observer
    target_direction,    // [rad], of the camera
    target_seen,         // 1 or 0
    n_axis_signals
};

struct AxisSignalName {
    const char *name, *unit, *meaning;
};
inline constexpr std::array<AxisSignalName, n_axis_signals> axis_signal_names{{
    {"position_reference", "rad", "angle that the controller wants"},
    {"measured_position", "rad", "angle that the controller has read"},
    {"speed_reference", "rad/s", "speed of the motor that the controller wants"},
    {"measured_speed", "rad/s", "speed of the motor that the controller has read"},
    {"torque_reference", "N*m", "torque of the motor that the controller wants"},
    {"model_loss_factor", "1", "factor on the losses of the gear that the inverse model has adapted"},
    {"model_friction_torque", "N*m", "friction torque of the motor that the inverse model has adapted"},
    {"observed_load_torque", "N*m", "load torque that the load observer has found"},
    {"target_direction", "rad", "direction of the target by the last frame that has shown it"},
    {"target_seen", "1", "whether the last frame has shown the target"},
}};

// What an axis with a winding shows beside them, at any instant.
enum WindingSignal : int {
    direct_current,  // [A], amplitude, as all of these
    quadrature_current,
    direct_voltage,      // [V]
    quadrature_voltage,  // [V]
    electrical_energy,   // [J], since the start
    copper_heat,         // [J], the same
    n_winding_signals
};
inline constexpr std::array<AxisSignalName, n_winding_signals> winding_signal_names{{
    {"direct_current", "A", "current along the magnets, amplitude of a phase"},
    {"quadrature_current", "A", "current across the magnets, amplitude of a phase"},
    {"direct_voltage", "V", "voltage along the magnets, amplitude of a phase"},
    {"quadrature_voltage", "V", "voltage across the magnets, amplitude of a phase"},
    {"electrical_energy", "J", "energy that the winding has taken from the inverter"},
    {"copper_heat", "J", "heat that has arisen in the winding"},
}};

class Axis {
 public:
    enum Mode { torque_mode, speed_mode, position_mode } mode = speed_mode;  // what the reference is of
    Reference reference;  // with a camera the direction of the target, which only the camera sees
    Camera camera;
    Tracker tracker;               // of what the camera sees; the loops follow it
    double reference_delay = 0.0;  // [s] by which the reference of the position loop comes later than its feedforward
    double ratio = 1.0;            // turns of the motor for one of the reference's shaft
    double rated_torque = 1.0;     // [N m] of command 1, without a current loop
    TickDelay delay;               // until the command acts

    Sensor speed_sensor;          // to the motor
    Sensor position_sensor;       // to the reference's shaft
    bool two_encoders = false;    // else that of the speed serves both
    double position_share = 1.0;  // of the difference of both angles, taken over at a sample of the position loop
    SpeedEstimate estimate;
    Schedule position_schedule, speed_schedule, current_schedule;
    PositionLoop position_loop;
    SpeedLoop speed_loop;
    std::optional<CurrentLoop> current_loop;
    std::optional<FieldOrientation> field_orientation;  // in its place
    bool commutates_by_encoder = true;                  // of the speed; else the angle of the rotor is known
    TorqueFeedforward feedforward;
    InverseModel inverse_model;  // in the place of feedforward and backlash
    LoadObserver load_observer;
    BacklashCompensation backlash;
    std::vector<DiscreteSystem> speed_filters, torque_filters;
    OwnLaw own_law;  // instead of all loops

    // Gives each block its slots. Once, after all has been set.
    void place() {
        Slots slots;
        slots.take(n_own_slots);
        delay.place(slots);
        speed_sensor.encoder.place(slots);
        if (two_encoders) position_sensor.encoder.place(slots);
        estimate.place(slots);
        position_loop.place(slots);
        speed_loop.place(slots);
        if (current_loop) current_loop->place(slots);
        if (field_orientation) {
            field_orientation->place(slots);
            course_ = slots.take(sizeof(WindingCourse) / sizeof(double));
            energy_ = slots.take(2);
        }
        backlash.place(slots);
        inverse_model.place(slots);
        load_observer.place(slots);
        for (auto* filters : {&speed_filters, &torque_filters})
            for (DiscreteSystem& f : *filters) f.place(slots);
        own_law.place(slots);
        camera.place(slots);
        if (camera.present) tracker.place(slots);
        slots_ = slots.count();
    }
    int slots() const { return slots_; }
    // Those of a winding that go on with time: instants and energies. A motion that repeats does not bring them back.
    std::vector<int> running_slots() const {
        if (!field_orientation) return {};
        static_assert(offsetof(WindingCourse, begin) == 0 && offsetof(WindingCourse, end) == sizeof(double));
        return {course_, course_ + 1, energy_, energy_ + 1};
    }

    // Before the first tick: the drive as it is, the integrators empty.
    void start(const Sampled& y, double tick_length, double* slot) const {
        std::fill_n(slot, slots_, 0.0);
        speed_sensor.encoder.start(y.speed_angle, slot);
        if (two_encoders) position_sensor.encoder.start(y.position_angle, slot);
        const double angle = speed_sensor.scale * speed_sensor.encoder.reading(y.speed_angle);
        estimate.start(angle, speed_sensor.scale * y.speed, tick_length * speed_schedule.every, slot);
        inverse_model.start(slot);
        load_observer.start(speed_sensor.scale * y.speed, inverse_model, slot);
        show_model(slot);
        if (two_encoders)
            slot[blended] = position_sensor.scale * position_sensor.encoder.reading(y.position_angle) - angle / ratio;
        if (camera.present) {
            slot[position_angle] =
                two_encoders ? position_sensor.scale * position_sensor.encoder.reading(y.position_angle) : 0.0;
            tracker.start(slot[target_direction] = line_of_sight(angle, slot), speed_sensor.scale * y.speed / ratio,
                          slot);
        }
        if (field_orientation) {
            field_orientation->start(y.rotor_angle, y.rotor_speed, slot);
            set_course(WindingCourse::at(field_orientation->winding, y.time, {}, {}, y.rotor_speed), slot);
        }
    }

    // One tick. Returns false if the user's own law has failed, or the command is no number.
    bool step(std::int64_t tick, double tick_length, const Sampled& y, double* slot) const {
        const double time = static_cast<double>(tick) * tick_length;
        double command = slot[computed_command];
        slot[speed_angle] = speed_sensor.scale * speed_sensor.encoder(y.speed_angle, tick, slot);
        if (two_encoders)
            slot[position_angle] = position_sensor.scale * position_sensor.encoder(y.position_angle, tick, slot);
        if (camera.present) watch(tick, tick_length, y, slot);
        if (speed_schedule.due(tick)) {
            const double T = tick_length * speed_schedule.every;
            slot[measured_speed] = estimate(slot[speed_angle], speed_sensor.scale * y.speed, slot[torque_reference],
                                            speed_schedule.sample(tick), T, slot);
            if (load_observer.present) load_observer.observe(y.motor_torque, slot[measured_speed], inverse_model, slot);
        }
        if (own_law.present()) {
            if (!run_own_law(time, y, command, slot)) return false;
        } else {
            if (mode == position_mode && position_schedule.due(tick))
                run_position_loop(time, tick_length * position_schedule.every, slot);
            if (mode != torque_mode && speed_schedule.due(tick))
                run_speed_loop(time, tick_length * speed_schedule.every, slot);
            if (mode == torque_mode) slot[torque_reference] = reference.at(time).value;
            if (field_orientation) {
                if (current_schedule.due(tick))
                    field_orientation->control(slot[torque_reference], reading(y, slot), slot);
            } else if (!current_loop) {
                command = slot[torque_reference] / rated_torque;
            } else if (current_schedule.due(tick)) {
                command = (*current_loop)(slot[torque_reference], y.motor_torque, slot[measured_speed], slot);
            }
        }
        if (field_orientation) {
            if (!field_orientation->finite(slot)) return false;
            field_orientation->act(tick, slot);
            return true;
        }
        if (!std::isfinite(command)) return false;
        slot[computed_command] = command;
        slot[acting_command] = delay(command, tick, slot);
        return true;
    }
    // What acts on the motor from this tick on, of an axis without a winding.
    double command(const double* slot) const { return slot[acting_command]; }
    static int command_slot() { return acting_command; }
    static double signal(int s, const double* slot) { return slot[s]; }

    // Of the winding, from the last exchange of torque and speed on.
    WindingCourse course(const double* slot) const {
        static_assert(std::is_trivially_copyable_v<WindingCourse>);
        WindingCourse c;
        std::memcpy(static_cast<void*>(&c), slot + course_, sizeof c);
        return c;
    }
    double course_end(const double* slot) const { return slot[course_ + 1]; }
    // The next one, from where the last one has been followed up to.
    void set_course(const WindingCourse& next, double* slot) const {
        const auto [electrical, heat] = energy(next.begin, course(slot), slot);
        slot[energy_] = electrical;
        slot[energy_ + 1] = heat;
        std::memcpy(slot + course_, &next, sizeof next);
    }
    // What acts on the motor as a torque source, in a straight line.
    Ramp torque_command(double time, const double* slot) const {
        const WindingCourse c = course(slot);
        return {(c.torque.value + c.torque.slope * (time - c.begin)) / rated_torque, c.torque.slope / rated_torque};
    }
    double winding_torque(double time, const double* slot) const {
        const DirectQuadrature i = course(slot).current(time);
        return field_orientation->winding.torque(i.d, i.q);
    }
    std::array<double, n_winding_signals> winding_signals(double time, const double* slot) const {
        const WindingCourse c = course(slot);
        const DirectQuadrature i = c.current(time), u = c.voltage(time);
        const auto [electrical, heat] = energy(time, c, slot);
        return {i.d, i.q, u.d, u.q, electrical, heat};
    }

 private:
    // Beside the signals: the angles as read, how far the second encoder's is taken over, and the command.
    enum OwnSlot : int {
        speed_angle = n_axis_signals,
        position_angle,
        blended,
        computed_command,
        acting_command,
        n_own_slots
    };

    // What the loops follow.
    ReferencePoint wanted(double time, const double* slot) const {
        return camera.present ? tracker.at(time, slot) : reference.at(time);
    }
    // Of the reference's shaft, without blending.
    double line_of_sight(double speed_encoder, const double* slot) const {
        return two_encoders ? slot[position_angle] : speed_encoder / ratio;
    }
    void watch(std::int64_t tick, double tick_length, const Sampled& y, double* slot) const {
        const double time = static_cast<double>(tick) * tick_length;
        camera.expose(tick, reference.at(time).value - y.shaft_angle, line_of_sight(slot[speed_angle], slot), slot);
        if (!camera.arrives(tick)) return;
        const Camera::Frame frame = camera.arrived(tick, slot);
        slot[target_seen] = frame.seen ? 1.0 : 0.0;
        if (!frame.seen) return;
        slot[target_direction] = frame.direction;
        tracker(frame.direction, static_cast<double>(tick - camera.latency) * tick_length, slot);
    }

    void run_position_loop(double time, double T, double* slot) const {
        const ReferencePoint ahead = wanted(time, slot);
        slot[position_reference] = reference_delay == 0.0 ? ahead.value : wanted(time - reference_delay, slot).value;
        slot[measured_position] = position(slot);
        const InverseModel::Ahead twist =
            inverse_model.twist(ahead.rate, ahead.second, load_observer.load(slot), T, slot);
        const double e =
            slot[position_reference] + backlash(ahead.rate, T, slot) + twist.angle - slot[measured_position];
        slot[speed_reference] = ratio * position_loop(e, ahead.rate + twist.rate, T, slot);
    }

    void run_speed_loop(double time, double T, double* slot) const {
        const ReferencePoint r = wanted(time, slot);
        if (mode == speed_mode) slot[speed_reference] = ratio * r.value;
        const double speed_ahead = mode == speed_mode ? r.value : r.rate,
                     gain_ahead = mode == speed_mode ? r.rate : r.second;
        double speed = slot[speed_reference];
        for (const DiscreteSystem& f : speed_filters) speed = f(speed, slot);
        const double known = inverse_model.present
                                 ? inverse_model.torque(speed_ahead, gain_ahead, load_observer.load(slot),
                                                        speed - slot[measured_speed], T, slot)
                                 : feedforward(ratio * speed_ahead, ratio * gain_ahead);
        const double limit = field_orientation
                                 ? std::fmin(speed_loop.torque_limit, field_orientation->available_torque(slot))
                                 : speed_loop.torque_limit;
        double M =
            load_observer.schedule(speed_loop, inverse_model, slot)(speed, slot[measured_speed], known, limit, T, slot);
        show_model(slot);
        for (const DiscreteSystem& f : torque_filters) M = f(M, slot);
        slot[torque_reference] = std::clamp(M, -limit, limit);
    }

    FieldOrientation::Reading reading(const Sampled& y, const double* slot) const {
        return {commutates_by_encoder ? slot[speed_angle] : y.rotor_angle, slot[measured_speed], y.rotor_angle,
                course(slot).current(y.time)};
    }
    WindingCourse::Energy energy(double time, const WindingCourse& c, const double* slot) const {
        const auto [electrical, heat] = c.energy(field_orientation->winding, c.begin, time);
        return {slot[energy_] + electrical, slot[energy_ + 1] + heat};
    }

    void show_model(double* slot) const {
        if (!inverse_model.present) return;
        slot[loss_factor] = inverse_model.loss_factor_now(slot);
        slot[friction_torque] = inverse_model.friction_now(slot);
        slot[load_torque] = load_observer.load(slot);
    }

    bool run_own_law(double time, const Sampled& y, double& command, double* slot) const {
        slot[measured_position] = position(slot);
        const ReferencePoint r = wanted(time, slot);
        slot[mode == position_mode ? position_reference
             : mode == speed_mode  ? speed_reference
                                   : torque_reference] = mode == speed_mode ? ratio * r.value : r.value;
        std::array<double, 5> measured{slot[measured_position], slot[measured_speed], y.motor_torque};
        const std::array<double, 4> asked{r.value, r.rate, r.second, r.third};
        std::array<double, 2> given{command};
        if (field_orientation) {
            const FieldOrientation::Reading seen = reading(y, slot);
            const DirectQuadrature i = field_orientation->measured(seen);
            measured[3] = i.d;
            measured[4] = i.q;
            if (own_law(time, measured.data(), asked.data(), given.data(), slot) != 0) return false;
            field_orientation->command({given[0], given[1]}, seen, slot);
            return true;
        }
        if (own_law(time, measured.data(), asked.data(), given.data(), slot) != 0) return false;
        command = given[0];
        return true;
    }

    // Of the reference's shaft. With two encoders that of the motor, and what that of the load says beyond it by and
    // by.
    double position(double* slot) const {
        const double by_motor = slot[speed_angle] / ratio;
        if (!two_encoders) return by_motor;
        slot[blended] += position_share * (slot[position_angle] - by_motor - slot[blended]);
        return by_motor + slot[blended];
    }

    int slots_ = 0, course_ = 0, energy_ = 0;
};

}  // namespace lostmotion::control
