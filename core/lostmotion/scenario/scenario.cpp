#include "scenario.hpp"

namespace lostmotion {

std::string check_build(Scenario::Form form) {
    if (form == Scenario::of_drive ? holds(Kernel::drive) : holds_trains) return {};
    return form == Scenario::of_drive ? "this core was built for trains; the scenario is of a drive in the short form"
                                      : "this core was built for drives in the short form; the scenario is of a train";
}

TrainStart train_start(const model::Assembly& a, std::span<const double> states, std::span<const double> capacities) {
    TrainStart start;
    const std::vector<std::string> names = model::state_names(a);
    for (std::size_t k = 0; k < names.size(); ++k) start.states[names[k]] = states[k];
    for (std::size_t g = 0; g < a.train().gears.size(); ++g)
        start.hysteresis_capacities[a.train().gears[g].name] = capacities[g];
    return start;
}

double value_at_start(const Signal& s) {
    double value = s.breakpoints[0].value;
    for (const Sine& sine : s.sines) value += sine.amplitude * sine_cosine(sine.phase).sin;
    return value;
}

std::vector<FreeInput> free_inputs(const Scenario& s) {
    std::vector<std::string> names{"command", "load_torque"};
    std::vector<std::size_t> commands{0};
    if (!s.is_of_drive()) {
        const model::Assembly a(s.train);
        names = model::input_names(a);
        commands.clear();
        for (const model::MotorPlace& m : a.places().motors) commands.push_back(static_cast<std::size_t>(m.command));
    }
    std::vector<bool> controlled(names.size());
    for (const ControlledAxis& axis : s.control.axes) controlled[commands[static_cast<std::size_t>(axis.motor)]] = true;
    std::vector<FreeInput> out;
    for (std::size_t k = 0; k < names.size(); ++k)
        if (!controlled[k]) out.push_back({names[k], k});
    return out;
}

std::string check_given_references(const Scenario& s) {
    for (const ControlledAxis& axis : s.control.axes)
        if (axis.law.position_loop.reference_delay > 0.0)
            return "a controller has a reference_delay, for which it has to know the past of its reference; set it to "
                   "0";
    return {};
}

std::string check(const Scenario& s) {
    if (std::string error = check_build(s.form); !error.empty()) return error;
    if (!(s.duration / s.sample_interval <= max_samples)) return "sample_interval is too short for the duration";
    const auto counted = [](const char* what, std::size_t given, std::size_t wanted) {
        return given == wanted ? std::string()
                               : std::string(what) + ": there are " + std::to_string(given) + "; there must be " +
                                     std::to_string(wanted);
    };
    std::size_t motors = 1, shafts = 2, states = n_states, inputs = n_inputs, gears = 1;
    if (!s.is_of_drive()) {
        const TrainRun run(s.train);
        if (!run.error().empty()) return run.error();
        motors = s.train.motors.size();
        shafts = s.train.shafts.size();
        gears = s.train.gears.size();
        states = static_cast<std::size_t>(run.assembly().layout().states);
        inputs = static_cast<std::size_t>(run.assembly().layout().inputs);
    }
    for (std::string error : {counted("inputs", s.inputs.size(), inputs), counted("start", s.start.size(), states),
                              counted("hysteresis_capacities", s.hysteresis_capacities.size(), gears)})
        if (!error.empty()) return error;
    std::vector<bool> turned(motors);
    for (const ControlledAxis& axis : s.control.axes) {
        const auto exists = [](int k, std::size_t n) { return k >= 0 && static_cast<std::size_t>(k) < n; };
        if (!exists(axis.motor, motors) || !exists(axis.position_shaft, shafts) || !exists(axis.speed_shaft, shafts) ||
            !exists(axis.reference_shaft, shafts))
            return "a controller names a motor or a shaft that there is not";
        const auto m = static_cast<std::size_t>(axis.motor);
        if (turned[m]) return "two controllers turn the same motor";
        turned[m] = true;
        for (const model::LinearController& c : s.train.controllers)
            if (!s.is_of_drive() && c.motor == axis.motor) return "two controllers turn the same motor";
        const Motor& law = !s.is_of_drive() ? s.train.motors[m].law : s.drive.motor;
        if (axis.law.field_orientation && law.kind != Motor::torque_source)
            return "a motor under field-oriented control must be a torque source";
    }
    if (!s.is_of_drive()) {
        const TrainRun run(s.train);
        if (std::string error = check_control(run.assembly(), s.control); !error.empty()) return error;
        return check_start(run.assembly(), s.start);
    }
    if (s.drive.rigid() && s.start[twist] != 0.0) return "the gearbox is rigid, but the start has a twist";
    return {};
}

}  // namespace lostmotion
