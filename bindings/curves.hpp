// Curves, maps and signals.
#pragma once

#include "arrays.hpp"
#include "fields.hpp"
#include "lostmotion/base/signal.hpp"
#include "lostmotion/parts/gear.hpp"
#include "lostmotion/parts/stiffness_curve.hpp"
#include "lostmotion/scenario/part_fields.hpp"

namespace lostmotion::binding {

inline void bind_curves(nb::module_& m) {
    using Vector = std::vector<double>;
    nb::class_<TorsionCurve>(m, "TorsionCurve")
        .def(nb::init<Vector, Vector>(), "breaks"_a, "slopes"_a)
        .def(
            "__init__",
            [](TorsionCurve* self, const Record& stiffness) {
                new (self) TorsionCurve(made_by(described<StiffnessCurve>(stiffness)));
            },
            "stiffness"_a)
        .def_prop_ro("odd", &TorsionCurve::odd)
        .def_prop_ro("pieces", &TorsionCurve::pieces)
        .def(
            "side",
            [](const TorsionCurve& c, bool forward) {
                TorsionCurve::Side side = forward ? c.forward() : c.backward();
                return std::pair(std::move(side.breaks), std::move(side.slopes));
            },
            "forward"_a, "Twists [rad] > 0 at which the slope changes, and the slopes [N m/rad], outwards.")
        .def("torque", &TorsionCurve::torque, "twist"_a)
        .def("twist", &TorsionCurve::twist, "torque"_a)
        .def("energy", nb::overload_cast<double>(&TorsionCurve::energy, nb::const_), "twist"_a);
    nb::class_<LossMap>(m, "LossMap")
        .def(nb::init<Vector, Vector, Vector>(), "speeds"_a, "loads"_a, "values"_a)
        .def("__call__", &LossMap::operator(), "load"_a, "speed"_a)
        .def("least_slope_over_load", &LossMap::least_slope_over_load);
    nb::class_<Signal>(m, "Signal")
        .def(
            "__init__", [](Signal* self, const Record& fields) { new (self) Signal(described<Signal>(fields)); },
            "fields"_a);
}

}  // namespace lostmotion::binding
