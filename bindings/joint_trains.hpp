// Trains as the actuators of the joints of a multibody engine.
#pragma once

#include "lostmotion/simulation/robot_step.hpp"
#include "stepping.hpp"

namespace lostmotion::binding {

// The rows of what JointTrains says of its joints.
inline constexpr std::array<const char*, 5> joint_rows{"angle", "speed", "acceleration", "torque", "compliance"};

using JointValues = nb::ndarray<double, nb::numpy, nb::ndim<2>, nb::c_contig, nb::device::cpu>;
using JointVector = nb::ndarray<const double, nb::numpy, nb::ndim<1>, nb::c_contig, nb::device::cpu>;
using EngineVector = nb::ndarray<double, nb::numpy, nb::ndim<1>, nb::c_contig, nb::device::cpu>;
using EngineIndices = nb::ndarray<const std::int32_t, nb::numpy, nb::ndim<1>, nb::c_contig, nb::device::cpu>;

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
    std::vector<MotionState> trains;
    std::vector<JointTrains::Guess> guesses;
};

inline void bind_joint_trains(nb::module_& m) {
    using T = JointTrains;
    nb::class_<JointSnapshot>(m, "JointSnapshot");
    m.def("joint_rows", [] { return std::vector<std::string>(joint_rows.begin(), joint_rows.end()); });
    m.def(
        "turns_joint", [](TrainSimulation& t, int shaft) { return T::joint(t, shaft).has_value(); }, "train"_a,
        "shaft"_a, "Whether the angle of a shaft follows from the states, and no mass matrix joins it to others.");
    nb::class_<T>(m, "JointTrains")
        .def(
            "__init__",
            [](T* self, const std::vector<TrainSimulation*>& trains, const std::vector<int>& shafts,
               const std::vector<int>& commands, const std::vector<double>& scales) {
                std::vector<T::Joint> joints;
                for (std::size_t k = 0; k < trains.size(); ++k) {
                    std::optional<T::Joint> joint = T::joint(*trains[k], shafts[k]);
                    if (!joint) throw nb::value_error(("shaft of joint " + std::to_string(k)).c_str());
                    joint->command = commands[k];
                    joint->command_scale = scales[k];
                    joints.push_back(std::move(*joint));
                }
                new (self) T(std::move(joints));
            },
            "trains"_a, nb::kw_only(), "shafts"_a, "commands"_a, "scales"_a, nb::keep_alive<1, 2>(),
            "commands: the place of each among the inputs; -1: a controller has a reference in its place.")
        .def(
            "set_commands",
            [](T& t, const std::vector<double>& values) {
                check_size(values, t.joints().size());
                t.set_commands(values);
            },
            "values"_a)
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
                 JointSnapshot to{std::vector<MotionState>(n), {}};
                 for (std::size_t k = 0; k < n; ++k) {
                     t.joints()[k].train->motion().save(to.trains[k]);
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

    using R = RobotStep;
    const auto vector = [](const auto& v) { return std::span(v.data(), v.size()); };
    const auto row = [](std::span<double> v) {
        return nb::ndarray<nb::numpy, double, nb::ndim<1>>(v.data(), {v.size()});
    };
    const auto square = [](std::span<double> v, std::size_t n) {
        return nb::ndarray<nb::numpy, double, nb::ndim<2>>(v.data(), {n, n});
    };
    constexpr auto with_owner = nb::rv_policy::reference_internal;
    nb::class_<R>(m, "RobotStep")
        .def(
            "__init__",
            [=](R* self, T& trains, EngineVector position, EngineVector speed, EngineVector acceleration,
                EngineVector warmstart, EngineVector force, EngineVector matrix, EngineIndices row_length,
                EngineIndices row_begin, EngineIndices column, std::vector<double> damping,
                std::vector<std::size_t> trained, std::vector<std::size_t> others, std::vector<std::size_t> place,
                std::vector<std::size_t> place_of_speed) {
                new (self) R(trains,
                             {vector(position), vector(speed), vector(acceleration), vector(warmstart), vector(force),
                              vector(matrix), vector(row_length), vector(row_begin), vector(column), std::move(damping),
                              std::move(trained), std::move(others), std::move(place), std::move(place_of_speed)});
            },
            "trains"_a, nb::kw_only(), "position"_a.noconvert(), "speed"_a.noconvert(), "acceleration"_a.noconvert(),
            "warmstart"_a.noconvert(), "force"_a.noconvert(), "matrix"_a.noconvert(), "row_length"_a.noconvert(),
            "row_begin"_a.noconvert(), "column"_a.noconvert(), "damping"_a, "trained"_a, "others"_a, "place"_a,
            "place_of_speed"_a, nb::keep_alive<1, 2>(), nb::keep_alive<1, 3>(), nb::keep_alive<1, 4>(),
            nb::keep_alive<1, 5>(), nb::keep_alive<1, 6>(), nb::keep_alive<1, 7>(), nb::keep_alive<1, 8>(),
            nb::keep_alive<1, 9>(), nb::keep_alive<1, 10>(), nb::keep_alive<1, 11>(),
            "Of the arrays of an engine; see core/lostmotion/simulation/robot_step.hpp.")
        .def(
            "begin",
            [](R& r, double interval) {
                const int away = r.away();
                if (away < 0) r.begin(interval);
                return away;
            },
            "interval"_a, "The first joint that is not where its train is, or -1: then positions are at the middle.")
        .def(
            "predict_speed", [](R& r, double interval) { r.speed_at_middle(interval); }, "interval"_a)
        .def(
            "take", [=](R& r, double interval, JointVector acceleration) { r.take(interval, vector(acceleration)); },
            "interval"_a, "acceleration"_a)
        .def(
            "advance",
            [](R& r, T& t, double interval, int substeps, JointValues out) {
                check(r.advance(interval, substeps), t);
                write_joints(t, out);
            },
            "trains"_a, nb::kw_only(), "interval"_a, "substeps"_a, "out"_a)
        .def(
            "advance_under",
            [=](R& r, T& t, double interval, int substeps, JointVector force, JointValues out) {
                check(r.advance(interval, substeps, vector(force), false), t);
                write_joints(t, out);
            },
            "trains"_a, nb::kw_only(), "interval"_a, "substeps"_a, "force"_a, "out"_a)
        .def("restore", &R::restore)
        .def(
            "integrate",
            [=](R& r, double interval, JointVector acceleration) { r.integrate(interval, vector(acceleration)); },
            "interval"_a, "acceleration"_a)
        .def(
            "finish", [=](R& r, JointVector acceleration) { r.finish(vector(acceleration)); }, "acceleration"_a)
        .def_prop_rw(
            "course",
            [](const R& r) {
                const R::Course& c = r.course();
                Record out;
                out["acceleration"] = c.acceleration, out["before"] = c.before, out["inertia"] = c.inertia;
                out["force"] = c.force, out["smooth"] = c.smooth;
                return out;
            },
            [](R& r, const Record& given) {
                R::Course to;
                NamedFields f(given);
                f.list("acceleration", to.acceleration);
                f.list("before", to.before);
                f.list("inertia", to.inertia);
                f.list("force", to.force);
                f.flag("smooth", to.smooth);
                f.refuse_unknown();
                if (to.acceleration.size() != r.acceleration().size() || to.before.size() != r.acceleration().size() ||
                    to.inertia.size() != r.course().inertia.size() || to.force.size() != r.course().force.size())
                    throw nb::type_error("the course of another robot");
                r.set_course(std::move(to));
            },
            "What the next step predicts from.")
        .def_prop_ro(
            "motion", [=](R& r) { return row(r.motion()); }, with_owner)
        .def_prop_ro(
            "acceleration", [=](R& r) { return row(r.acceleration()); }, with_owner)
        .def_prop_ro(
            "force", [=](R& r) { return row(r.force()); }, with_owner)
        .def_prop_ro("mass", [=](R& r) { return square(r.mass(), r.force().size()); }, with_owner);
}

}  // namespace lostmotion::binding
