// The controller of one motor: reference, position, speed and current loop at their sample times.
//
//   sample k:  sample        compute, outermost first                                       apply
//            encoders -> [position loop] -> w* -> [speed loop] -> M* -> [current loop] -> E, `delay` samples later
//
// All loops that are due at a sample use its samples; what is not due keeps its last output.
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
#include "firmware.hpp"
#include "inverse_model.hpp"
#include "load_observer.hpp"
#include "own_law.hpp"
#include "position_loop.hpp"
#include "reference_blocks.hpp"
#include "speed_estimate.hpp"
#include "speed_loop.hpp"
#include "tracker.hpp"

namespace lostmotion::control {

// When a loop runs: at the samples phase, phase + every, ...
struct Schedule {
    int every = 1, phase = 0;

    bool due(std::int64_t sample) const { return sample >= phase && (sample - phase) % every == 0; }
};

enum class Loop { none, current, speed, position };

// What one loop takes for its measured value, whatever is measured: the loop is cut there.
struct Cut {
    Loop loop = Loop::none;
    double value = 0.0;
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

// What an axis shows, held from sample to sample.
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
// The same where the motor moves a slide, or the position is that of one.
inline AxisSignalName axis_signal_name(int signal, bool motor_slides, bool position_slides) {
    AxisSignalName named = axis_signal_names[static_cast<std::size_t>(signal)];
    const bool position = signal == position_reference || signal == measured_position;
    if (position && position_slides)
        named.meaning = signal == position_reference ? "position that the controller wants"
                                                     : "position that the controller has read";
    if ((position || signal == target_direction) && position_slides) named.unit = "m";
    if ((signal == speed_reference || signal == measured_speed) && motor_slides) named.unit = "m/s";
    if ((signal == torque_reference || signal == friction_torque) && motor_slides) named.unit = "N";
    if (signal == load_torque && position_slides) named.unit = "N";
    return named;
}

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
    Tracker tracker;            // of what the camera sees; the loops follow it
    ReferenceShaper shaper;     // of what the loops follow
    double ratio = 1.0;         // turns of the motor for one of the reference's shaft
    double rated_torque = 1.0;  // [N m] of command 1, without a current loop
    double torque_limit = std::numeric_limits<double>::infinity();  // [N m] at the largest current
    // Of the torque at the largest voltage, where no current loop keeps to it: at standstill [N m], and by how much it
    // falls with the speed [N m s/rad].
    double stall_torque = std::numeric_limits<double>::infinity(), torque_droop = 0.0;
    SampleDelay delay;  // until the command acts

    Sensor speed_sensor;        // to the motor
    Sensor position_sensor;     // to the reference's shaft
    bool two_encoders = false;  // else that of the speed serves both
    double blend_time = 0.0;    // [s] with which the difference of both angles is taken over
    SpeedEstimate estimate;
    Schedule position_schedule, speed_schedule, current_schedule;
    PositionLoop position_loop;
    SpeedLoop speed_loop;
    Firmware firmware;  // in the place of both
    std::optional<CurrentLoop> current_loop;
    std::optional<FieldOrientation> field_orientation;  // in its place
    bool commutates_by_encoder = true;                  // of the speed; else the angle of the rotor is known
    Feedforward feedforward;
    InverseModel inverse_model;  // in the place of feedforward and backlash
    LoadObserver load_observer;
    std::vector<DiscreteSystem> speed_filters, torque_filters;
    OwnLaw own_law;  // instead of all loops
    Cut cut;         // in a linear model

    // Gives each block its slots and what it derives from its parameters. Once, after all has been set.
    void place(double sample_time);
    int slots() const { return slots_; }
    // Those of a winding that go on with time: instants and energies. A motion that repeats does not bring them back.
    std::vector<int> running_slots() const;

    // Before the first sample: the drive as it is, the integrators empty.
    void start(const Sampled& y, double sample_time, double* slot) const;

    // One sample. Returns false if the user's own law has failed, or the command is no number.
    bool step(std::int64_t sample, double sample_time, const Sampled& y, double* slot) const;
    double taken(Loop loop, double measured) const { return cut.loop == loop ? cut.value : measured; }
    // What acts on the motor from this sample on, of an axis without a winding.
    double command(const double* slot) const { return slot[acting_command]; }
    static int command_slot() { return acting_command; }
    static int speed_angle_slot() { return speed_angle; }
    static double signal(int s, const double* slot) { return slot[s]; }

    // Of the winding, from the last exchange of torque and speed on.
    WindingCourse course(const double* slot) const;
    double course_end(const double* slot) const { return slot[course_ + 1]; }
    // The next one, from where the last one has been followed up to.
    void set_course(const WindingCourse& next, double* slot) const;
    // What acts on the motor as a torque source, in a straight line.
    Ramp torque_command(double time, const double* slot) const;
    double winding_torque(double time, const double* slot) const;
    std::array<double, n_winding_signals> winding_signals(double time, const double* slot) const;

 private:
    // Beside the signals: the angles as read, how far the second encoder's is taken over, the command, and the sign of
    // the limit that the speed loop's torque is at.
    enum OwnSlot : int {
        speed_angle = n_axis_signals,
        position_angle,
        blended,
        computed_command,
        acting_command,
        torque_at_limit,
        n_own_slots
    };

    // The torque that is possible at the speed of the rotor. Where the induced voltage alone makes more than the
    // largest current, that of the voltage is all there is.
    TorqueRange torque_range(const Sampled& y, const double* slot) const;
    double in_range(double command, TorqueRange range) const {
        return std::clamp(command, range.low / rated_torque, range.high / rated_torque);
    }
    // Sign of the torque that the voltage allows no more of, or 0.
    double voltage_at_limit(const double* slot) const;
    // The same by any limit of the torque.
    double at_limit(const double* slot) const;

    ReferencePoint unshaped(double time, const double* slot) const {
        return camera.present ? tracker.at(time, slot) : reference.at(time);
    }
    // What the loops follow.
    ReferencePoint wanted(double time, const double* slot) const {
        return shaper.present() ? shaper.output(slot) : unshaped(time, slot);
    }
    // Of the reference's shaft, without blending.
    double line_of_sight(double speed_encoder, const double* slot) const {
        return two_encoders ? slot[position_angle] : speed_encoder / ratio;
    }
    void watch(std::int64_t sample, double sample_time, const Sampled& y, double* slot) const;

    void run_position_loop(double time, double T, double* slot) const;

    void run_firmware(double time, double T, const Sampled& y, double* slot) const;

    void run_speed_loop(double time, double T, TorqueRange range, double* slot) const;

    FieldOrientation::Reading reading(const Sampled& y, const double* slot) const;
    WindingCourse::Energy energy(double time, const WindingCourse& c, const double* slot) const;

    void show_model(double* slot) const;

    bool run_own_law(double time, const Sampled& y, double& command, double* slot) const;

    // Of the reference's shaft. With two encoders that of the motor, and what that of the load says beyond it by and
    // by.
    double position(double* slot) const;

    LowPass blend_filter_;
    int shaped_every_ = 1;  // samples
    int slots_ = 0, course_ = 0, energy_ = 0;
};

}  // namespace lostmotion::control
