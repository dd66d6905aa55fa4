// Curves, maps and signals.
#pragma once

#include "arrays.hpp"
#include "lostmotion/kernel/inputs.hpp"
#include "lostmotion/parts/gear.hpp"

namespace lostmotion::binding {

inline void bind_curves(nb::module_& m) {
    using Vector = std::vector<double>;
    nb::class_<TorsionCurve>(m, "TorsionCurve")
        .def(nb::init<Vector, Vector>(), "breaks"_a, "slopes"_a)
        .def("torque", &TorsionCurve::torque, "twist"_a)
        .def("energy", nb::overload_cast<double>(&TorsionCurve::energy, nb::const_), "twist"_a);
    nb::class_<LossMap>(m, "LossMap")
        .def(nb::init<Vector, Vector, Vector>(), "speeds"_a, "loads"_a, "values"_a)
        .def("__call__", &LossMap::operator(), "load"_a, "speed"_a)
        .def("least_slope_over_load", &LossMap::least_slope_over_load);
    nb::class_<Signal>(m, "Signal")
        .def(
            "__init__",
            [](Signal* self, const std::vector<std::array<double, 3>>& breakpoints,
               const std::vector<std::array<double, 3>>& sines) { new (self) Signal(signal_of(breakpoints, sines)); },
            "breakpoints"_a, "sines"_a);
}

}  // namespace lostmotion::binding
