// Controllers of axes.
#pragma once

#include <nanobind/stl/optional.h>

#include <memory>
#include <optional>
#include <string>
#include <tuple>
#include <vector>

#include "arrays.hpp"
#include "lostmotion/control/linear_step.hpp"
#include "lostmotion/simulation/train_control.hpp"

namespace lostmotion::binding {

// A controller that is a Python function. What it raises ends the run and is raised again after it.
class [[gnu::visibility("hidden")]] PythonLaw {
 public:
    // voltages: it gives u_d and u_q of a winding, and is told i_d and i_q.
    PythonLaw(nb::callable function, int states, bool voltages)
        : function_(std::move(function)), states_(states), voltages_(voltages) {}

    static int call(double time, const double* measured, const double* reference, double* state, double* command,
                    void* data) {
        auto& self = *static_cast<PythonLaw*>(data);
        const nb::gil_scoped_acquire hold;
        try {
            const Array slots(state, {static_cast<std::size_t>(self.states_)}, nb::handle());
            const nb::object read =
                self.voltages_ ? nb::make_tuple(measured[0], measured[1], measured[2], measured[3], measured[4])
                               : nb::make_tuple(measured[0], measured[1], measured[2]);
            const nb::object given =
                self.function_(time, read, nb::make_tuple(reference[0], reference[1], reference[2], reference[3]),
                               nb::cast(slots, nb::rv_policy::reference));
            std::pair<double, double> both;
            if (self.voltages_ && nb::try_cast(given, both)) {
                command[0] = both.first;
                command[1] = both.second;
                return 0;
            }
            if (self.voltages_ || !nb::try_cast<double>(given, *command))
                throw nb::type_error(("law: returned " + std::string(nb::repr(given).c_str()) + "; it must return " +
                                      (self.voltages_ ? "the voltages (u_d, u_q)" : "the command, a number"))
                                         .c_str());
            return 0;
        } catch (...) {
            self.raised_ = std::current_exception();
            return 1;
        }
    }
    // With the lock of the interpreter.
    void raise_again() {
        if (raised_) std::rethrow_exception(std::exchange(raised_, nullptr));
    }

 private:
    nb::callable function_;
    int states_;
    bool voltages_;
    std::exception_ptr raised_;
};

struct [[gnu::visibility("hidden")]] BoundAxis : control::Axis {
    std::shared_ptr<PythonLaw> python_law;

