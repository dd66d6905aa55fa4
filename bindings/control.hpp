// Controllers of axes.
#pragma once

#include <nanobind/stl/optional.h>

#include <memory>
#include <string>
#include <tuple>
#include <vector>

#include "fields.hpp"
#include "lostmotion/control/linear_step.hpp"
#include "lostmotion/scenario/control_fields.hpp"
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

struct [[gnu::visibility("hidden")]] BoundAxis : ControlledAxis {
    std::shared_ptr<PythonLaw> python_law;

    void set_python_law(nb::callable function, int states) {
        python_law = std::make_shared<PythonLaw>(std::move(function), states, law.field_orientation.has_value());
        set_own_law(PythonLaw::call, python_law.get(), states);
    }
    // The address of a function of the type control::OwnLawFunction, and of what it is given.
    void set_compiled_law(std::size_t function, std::size_t data, int states) {
        set_own_law(reinterpret_cast<control::OwnLawFunction>(function), reinterpret_cast<void*>(data), states);
    }
    void set(const Record& fields) {
        NamedFields f(fields);
        describe(f, static_cast<ControlledAxis&>(*this));
        f.refuse_unknown();
    }
    void raise_again() const {
        if (python_law) python_law->raise_again();
    }

 private:
    void set_own_law(control::OwnLawFunction function, void* data, int states) {
        law.own_law = {};
        law.own_law.function = function;
        law.own_law.data = data;
        law.own_law.states = states;
    }
};

// Base tick [s], and the axes.
using BoundControl = std::pair<double, std::vector<BoundAxis>>;

inline Control control_of(const BoundControl& bound) {
    return {bound.first, {bound.second.begin(), bound.second.end()}};
}
inline void raise_again(const BoundControl& bound) {
    for (const BoundAxis& each : bound.second) each.raise_again();
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
    return as_array(step.rows, {step.rows.size() / step.columns, step.columns});
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
        [](const BoundAxis& axis, Loop outermost, bool cut, std::int64_t sample, double sample_time) {
            return as_array(linear_step(axis.law, outermost, cut, sample, sample_time));
        },
        "axis"_a, nb::kw_only(), "outermost"_a, "cut"_a, "sample"_a, "sample_time"_a,
        "Slots after a sample step, over the slots before it and (angle of the position's encoder, angle and speed of "
        "the speed's, torque of the motor, value, rate and acceleration of the reference, measured value of a loop "
        "that is cut).");
    m.def(
        "linear_orientation",
        [](const BoundAxis& axis, double speed, double lag, double torque, double weakening,
           std::pair<double, double> current, std::pair<double, double> voltage, CurrentAxis outermost, bool cut,
           int every, int since, double sample_time) {
            const SteadyOrientation motion{
                speed, lag, torque, weakening, {current.first, current.second}, {voltage.first, voltage.second}};
            return as_array(linear_orientation(axis.law.field_orientation.value(), motion, outermost, cut, every, since,
                                               sample_time));
        },
        "axis"_a, nb::kw_only(), "speed"_a, "lag"_a, "torque"_a, "weakening"_a, "current"_a, "voltage"_a, "outermost"_a,
        "cut"_a, "every"_a, "since"_a, "sample_time"_a,
        "Slots of the field orientation after a sample step, the voltage (u_d, u_q) that acts and the measured "
        "currents, over "
        "the slots before it and (torque that is asked for; speed, angle as it is read and angle of the rotor; i_d, "
        "i_q; reference and measured value of the current that is looked at).");
}

template <class Names>
auto signal_names(const Names& names) {
    using Named = control::AxisSignalName;
    return rows_of(names, &Named::name, &Named::unit, &Named::meaning);
}

