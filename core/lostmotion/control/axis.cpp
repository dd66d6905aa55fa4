#include "axis.hpp"

#include <numeric>

namespace lostmotion::control {

void Axis::place(double sample_time) {
    Slots slots;
    slots.take(n_own_slots);
    delay.place(slots);
    speed_sensor.encoder.place(slots);
    if (two_encoders) position_sensor.encoder.place(slots);
    const double of_speed = sample_time * speed_schedule.every;
    estimate.place(slots, of_speed);
    position_loop.place(slots);
    speed_loop.place(slots);
    firmware.place(slots, sample_time * position_schedule.every);
    blend_filter_.place(sample_time * position_schedule.every, blend_time);
    if (current_loop) current_loop->place(slots, sample_time * current_schedule.every);
    if (field_orientation) {
        field_orientation->place(slots);
        course_ = slots.take(sizeof(WindingCourse) / sizeof(double));
        energy_ = slots.take(2);
    }
    feedforward.place(slots);
    inverse_model.place(slots);
    load_observer.place(slots, of_speed);
    for (auto* filters : {&speed_filters, &torque_filters})
        for (DiscreteSystem& f : *filters) f.place(slots);
    own_law.place(slots);
    camera.place(slots);
    if (camera.present) tracker.place(slots);
    // At each sample of the controller, however the loops divide them.
    shaped_every_ = std::gcd(std::gcd(position_schedule.every, position_schedule.phase),
                             std::gcd(speed_schedule.every, current_schedule.every));
    shaper.place(slots, sample_time * shaped_every_);
    slots_ = slots.count();
}

std::vector<int> Axis::running_slots() const {
    if (!field_orientation) return {};
    static_assert(offsetof(WindingCourse, begin) == 0 && offsetof(WindingCourse, end) == sizeof(double));
    return {course_, course_ + 1, energy_, energy_ + 1};
}

void Axis::start(const Sampled& y, double sample_time, double* slot) const {
    std::fill_n(slot, slots_, 0.0);
    speed_sensor.encoder.start(y.speed_angle, slot);
    if (two_encoders) position_sensor.encoder.start(y.position_angle, slot);
    const double angle = speed_sensor.scale * speed_sensor.encoder.reading(y.speed_angle);
    estimate.start(angle, speed_sensor.scale * y.speed, sample_time * speed_schedule.every, slot);
    inverse_model.start(slot);
    load_observer.start(speed_sensor.scale * y.speed, inverse_model, slot);
    show_model(slot);
    if (two_encoders)
        slot[blended] = position_sensor.scale * position_sensor.encoder.reading(y.position_angle) - angle / ratio;
    const double followed = mode == position_mode ? angle / ratio + slot[blended]
                            : mode == speed_mode  ? speed_sensor.scale * y.speed / ratio
                                                  : y.motor_torque;
    shaper.start(followed, slot);
    if (camera.present) {
        slot[position_angle] =
            two_encoders ? position_sensor.scale * position_sensor.encoder.reading(y.position_angle) : 0.0;
        tracker.start(slot[target_direction] = line_of_sight(angle, slot), speed_sensor.scale * y.speed / ratio, slot);
    }
    firmware.start(angle / ratio + slot[blended], wanted(y.time, slot).value, slot);
    if (field_orientation) {
        field_orientation->start(y.rotor_angle, y.rotor_speed, slot);
        set_course(WindingCourse::at(field_orientation->winding, y.time, {}, {}, y.rotor_speed), slot);
    }
}

bool Axis::step(std::int64_t sample, double sample_time, const Sampled& y, double* slot) const {
    const double time = static_cast<double>(sample) * sample_time;
    double command = slot[computed_command];
    slot[speed_angle] = speed_sensor.scale * speed_sensor.encoder(y.speed_angle, slot);
    if (two_encoders) slot[position_angle] = position_sensor.scale * position_sensor.encoder(y.position_angle, slot);
    if (camera.present) watch(sample, sample_time, y, slot);
    if (shaper.present() && sample % shaped_every_ == 0) shaper.step(unshaped(time, slot), slot);
    if (speed_schedule.due(sample)) {
        const double T = sample_time * speed_schedule.every;
        const double acts = voltage_at_limit(slot) == 0.0 ? slot[torque_reference] : y.motor_torque;
        slot[measured_speed] = estimate(slot[speed_angle], speed_sensor.scale * y.speed, acts, T, slot);
        if (load_observer.present) load_observer.observe(y.motor_torque, slot[measured_speed], inverse_model, slot);
    }
    if (own_law.present()) {
        if (!run_own_law(time, y, command, slot)) return false;
        if (std::isfinite(command)) command = in_range(command, torque_range(y, slot));
    } else {
        if (mode == position_mode && position_schedule.due(sample)) {
            if (firmware.present)
                run_firmware(time, sample_time * position_schedule.every, y, slot);
            else
                run_position_loop(time, sample_time * position_schedule.every, slot);
        }
        if (mode != torque_mode && !firmware.present && speed_schedule.due(sample))
            run_speed_loop(time, sample_time * speed_schedule.every, torque_range(y, slot), slot);
        if (mode == torque_mode) {
            const double asked = wanted(time, slot).value;  // field orientation limits it by itself
            slot[torque_reference] = field_orientation ? asked : torque_range(y, slot)(asked);
        }
        if (field_orientation) {
            if (current_schedule.due(sample))
                field_orientation->control(slot[torque_reference], reading(y, slot), slot);
        } else if (!current_loop) {
            command = in_range(slot[torque_reference] / rated_torque, torque_range(y, slot));
        } else if (current_schedule.due(sample)) {
            command = (*current_loop)(slot[torque_reference], taken(Loop::current, y.motor_torque),
                                      slot[measured_speed], slot);
        }
    }
    if (field_orientation) {
        if (!field_orientation->finite(slot)) return false;
        field_orientation->act(slot);
        return true;
    }
    if (!std::isfinite(command)) return false;
    slot[computed_command] = command;
    slot[acting_command] = delay(command, slot);
    return true;
}

auto Axis::course(const double* slot) const -> WindingCourse {
    static_assert(std::is_trivially_copyable_v<WindingCourse>);
    WindingCourse c;
    std::memcpy(static_cast<void*>(&c), slot + course_, sizeof c);
    return c;
}

void Axis::set_course(const WindingCourse& next, double* slot) const {
    const auto [electrical, heat] = energy(next.begin, course(slot), slot);
    slot[energy_] = electrical;
    slot[energy_ + 1] = heat;
    std::memcpy(slot + course_, &next, sizeof next);
}

auto Axis::torque_command(double time, const double* slot) const -> Ramp {
    const WindingCourse c = course(slot);
    return {(c.torque.value + c.torque.slope * (time - c.begin)) / rated_torque, c.torque.slope / rated_torque};
}

double Axis::winding_torque(double time, const double* slot) const {
    const DirectQuadrature i = course(slot).current(time);
    return field_orientation->winding.torque(i.d, i.q);
}

std::array<double, n_winding_signals> Axis::winding_signals(double time, const double* slot) const {
    const WindingCourse c = course(slot);
    const DirectQuadrature i = c.current(time), u = c.voltage(time);
    const auto [electrical, heat] = energy(time, c, slot);
    return {i.d, i.q, u.d, u.q, electrical, heat};
}

auto Axis::torque_range(const Sampled& y, const double* slot) const -> TorqueRange {
    double most = std::fmin(speed_loop.torque_limit, torque_limit);
    if (field_orientation) most = std::fmin(most, field_orientation->available_torque(slot));
    if (stall_torque == std::numeric_limits<double>::infinity()) return {-most, most};
    const double fallen = torque_droop * y.rotor_speed;
    const TorqueRange by_voltage{-stall_torque - fallen, stall_torque - fallen};
    return {by_voltage(-most), by_voltage(most)};
}

double Axis::voltage_at_limit(const double* slot) const {
    return field_orientation ? field_orientation->at_limit(slot) : current_loop ? current_loop->at_limit(slot) : 0.0;
}

double Axis::at_limit(const double* slot) const {
    const double by_voltage = voltage_at_limit(slot);
    return by_voltage != 0.0 ? by_voltage : slot[torque_at_limit];
}

void Axis::watch(std::int64_t sample, double sample_time, const Sampled& y, double* slot) const {
    const double time = static_cast<double>(sample) * sample_time;
    camera.expose(sample, reference.at(time).value - y.shaft_angle, line_of_sight(slot[speed_angle], slot), slot);
    if (!camera.arrives(sample)) return;
    const Camera::Frame frame = camera.arrived(sample, slot);
    slot[target_seen] = frame.seen ? 1.0 : 0.0;
    if (!frame.seen) return;
    slot[target_direction] = frame.direction;
    tracker(frame.direction, static_cast<double>(sample - camera.late) * sample_time, slot);
}

void Axis::run_position_loop(double time, double T, double* slot) const {
    const ReferencePoint r = wanted(time, slot);
    const double reference_delay = position_loop.reference_delay;
    slot[position_reference] = reference_delay == 0.0 ? r.value : wanted(time - reference_delay, slot).value;
    slot[measured_position] = position(slot);
    const InverseModel::Twist twist = inverse_model.twist(r.rate, r.acceleration, load_observer.load(slot), T, slot);
    const double e = slot[position_reference] + feedforward.offset(r.rate, T, slot) + twist.angle -
                     taken(Loop::position, slot[measured_position]);
    slot[speed_reference] = ratio * position_loop(e, r.rate + twist.rate, sign_of(ratio) * at_limit(slot), T, slot);
}

void Axis::run_firmware(double time, double T, const Sampled& y, double* slot) const {
    slot[position_reference] = firmware.followed(wanted(time, slot).value, T, slot);
    slot[measured_position] = position(slot);
    const double e = slot[position_reference] - firmware.filtered(slot[measured_position], slot);
    const double M = firmware.torque(sign_of(ratio) * firmware.duty(e), y.rotor_speed);
    slot[torque_reference] = torque_range(y, slot)(M);
}

void Axis::run_speed_loop(double time, double T, TorqueRange range, double* slot) const {
    const ReferencePoint r = wanted(time, slot);
    if (mode == speed_mode) slot[speed_reference] = ratio * r.value;
    const double feedforward_speed = mode == speed_mode ? r.value : r.rate,
                 feedforward_acceleration = mode == speed_mode ? r.rate : r.acceleration;
    double speed = slot[speed_reference];
    for (const DiscreteSystem& f : speed_filters) speed = f(speed, slot);
    InverseModel::Known known{feedforward.torque(ratio * feedforward_speed, ratio * feedforward_acceleration)};
    if (inverse_model.present)
        known = inverse_model.torque(feedforward_speed, feedforward_acceleration, load_observer.load(slot), slot);
    double M = load_observer.schedule(speed_loop, inverse_model, slot)(
        speed, taken(Loop::speed, slot[measured_speed]), known.torque, range, voltage_at_limit(slot), T, slot);
    for (const DiscreteSystem& f : torque_filters) M = f(M, slot);
    slot[torque_reference] = range(M);
    slot[torque_at_limit] = range.at_limit(slot[torque_reference]);
    // At a limit of the torque the error says nothing of the model.
    if (const double error = speed - slot[measured_speed]; inverse_model.present && error * at_limit(slot) <= 0.0)
        inverse_model.adapt(known, error, T, slot);
    show_model(slot);
}

auto Axis::reading(const Sampled& y, const double* slot) const -> FieldOrientation::Reading {
    return {commutates_by_encoder ? slot[speed_angle] : y.rotor_angle, slot[measured_speed], y.rotor_angle,
            course(slot).current(y.time)};
}

auto Axis::energy(double time, const WindingCourse& c, const double* slot) const -> WindingCourse::Energy {
    const auto [electrical, heat] = c.energy(field_orientation->winding, c.begin, time);
    return {slot[energy_] + electrical, slot[energy_ + 1] + heat};
}

void Axis::show_model(double* slot) const {
    if (!inverse_model.present) return;
    slot[loss_factor] = inverse_model.loss_factor_now(slot);
    slot[friction_torque] = inverse_model.friction_now(slot);
    slot[load_torque] = load_observer.load(slot);
}

bool Axis::run_own_law(double time, const Sampled& y, double& command, double* slot) const {
    slot[measured_position] = position(slot);
    const ReferencePoint r = wanted(time, slot);
    slot[mode == position_mode ? position_reference
         : mode == speed_mode  ? speed_reference
                               : torque_reference] = mode == speed_mode ? ratio * r.value : r.value;
    std::array<double, 5> measured{slot[measured_position], slot[measured_speed], y.motor_torque};
    const std::array<double, 4> asked{r.value, r.rate, r.acceleration, r.jerk};
    std::array<double, 2> given{command};
    if (field_orientation) {
        const FieldOrientation::Reading seen = reading(y, slot);
        const DirectQuadrature i = field_orientation->measured(seen);
        measured[3] = i.d;
        measured[4] = i.q;
        if (own_law(time, measured.data(), asked.data(), given.data(), slot) != 0) return false;
        field_orientation->command(field_orientation->within_limits({given[0], given[1]}), seen, slot);
        return true;
    }
    if (own_law(time, measured.data(), asked.data(), given.data(), slot) != 0) return false;
    command = given[0];
    return true;
}

double Axis::position(double* slot) const {
    const double by_motor = slot[speed_angle] / ratio;
    if (!two_encoders) return by_motor;
    blend_filter_(slot[position_angle] - by_motor, slot[blended]);
    return by_motor + slot[blended];
}

}  // namespace lostmotion::control