    void set_python_law(nb::callable function, int states) {
        python_law = std::make_shared<PythonLaw>(std::move(function), states, field_orientation.has_value());
        own_law = {};
        own_law.function = PythonLaw::call;
        own_law.data = python_law.get();
        own_law.states = states;
    }
    // The address of a function of the type control::OwnLawFunction, and of what it is given.
    void set_compiled_law(std::size_t function, std::size_t data, int states) {
        own_law = {};
        own_law.function = reinterpret_cast<control::OwnLawFunction>(function);
        own_law.data = reinterpret_cast<void*>(data);
        own_law.states = states;
    }
    void raise_again() const {
        if (python_law) python_law->raise_again();
    }
    void set_reference(const std::vector<std::array<double, 5>>& pieces,
                       const std::vector<std::array<double, 3>>& sines) {
        reference = {};
        reference.pieces.clear();
        for (const auto& [time, value, rate, second, third] : pieces)
            reference.pieces.push_back({time, {value, rate, second, third}});
        for (const auto& [amplitude, frequency, phase] : sines)
            reference.sines.push_back({amplitude, frequency, phase});
    }
};

// Base tick [s]; of each axis its controller, motor, the shafts with the encoders of position and speed, and that of
// the reference.
using BoundControl = std::pair<double, std::vector<std::tuple<BoundAxis, int, int, int, int>>>;

inline Control control_of(const BoundControl& bound) {
    Control c;
    c.tick = bound.first;
    for (const auto& [axis, motor, position_shaft, speed_shaft, reference_shaft] : bound.second)
        c.axes.push_back({axis, motor, position_shaft, speed_shaft, reference_shaft});
    return c;
}
inline void raise_again(const BoundControl& bound) {
    for (const auto& each : bound.second) std::get<0>(each).raise_again();
}

// Of what the axes show in a run: the shape, and room for it.
template <class Options>
std::vector<std::size_t> control_shape(const Options& options) {
    return {options.control.axes.size(), static_cast<std::size_t>(options.control.signals()), options.samples};
}
template <class Options>
std::unique_ptr<double[]> control_room(Options& options) {
    const std::vector<std::size_t> shape = control_shape(options);
    auto room = std::make_unique_for_overwrite<double[]>(shape[0] * shape[1] * shape[2]);
    options.control_out = room.get();
    return room;
}

inline Array as_array(const control::LinearStep& step) {
    auto data = std::make_unique_for_overwrite<double[]>(step.rows.size());
    std::copy(step.rows.begin(), step.rows.end(), data.get());
    return as_array(std::move(data), {step.rows.size() / step.columns, step.columns});
}

inline void bind_linear_steps(nb::module_& m) {
    using namespace control;
    nb::enum_<Loop>(m, "Loop")
        .value("current", Loop::current)
        .value("speed", Loop::speed)
        .value("position", Loop::position);
    nb::enum_<CurrentAxis>(m, "CurrentAxis")
        .value("none", CurrentAxis::none)
        .value("direct", CurrentAxis::direct)
        .value("quadrature", CurrentAxis::quadrature);
    m.def(
        "linear_step",
        [](const BoundAxis& axis, Loop outermost, bool cut, std::int64_t tick, double tick_length) {
            return as_array(linear_step(axis, outermost, cut, tick, tick_length));
        },
        "axis"_a, "outermost"_a, "cut"_a, "tick"_a, "tick_length"_a,
        nb::sig("def linear_step(axis: Axis, outermost: Loop, cut: bool, tick: int, tick_length: float) -> "
                "numpy.typing.NDArray[numpy.float64]"),
        "Slots after a sample step, over the slots before it and (angle of the position's encoder, angle and speed of "
        "the speed's, torque of the motor, value, rate and acceleration of the reference, measured value of a loop "
        "that is cut).");
    m.def(
        "linear_orientation",
        [](const FieldOrientation& law, double speed, double lag, double torque, double weakening,
           std::pair<double, double> current, std::pair<double, double> voltage, CurrentAxis outermost, bool cut,
           int every, int since, double tick_length) {
            const SteadyOrientation motion{
                speed, lag, torque, weakening, {current.first, current.second}, {voltage.first, voltage.second}};
            return as_array(linear_orientation(law, motion, outermost, cut, every, since, tick_length));
        },
        "law"_a, "speed"_a, "lag"_a, "torque"_a, "weakening"_a, "current"_a, "voltage"_a, "outermost"_a, "cut"_a,
        "every"_a, "since"_a, "tick_length"_a,
        nb::sig("def linear_orientation(law: FieldOrientation, speed: float, lag: float, torque: float, weakening: "
                "float, current: tuple[float, float], voltage: tuple[float, float], outermost: CurrentAxis, cut: bool, "
                "every: int, since: int, tick_length: float) -> numpy.typing.NDArray[numpy.float64]"),
        "Slots of the field orientation after a tick, the voltage (u_d, u_q) that acts and the measured currents, over "
        "the slots before it and (torque that is asked for; speed, angle as it is read and angle of the rotor; i_d, "
        "i_q; reference and measured value of the current that is looked at).");
}

template <class Names>
std::vector<std::tuple<std::string, std::string, std::string>> signal_names(const Names& names) {
    std::vector<std::tuple<std::string, std::string, std::string>> out;
    for (const auto& [name, unit, meaning] : names) out.emplace_back(name, unit, meaning);
    return out;
}

inline void bind_inverse_model(nb::module_& m) {
    using namespace control;
    nb::class_<GearLosses> losses(m, "GearLosses");
    nb::enum_<GearLosses::Kind>(losses, "Kind")
        .value("none", GearLosses::none)
        .value("efficiency", GearLosses::constant_efficiency)
        .value("map", GearLosses::loss_map);
    losses.def(nb::init<>())
        .def_rw("kind", &GearLosses::kind)
        .def_rw("ratio", &GearLosses::ratio)
        .def_rw("efficiency", &GearLosses::efficiency)
        .def_rw("map", &GearLosses::map)
        .def_rw("rated_torque", &GearLosses::rated_torque)
        .def_rw("rated_speed", &GearLosses::rated_speed)
        .def("__call__", &GearLosses::operator(), "output_torque"_a, "direction"_a, "speed"_a)
        .def("output_torque", &GearLosses::output_torque, "input_torque"_a, "direction"_a, "speed"_a, "factor"_a);
    nb::class_<Adaptation>(m, "Adaptation")
        .def(nb::init<>())
        .def_rw("rate", &Adaptation::rate)
        .def_rw("min", &Adaptation::min)
        .def_rw("max", &Adaptation::max);
    nb::class_<InverseModel>(m, "InverseModel")
        .def(nb::init<>())
        .def_rw("present", &InverseModel::present)
        .def_rw("motor_inertia", &InverseModel::motor_inertia)
        .def_rw("motor_viscous_friction", &InverseModel::motor_viscous_friction)
        .def_rw("load_inertia", &InverseModel::load_inertia)
        .def_rw("load_viscous_friction", &InverseModel::load_viscous_friction)
        .def_rw("load_torque", &InverseModel::load_torque)
        .def_rw("losses", &InverseModel::losses)
        .def_rw("loss_factor", &InverseModel::loss_factor)
        .def_rw("friction_torque", &InverseModel::friction_torque)
        .def_rw("of_losses", &InverseModel::of_losses)
        .def_rw("of_friction", &InverseModel::of_friction)
        .def_rw("min_speed", &InverseModel::min_speed)
        .def_rw("through_gear", &InverseModel::through_gear)
        .def_rw("curve", &InverseModel::curve)
        .def_rw("twist_rate", &InverseModel::twist_rate);
    nb::class_<LoadObserver>(m, "LoadObserver")
        .def(nb::init<>())
        .def_rw("present", &LoadObserver::present)
        .def_rw("input_time", &LoadObserver::input_time)
        .def_rw("load_time", &LoadObserver::load_time)
        .def_rw("input_share", &LoadObserver::input_share)
        .def_rw("load_share", &LoadObserver::load_share)
        .def_rw("bandwidth", &LoadObserver::bandwidth);
}

inline void bind_control(nb::module_& m) {
    using namespace control;
    nb::class_<TickDelay>(m, "TickDelay").def(nb::init<>()).def_rw("ticks", &TickDelay::ticks);
    nb::class_<Schedule>(m, "Schedule")
        .def(nb::init<>())
        .def_rw("every", &Schedule::every)
        .def_rw("phase", &Schedule::phase);
    nb::class_<Encoder>(m, "Encoder")
        .def(nb::init<>())
        .def_rw("resolution", &Encoder::resolution)
        .def_rw("error", &Encoder::error)
        .def_rw("periods", &Encoder::periods)
        .def_rw("phase", &Encoder::phase)
        .def_rw("delay", &Encoder::delay);
    nb::class_<Sensor>(m, "Sensor")
        .def(nb::init<>())
        .def_rw("encoder", &Sensor::encoder)
        .def_rw("scale", &Sensor::scale);
    nb::class_<SpeedEstimate> estimate(m, "SpeedEstimate");
    nb::enum_<SpeedEstimate::Kind>(estimate, "Kind")
        .value("exact", SpeedEstimate::exact)
        .value("difference", SpeedEstimate::difference)
        .value("observer", SpeedEstimate::observer);
    estimate.def(nb::init<>())
        .def_rw("kind", &SpeedEstimate::kind)
        .def_rw("span", &SpeedEstimate::span)
        .def_rw("smoothing", &SpeedEstimate::smoothing)
        .def_rw("bandwidth", &SpeedEstimate::bandwidth)
        .def_rw("damping", &SpeedEstimate::damping)
        .def_rw("inertia", &SpeedEstimate::inertia);
    nb::class_<PositionLoop>(m, "PositionLoop")
        .def(nb::init<>())
        .def_rw("gain", &PositionLoop::gain)
        .def_rw("integral_gain", &PositionLoop::integral_gain)
        .def_rw("speed_feedforward", &PositionLoop::speed_feedforward)
        .def_rw("speed_limit", &PositionLoop::speed_limit)
        .def_rw("inner", &PositionLoop::inner)
        .def_rw("outer", &PositionLoop::outer);
    nb::class_<SpeedLoop>(m, "SpeedLoop")
        .def(nb::init<>())
        .def_rw("gain", &SpeedLoop::gain)
        .def_rw("reference_gain", &SpeedLoop::reference_gain)
        .def_rw("integral_gain", &SpeedLoop::integral_gain)
        .def_rw("torque_limit", &SpeedLoop::torque_limit);
    nb::class_<CurrentLoop>(m, "CurrentLoop")
        .def(nb::init<>())
        .def_rw("gain", &CurrentLoop::gain)
        .def_rw("integral_gain", &CurrentLoop::integral_gain)
        .def_rw("back_emf", &CurrentLoop::back_emf)
        .def_rw("rated_torque", &CurrentLoop::rated_torque)
        .def_rw("limit", &CurrentLoop::limit);
    nb::class_<FieldOrientation>(m, "FieldOrientation")
        .def(nb::init<>())
        .def_prop_rw(
            "winding",
            [](const FieldOrientation& f) {
                const SynchronousWinding& w = f.winding;
                return std::array{w.pole_pairs, w.resistance, w.inductance_d, w.inductance_q, w.flux_linkage};
            },
            [](FieldOrientation& f, const std::array<double, 5>& w) { f.winding = {w[0], w[1], w[2], w[3], w[4]}; })
        .def_rw("gain_d", &FieldOrientation::gain_d)
        .def_rw("gain_q", &FieldOrientation::gain_q)
        .def_rw("integral_gain", &FieldOrientation::integral_gain)
        .def_rw("back_emf", &FieldOrientation::back_emf)
        .def_rw("decoupling", &FieldOrientation::decoupling)
        .def_rw("field_weakening", &FieldOrientation::field_weakening)
        .def_rw("weakening_voltage", &FieldOrientation::weakening_voltage)
        .def_rw("voltage_limit", &FieldOrientation::voltage_limit)
        .def_rw("current_limit", &FieldOrientation::current_limit)
        .def_rw("sample_time", &FieldOrientation::sample_time)
        .def_rw("delay_time", &FieldOrientation::delay_time)
        .def_rw("delay", &FieldOrientation::delay)
        .def_rw("parts", &FieldOrientation::parts)
        .def(
            "least_current",
            [](const FieldOrientation& f, double torque) {
                const DirectQuadrature i = f.least_current(torque);
                return std::pair(i.d, i.q);
            },
            "torque"_a, "(i_d, i_q) [A] of the least current for a torque [N m].");
    nb::class_<TorqueFeedforward>(m, "TorqueFeedforward")
        .def(nb::init<>())
        .def_rw("inertia", &TorqueFeedforward::inertia)
        .def_rw("viscous_friction", &TorqueFeedforward::viscous_friction)
        .def_rw("friction_torque", &TorqueFeedforward::friction_torque)
        .def_rw("load_torque", &TorqueFeedforward::load_torque);
    nb::class_<BacklashCompensation>(m, "BacklashCompensation")
        .def(nb::init<>())
        .def_rw("backlash", &BacklashCompensation::backlash)
        .def_rw("rate", &BacklashCompensation::rate);
    bind_inverse_model(m);
    nb::class_<Camera>(m, "Camera")
        .def(nb::init<>())
        .def_rw("present", &Camera::present)
        .def_rw("every", &Camera::every)
        .def_rw("latency", &Camera::latency)
        .def_rw("step", &Camera::step)
        .def_rw("noise", &Camera::noise)
        .def_rw("half_field", &Camera::half_field)
        .def_rw("seed", &Camera::seed)
        .def_rw("stream", &Camera::stream);
    nb::class_<Tracker>(m, "Tracker")
        .def(nb::init<>())
        .def_rw("alpha", &Tracker::alpha)
        .def_rw("beta", &Tracker::beta)
        .def_rw("gamma", &Tracker::gamma)
        .def_rw("frame_time", &Tracker::frame_time)
        .def_rw("predicts", &Tracker::predicts);
    nb::class_<DiscreteSystem>(m, "DiscreteSystem")
        .def(
            "__init__",
            [](DiscreteSystem* self, const std::vector<double>& A, const std::vector<double>& B,
               const std::vector<double>& C, double D) {
                new (self) DiscreteSystem();
                self->A = A;
                self->B = B;
                self->C = C;
                self->D = D;
            },
            "A"_a, "B"_a, "C"_a, "D"_a)
        .def_ro_static("max_order", &DiscreteSystem::max_order);

    nb::class_<BoundAxis> axis(m, "Axis");
    nb::enum_<Axis::Mode>(axis, "Mode")
        .value("torque", Axis::torque_mode)
        .value("speed", Axis::speed_mode)
        .value("position", Axis::position_mode);
    axis.def(nb::init<>())
        .def_rw("mode", &BoundAxis::mode)
        .def(
            "slots",
            [](const BoundAxis& a) {
                control::Axis placed = a;
                placed.place();
                return std::pair(placed.slots(), placed.running_slots());
            },
            "How many numbers it remembers, and which of them go on with time.")
        .def_rw("camera", &BoundAxis::camera)
        .def_rw("tracker", &BoundAxis::tracker)
        .def_rw("reference_delay", &BoundAxis::reference_delay)
        .def_rw("ratio", &BoundAxis::ratio)
        .def_rw("rated_torque", &BoundAxis::rated_torque)
        .def_rw("torque_limit", &BoundAxis::torque_limit)
        .def_rw("stall_torque", &BoundAxis::stall_torque)
        .def_rw("torque_droop", &BoundAxis::torque_droop)
        .def_rw("delay", &BoundAxis::delay)
        .def_rw("speed_sensor", &BoundAxis::speed_sensor)
        .def_rw("position_sensor", &BoundAxis::position_sensor)
        .def_rw("two_encoders", &BoundAxis::two_encoders)
        .def_rw("position_share", &BoundAxis::position_share)
        .def_rw("estimate", &BoundAxis::estimate)
        .def_rw("position_schedule", &BoundAxis::position_schedule)
        .def_rw("speed_schedule", &BoundAxis::speed_schedule)
        .def_rw("current_schedule", &BoundAxis::current_schedule)
        .def_rw("position_loop", &BoundAxis::position_loop)
        .def_rw("speed_loop", &BoundAxis::speed_loop)
        .def_rw("current_loop", &BoundAxis::current_loop)
        .def_rw("field_orientation", &BoundAxis::field_orientation)
        .def_rw("commutates_by_encoder", &BoundAxis::commutates_by_encoder)
        .def_rw("feedforward", &BoundAxis::feedforward)
        .def_rw("inverse_model", &BoundAxis::inverse_model)
        .def_rw("load_observer", &BoundAxis::load_observer)
        .def_rw("backlash", &BoundAxis::backlash)
        .def_rw("speed_filters", &BoundAxis::speed_filters)
        .def_rw("torque_filters", &BoundAxis::torque_filters)
        .def("set_reference", &BoundAxis::set_reference, "pieces"_a, "sines"_a)
        .def("raise_again", &BoundAxis::raise_again)
        .def("set_python_law", &BoundAxis::set_python_law, "function"_a, "states"_a,
             nb::sig("def set_python_law(self, function: collections.abc.Callable[..., float], states: int) -> None"))
        .def("set_compiled_law", &BoundAxis::set_compiled_law, "function"_a, "data"_a, "states"_a);
    bind_linear_steps(m);
    m.attr("COMMAND_SLOT") = Axis::command_slot();
    m.attr("SPEED_ANGLE_SLOT") = Axis::speed_angle_slot();
    m.def(
        "axis_signals", [] { return signal_names(axis_signal_names); },
        nb::sig("def axis_signals() -> list[tuple[str, str, str]]"), "Name, unit, meaning of what each axis shows.");
    m.def(
        "winding_signals", [] { return signal_names(winding_signal_names); },
        nb::sig("def winding_signals() -> list[tuple[str, str, str]]"),
        "The same of what one with a winding shows beside it.");
}

}  // namespace lostmotion::binding
