// Trains as the actuators of the joints of a multibody engine.
#pragma once

#include "lostmotion/simulation/joint_trains.hpp"
#include "stepping.hpp"

namespace lostmotion::binding {

// The rows of what JointTrains says of its joints.
inline constexpr std::array<const char*, 5> joint_rows{"angle", "speed", "acceleration", "torque", "compliance"};

using JointValues = nb::ndarray<double, nb::numpy, nb::ndim<2>, nb::c_contig, nb::device::cpu>;
using JointVector = nb::ndarray<const double, nb::numpy, nb::ndim<1>, nb::c_contig, nb::device::cpu>;
using JointMatrix = nb::ndarray<const double, nb::numpy, nb::ndim<2>, nb::c_contig, nb::device::cpu>;

inline void write_joints(const JointTrains& t, JointValues& out) {
    const std::size_t n = t.joints().size();
    if (out.shape(0) != joint_rows.size() || out.shape(1) != n) throw nb::type_error("values of other joints");
    double* to = out.data();
    for (std::size_t k = 0; k < n; ++k) {
        const JointTrains::Joint& j = t.joints()[k];
        std::size_t row = 0;
        for (const double v : {j.angle, j.speed, j.acceleration, j.torque, j.compliance}) to[row++ * n + k] = v;
    }
}

inline void check(Status status, JointTrains& t) {
    if (status != Status::done) check(status, *t.joints()[t.failed_joint()].train);
}

// A copy of all trains, with where the next step begins its search.
struct JointSnapshot {
    std::vector<TrainSimulation::Snapshot> trains;
    std::vector<JointTrains::Guess> guesses;
};

inline void bind_joint_trains(nb::module_& m) {
    using T = JointTrains;
    nb::class_<JointSnapshot>(m, "JointSnapshot");
    m.def("joint_rows", [] { return std::vector<std::string>(joint_rows.begin(), joint_rows.end()); });
    nb::class_<T>(m, "JointTrains")
        .def(
            "__init__",
            [](T* self, const std::vector<TrainSimulation*>& trains, const std::vector<int>& shafts) {
                std::vector<T::Joint> joints;
                for (std::size_t k = 0; k < trains.size(); ++k) {
                    const std::optional<LoadShaft> shaft = trains[k]->load_shaft(shafts[k]);
                    if (!shaft) throw nb::value_error("a load shaft without load torque, or whose angle is no state");
                    joints.push_back({trains[k], *shaft});
                }
                new (self) T(std::move(joints));
            },
            "trains"_a, "shafts"_a, nb::keep_alive<1, 2>())
        .def(
            "set_input",
            [](T& t, std::size_t joint, std::size_t input, double value) { t.inputs(joint)[input] = value; }, "joint"_a,
            "input"_a, "value"_a)
        .def("guesses",
             [](const T& t) {
                 std::vector<std::pair<double, double>> out;
                 for (std::size_t k = 0; k < t.joints().size(); ++k)
                     out.emplace_back(t.guess(k).torque, t.guess(k).acceleration);
                 return out;
             })
        .def(
            "set_guesses",
            [](T& t, const std::vector<std::pair<double, double>>& guesses) {
                check_size(guesses, t.joints().size());
                for (std::size_t k = 0; k < guesses.size(); ++k) t.set_guess(k, {guesses[k].first, guesses[k].second});
            },
            "guesses"_a, "Load torque [N m] and mean acceleration [rad/s^2] of each joint.")
        .def("snapshot",
             [](const T& t) {
                 const std::size_t n = t.joints().size();
                 JointSnapshot to{std::vector<TrainSimulation::Snapshot>(n), {}};
                 for (std::size_t k = 0; k < n; ++k) {
                     t.joints()[k].train->save(to.trains[k]);
                     to.guesses.push_back(t.guess(k));
                 }
                 return to;
             })
        .def(
            "restore",
            [](T& t, const JointSnapshot& from) {
                check_size(from.trains, t.joints().size());
                for (std::size_t k = 0; k < from.trains.size(); ++k) {
                    if (!t.joints()[k].train->restore(from.trains[k]))
                        throw nb::type_error("a snapshot of other joints");
                    t.set_guess(k, from.guesses[k]);
                }
            },
            "snapshot"_a)
        .def(
            "set_reference",
            [](T& t, std::size_t joint, double value, double rate) {
                t.joints()[joint].train->with([&](auto& s) { s.set_reference(0, value, rate); });
            },
            "joint"_a, "value"_a, "rate"_a)
        .def(
            "step",
            [](T& t, double interval, int substeps, JointMatrix mass, JointVector force, JointMatrix mass_rate,
               JointVector force_rate, JointValues out) {
                const std::size_t n = t.joints().size();
                for (const JointMatrix& m : {mass, mass_rate})
                    if (m.shape(0) != n || m.shape(1) != n) throw nb::type_error("a mass matrix of other joints");
                for (const JointVector& f : {force, force_rate})
                    if (f.shape(0) != n) throw nb::type_error("forces of other joints");
                check(t.step(
                          interval, substeps,
                          {{mass.data(), n * n}, {force.data(), n}, {mass_rate.data(), n * n}, {force_rate.data(), n}}),
                      t);
                write_joints(t, out);
            },
            "interval"_a, "substeps"_a, "mass"_a, "force"_a, "mass_rate"_a, "force_rate"_a, "out"_a)
        .def("go_back", &T::go_back)
        .def(
            "read",
            [](T& t, JointValues out) {
                t.read();
                write_joints(t, out);
            },
            "out"_a)
        .def_prop_ro("evaluations", &T::evaluations)
        .def_prop_ro("unsettled", &T::unsettled);
}

}  // namespace lostmotion::binding
