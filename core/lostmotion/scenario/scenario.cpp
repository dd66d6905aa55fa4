#include "scenario.hpp"

namespace lostmotion {

Scenario stepped_scenario(const model::Train& train, const Control& control) {
    Scenario s;
    s.train = train;
    s.control = control;
    s.references_given = true;
    s.start.resize(static_cast<std::size_t>(model::Assembly(train).layout().states));
    s.hysteresis_capacities.resize(train.gears.size());
    return s;
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
    const model::Assembly a(s.train);
    const std::vector<std::string> names = model::input_names(a);
    std::vector<bool> controlled(names.size());
    for (const ControlledAxis& axis : s.control.axes)
        controlled[static_cast<std::size_t>(a.places().motors[static_cast<std::size_t>(axis.motor)].command)] = true;
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
    if (!(s.duration / s.sample_interval <= max_samples)) return "sample_interval is too short for the duration";
    const auto counted = [](const char* what, std::size_t given, std::size_t wanted) {
        return given == wanted ? std::string()
                               : std::string(what) + ": there are " + std::to_string(given) + "; there must be " +
                                     std::to_string(wanted);
    };
    const TrainRun run(s.train);
    if (!run.error().empty()) return run.error();
    const std::size_t motors = s.train.motors.size(), shafts = s.train.shafts.size();
    const model::Layout& n = run.assembly().layout();
    for (std::string error : {counted("inputs", s.inputs.size(), static_cast<std::size_t>(n.inputs)),
                              counted("start", s.start.size(), static_cast<std::size_t>(n.states)),
                              counted("hysteresis_capacities", s.hysteresis_capacities.size(), s.train.gears.size())})
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
            if (c.motor == axis.motor) return "two controllers turn the same motor";
        if (axis.law.field_orientation && s.train.motors[m].law.kind != Motor::torque_source)
            return "a motor under field-oriented control must be a torque source";
    }
    for (std::size_t g = 0; g < s.train.gears.size(); ++g)
        if (const int twist = run.assembly().places().gears[g].twist;
            s.train.gears[g].rigid() && twist != model::nowhere && s.start[static_cast<std::size_t>(twist)] != 0.0)
            return "gear '" + s.train.gears[g].name + "' is rigid, but the start has a twist";
    return check_run(run.assembly(), s.start, s.control);
}

}  // namespace lostmotion
