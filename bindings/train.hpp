// A drive train as Python describes it: elements by name, added in the order of the equations.
#pragma once

#include <nanobind/stl/optional.h>

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "drives.hpp"
#include "interruption.hpp"
#include "lostmotion/analysis/steady_regime.hpp"
#include "lostmotion/simulation/train_run.hpp"

namespace lostmotion::binding {

class TrainDescription {
 public:
    using Parameters = std::map<std::string, double>;
    using Friction = std::tuple<double, double, std::vector<double>, std::vector<double>>;

    model::Train train;

    void add_shaft(const std::string& name, double inertia, double viscous_friction, const Friction& friction,
                   const TorsionCurve* drag, bool loaded) {
        model::Shaft s;
        s.name = name;
        s.inertia = inertia;
        s.viscous_friction = viscous_friction;
        const auto& [torque, breakaway, speeds, torques] = friction;
        s.friction = {torque, breakaway, speeds, torques};
        if (drag != nullptr) s.drag = *drag;
        s.loaded = loaded;
        train.shafts.push_back(std::move(s));
    }
    void add_motor(const std::string& name, const std::string& shaft, const Parameters& parameters, bool torque_source,
                   double torque_limit) {
        const Motor law = make_drive(parameters, torque_source, nullptr, nullptr).motor;
        train.motors.push_back({name, place_of(shaft), law, torque_limit});
    }
    void add_gear(const std::string& name, const std::string& input, const std::string& output,
                  const Parameters& parameters, const TorsionCurve* curve, const LossMap* map,
                  const std::optional<std::pair<double, double>>& efficiencies, double mesh_damping,
                  const model::PeriodicCurve* transmission_error) {
        model::Gear g;
        g.name = name;
        g.input = place_of(input);
        g.output = place_of(output);
        g.law = make_drive(parameters, false, curve, map).gearbox;
        if (efficiencies) g.efficiencies.emplace(efficiencies->first, efficiencies->second);
        g.mesh_damping = mesh_damping;
        if (transmission_error != nullptr) g.transmission_error = *transmission_error;
        train.gears.push_back(std::move(g));
    }
    void add_brake(const std::string& name, const std::string& shaft, double torque) {
        train.brakes.push_back({name, place_of(shaft), torque});
    }
    void add_coupling(const std::string& name, const std::string& input, const std::string& output, double torque,
                      model::Coupling::Kind kind) {
        train.couplings.push_back({name, kind, place_of(input), place_of(output), torque});
    }
    void add_angle_torque(const std::string& name, const std::string& shaft, const model::PeriodicCurve& torque) {
        train.angle_torques.push_back({name, place_of(shaft), torque});
    }

    std::string check() const { return TrainRun(train).error(); }
    std::string check_start(const std::vector<double>& speeds) const { return model::check_start(train, speeds); }
    // The train must have passed the check.
    std::vector<std::tuple<std::string, std::string, std::string>> channels() const {
        std::vector<std::tuple<std::string, std::string, std::string>> out;
        for (const TrainChannel& c : train_channels(model::Assembly(train)))
            out.emplace_back(c.name, c.unit, c.meaning);
        return out;
    }
    std::vector<std::string> input_names() const { return model::input_names(model::Assembly(train)); }
    std::vector<std::string> contact_names() const {
        const model::Assembly a(train);
        std::vector<std::string> names;
        for (int c = 0; c < a.layout().contacts; ++c) names.push_back(model::contact_name(a, c));
        return names;
    }
    // (J [kg m2], holding friction [N m]) of each shaft, with what is on it; brakes are open.
    std::vector<std::pair<double, double>> shafts() const {
        const model::Assembly a(train);
        std::vector<std::pair<double, double>> out;
        for (std::size_t s = 0; s < train.shafts.size(); ++s) {
            const model::ShaftPlace& p = a.places().shafts[s];
            out.emplace_back(p.inertia, p.motor_friction + train.shafts[s].friction.holding());
        }
        return out;
    }
    std::pair<double, double> mesh_loss(std::size_t gear, double driven, double speed) const {
        const model::MeshLoss loss = train.gears.at(gear).loss(driven, speed);
        return {loss.torque, loss.per_torque};
    }
    nb::tuple steady_regime(const std::vector<double>& speeds, const std::vector<double>& torques) const {
        const SteadyRegime r = lostmotion::steady_regime(train, {speeds, torques});
        const std::size_t n = r.states.size();
        auto rate = std::make_unique_for_overwrite<double[]>(n * n);
        std::copy(r.rate.begin(), r.rate.end(), rate.get());
        return nb::make_tuple(r.states, as_array(std::move(rate), {n, n}), r.determined);
    }