inline void bind_control(nb::module_& m) {
    using namespace control;
    m.def("encoder_step", [](const Record& fields) { return described<Encoder>(fields).step(); }, "fields"_a);
    m.def(
        "tracker_gains",
        [](const Record& fields) {
            Tracker t = described<Tracker>(fields);
            Slots slots;
            t.place(slots);
            return std::tuple(t.alpha, t.beta, t.gamma);
        },
        "fields"_a);
    m.def(
        "discrete_filter",
        [](const Record& fields, double sample_time) {
            const FilterLaw law{described<Filter>(fields), sample_time};
            const Filter f = law.in_z();
            const DiscreteSystem s = made_by(law);
            Record out;
            out["A"] = s.A, out["B"] = s.B, out["C"] = s.C, out["D"] = s.D, out["filter"] = s.origin.numbers;
            return std::tuple(f.numerator, f.denominator, out);
        },
        "fields"_a, "sample_time"_a,
        "Numerator and denominator in z, the highest power first, and the system of a controller.");
    nb::class_<GearLosses>(m, "GearLosses")
        .def(
            "__init__",
            [](GearLosses* self, const Record& fields) { new (self) GearLosses(described<GearLosses>(fields)); },
            "fields"_a)
        .def("__call__", &GearLosses::operator(), "output_torque"_a, "direction"_a, "speed"_a)
        .def("output_torque", &GearLosses::output_torque, "input_torque"_a, "direction"_a, "speed"_a, "factor"_a);
    nb::class_<BoundAxis> axis(m, "Axis");
    axis.def(nb::init<>())
        .def(nb::init<const BoundAxis&>(), "other"_a, "A copy, which may be changed.")
        .def("set", &BoundAxis::set, "fields"_a,
             "Parameters by the keys of scenario files, tables as dicts; what is left out stays as it is.")
        .def(
            "slots",
            [](const BoundAxis& a) {
                control::Axis placed = a.law;
                placed.place(1.0);
                return std::pair(placed.slots(), placed.running_slots());
            },
            "How many numbers it remembers, and which of them go on with time.")
        .def_prop_ro("position_phase", [](const BoundAxis& a) { return a.law.position_schedule.phase; })
        .def_prop_ro("commutates_by_encoder", [](const BoundAxis& a) { return a.law.commutates_by_encoder; })
        .def_prop_ro("is_oriented", [](const BoundAxis& a) { return a.law.field_orientation.has_value(); })
        .def_ro("motor", &BoundAxis::motor)
        .def_ro("position_shaft", &BoundAxis::position_shaft)
        .def_ro("speed_shaft", &BoundAxis::speed_shaft)
        .def_ro("reference_shaft", &BoundAxis::reference_shaft)
        .def(
            "least_current",
            [](const BoundAxis& a, double torque) {
                const DirectQuadrature i = a.law.field_orientation.value().least_current(torque);
                return std::pair(i.d, i.q);
            },
            "torque"_a, "(i_d, i_q) [A] of the least current for a torque [N m], under field-oriented control.")
        .def("raise_again", &BoundAxis::raise_again)
        .def("set_python_law", &BoundAxis::set_python_law, "function"_a, "states"_a,
             nb::sig("def set_python_law(self, function: collections.abc.Callable[..., float], states: int) -> None"))
        .def("set_compiled_law", &BoundAxis::set_compiled_law, "function"_a, "data"_a, "states"_a);
    bind_linear_steps(m);
    m.attr("COMMAND_SLOT") = Axis::command_slot();
    m.attr("SPEED_ANGLE_SLOT") = Axis::speed_angle_slot();
    m.def(
        "axis_signals",
        [](bool motor_slides, bool position_slides) {
            auto names = axis_signal_names;
            for (int k = 0; k < n_axis_signals; ++k)
                names[static_cast<std::size_t>(k)] = axis_signal_name(k, motor_slides, position_slides);
            return signal_names(names);
        },
        "motor_slides"_a = false, "position_slides"_a = false,
        "Name, unit, meaning of what each axis shows, where the motor moves a slide, or the position is that of one.");
    m.def(
        "winding_signals", [] { return signal_names(winding_signal_names); },
        "The same of what one with a winding shows beside it.");
}

}  // namespace lostmotion::binding