 private:
    // -1 if there is none of that name, which check() finds.
    int place_of(const std::string& shaft) const {
        for (std::size_t k = 0; k < train.shafts.size(); ++k)
            if (train.shafts[k].name == shaft) return static_cast<int>(k);
        return -1;
    }
};

// What ended a regime; -1: an input jumped.
inline std::vector<std::pair<int, std::string>> train_causes() {
    return {{input_changed, input_changed_name},
            {model::Guard::speed, "came to rest"},
            {model::Guard::capacity, "broke away"},
            {model::Guard::edge, "piece or cell of a law"},
            {model::Guard::input_limit, "limit of a command"},
            {model::Guard::turning, "driving torque turned"}};
}

using Named = std::map<std::string, double>;

// Time, cause, the modes of all contacts before and after.
inline Array train_switching_table(const TrainReport& report, int contacts) {
    return column(report.switchings, {2 + 2 * static_cast<std::size_t>(contacts)},
                  [&](const TrainSwitching& s, double* to) {
                      *to++ = s.time;
                      *to++ = s.input_jump ? input_changed : static_cast<int>(s.kind);
                      to = std::copy_n(s.before.modes.begin(), contacts, to);
                      std::copy_n(s.after.modes.begin(), contacts, to);
                  });
}

inline Named train_ledger(const TrainReport& report) {
    Named ledger;
    for (const TrainEnergy& e : report.energy) ledger[e.name] = e.energy;
    ledger["stored_change"] = report.stored_end - report.stored_begin;
    ledger["residual"] = report.residual();
    ledger["turned_over"] = report.turned_over;
    return ledger;
}

inline void check_train_run(const TrainReport& report, const model::Assembly& a) {
    if (!report.message.empty()) throw nb::value_error(report.message.c_str());
    if (report.status == Status::interrupted) throw nb::python_error();
    const std::string error = train_status_text(a, report.status, report.time, report.contact, report.too_many_guards);
    if (!error.empty()) throw SolverError(error);
}

// start: states by name; capacities: of the hysteresis of gears by name. What is left out is 0.
inline nb::dict run_train(const TrainDescription& description, const std::vector<Signal>& inputs, const Named& start,
                          const Named& capacities, double duration, double interval, std::size_t samples, bool energy,
                          double tolerance, std::size_t max_switchings) {
    const TrainRun run(description.train);
    const model::Assembly& a = run.assembly();
    const model::Layout& n = a.layout();
    const std::vector<std::string> states = model::state_names(a);
    std::vector<double> x, memory(static_cast<std::size_t>(n.memory));
    for (const std::string& name : states) x.push_back(start.contains(name) ? start.at(name) : 0.0);
    for (std::size_t g = 0; g < description.train.gears.size(); ++g)
        if (const auto h = capacities.find(description.train.gears[g].name); h != capacities.end())
            memory[static_cast<std::size_t>(a.places().gears[g].hysteresis)] = h->second;
    const TrainOptions options{duration, interval, samples, energy, max_switchings, tolerance, poll_signals, nullptr};
    auto data = std::make_unique_for_overwrite<double[]>(run.channels().size() * samples);
    TrainReport report;
    {
        nb::gil_scoped_release release;
        report = run.run(inputs, x, memory, options, data.get());
    }
    check_train_run(report, a);
    Named end;
    for (std::size_t k = 0; k < states.size(); ++k) end[states[k]] = report.x[k];
    for (std::size_t g = 0; g < description.train.gears.size(); ++g)
        if (const int h = a.places().gears[g].hysteresis; h != model::nowhere)
            end[description.train.gears[g].name + "_hysteresis_capacity"] = report.memory[static_cast<std::size_t>(h)];
    nb::dict out;
    out["values"] = as_array(std::move(data), {run.channels().size(), samples});
    out["switchings"] = train_switching_table(report, n.contacts);
    out["switching_count"] = report.switching_count;
    out["energy"] = train_ledger(report);
    out["end_state"] = end;
    out["left_data_at"] = report.left_data_at;
    out["steps"] = report.steps;
    return out;
}

inline void bind_train(nb::module_& m) {
    using model::Coupling;
    using model::PeriodicCurve;

    nb::class_<PeriodicCurve>(m, "PeriodicCurve")
        .def(nb::init<double, std::vector<double>, std::vector<double>>(), "period"_a, "angles"_a, "values"_a)
        .def_static("sine", &PeriodicCurve::sine, "amplitude"_a, "order"_a, "phase"_a, "error"_a)
        .def("pieces", &PeriodicCurve::pieces)
        .def("__call__", &PeriodicCurve::operator(), "angle"_a);
    m.def(
        "worm_efficiencies",
        [](double lead_angle, double friction_angle) {
            const auto mesh = model::MeshEfficiency::worm(lead_angle, friction_angle);
            return std::make_pair(mesh.driving(), mesh.overrunning());
        },
        "lead_angle"_a, "friction_angle"_a);
    m.def("train_causes", &train_causes, nb::sig("def train_causes() -> list[tuple[int, str]]"),
          "Of switchings of a train: number and name.");
    m.def("quadratic_drag", &model::Shaft::quadratic_drag, "coefficient"_a, "max_speed"_a, "error"_a);
    m.def(
        "stribeck_curve",
        [](double coulomb, double breakaway, double stribeck_speed, double error) {
            const auto f = model::DryFriction::stribeck(coulomb, breakaway, stribeck_speed, error);
            return std::make_pair(f.speeds, f.torques);
        },
        "friction_torque"_a, "breakaway_torque"_a, "stribeck_speed"_a, "error"_a);

    const auto add_coupling = [](Coupling::Kind kind) {
        return [kind](TrainDescription& t, const std::string& name, const std::string& input, const std::string& output,
                      double torque) { t.add_coupling(name, input, output, torque, kind); };
    };
    nb::class_<TrainDescription>(m, "Train")
        .def(nb::init<>())
        .def("add_shaft", &TrainDescription::add_shaft, "name"_a, "inertia"_a, "viscous_friction"_a, "friction"_a,
             "drag"_a.none(), "loaded"_a)
        .def("add_motor", &TrainDescription::add_motor, "name"_a, "shaft"_a, "parameters"_a, "torque_source"_a,
             "torque_limit"_a)
        .def("add_gear", &TrainDescription::add_gear, "name"_a, "input"_a, "output"_a, "parameters"_a,
             "torsion_curve"_a.none(), "loss_map"_a.none(), "efficiencies"_a.none(), "mesh_damping"_a,
             "transmission_error"_a.none())
        .def("add_brake", &TrainDescription::add_brake, "name"_a, "shaft"_a, "torque"_a)
        .def("add_clutch", add_coupling(Coupling::clutch), "name"_a, "input"_a, "output"_a, "torque"_a)
        .def("add_safety_clutch", add_coupling(Coupling::safety_clutch), "name"_a, "input"_a, "output"_a, "torque"_a)
        .def(
            "add_freewheel",
            [](TrainDescription& t, const std::string& name, const std::string& input, const std::string& output) {
                t.add_coupling(name, input, output, 0.0, Coupling::freewheel);
            },
            "name"_a, "input"_a, "output"_a)
        .def("add_angle_torque", &TrainDescription::add_angle_torque, "name"_a, "shaft"_a, "torque"_a)
        .def("check", &TrainDescription::check)
        .def("check_start", &TrainDescription::check_start, "speeds"_a)
        .def("channels", &TrainDescription::channels, nb::sig("def channels(self) -> list[tuple[str, str, str]]"),
             "Name, unit, meaning.")
        .def("input_names", &TrainDescription::input_names)
        .def("shafts", &TrainDescription::shafts,
             "Inertia [kg m2] and friction that holds at rest [N m] of each shaft.")
        .def("mesh_loss", &TrainDescription::mesh_loss, "gear"_a, "driven"_a, "speed"_a)
        .def("steady_regime", &TrainDescription::steady_regime, "speeds"_a, "torques"_a,
             nb::sig("def steady_regime(self, speeds: collections.abc.Sequence[float], torques: "
                     "collections.abc.Sequence[float]) -> tuple[list[str], numpy.typing.NDArray[numpy.float64], bool]"))
        .def("contact_names", &TrainDescription::contact_names);
    m.def("run_train", &run_train, "train"_a, "inputs"_a, "start"_a, "hysteresis_capacities"_a, "duration"_a,
          "interval"_a, "samples"_a, "energy"_a, "tolerance"_a, "max_switchings"_a,
          nb::sig("def run_train(train: Train, inputs: collections.abc.Sequence[Signal], start: "
                  "collections.abc.Mapping[str, float], hysteresis_capacities: collections.abc.Mapping[str, float], "
                  "duration: float, interval: float, samples: int, energy: bool, tolerance: float, max_switchings: int)"
                  " -> dict[str, typing.Any]"));
}

}  // namespace lostmotion::binding
