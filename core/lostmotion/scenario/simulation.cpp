#include "simulation.hpp"

#include <type_traits>

namespace lostmotion {

ScenarioSimulation::ScenarioSimulation(const Scenario& scenario, double step)
    : train_(scenario.train, step, scenario.control, played_sines(scenario)),
      control_(scenario.control),
      variables_(scenario) {
    laws_ = control_.laws();
    name_all(scenario);
    reset(scenario.start, scenario.hysteresis_capacities);
}

double ScenarioSimulation::played_input(std::size_t k) const {
    for (const Played& p : played_)
        if (p.input == k) {
            double value = p.line(time());
            for (const Sine& sine : p.signal.sines) value += sine.at(time());
            return value;
        }
    const std::size_t a = k - free_.size();
    return k >= free_.size() && a < own_reference_.size() && own_reference_[a]
               ? control_.axes[a].law.reference.at(time()).value
               : std::nan("");
}

std::string ScenarioSimulation::text(Status status) const {
    return train_status_text(train_.assembly(), status, time(), motion().stopped_at(), motion().too_many_guards());
}

std::string ScenarioSimulation::reset(std::span<const double> states, std::span<const double> capacities) {
    return train_.reset(train_start(states, capacities));
}

auto ScenarioSimulation::advance(double interval, std::span<const double> begin, std::span<const double> end)
    -> Status {
    set_references(begin, end, interval);
    motion().save(before_);
    const double from = time(), to = from + interval;
    for (double until = from; until != to;) {
        const double t = time();
        follow_signals(t, accumulated);
        const double next = next_breakpoint(t);
        until = next < to - accumulated * to ? next : to;
        for (std::size_t k = 0; k < free_.size(); ++k) {
            const double slope = (end[k] - begin[k]) / interval;
            begin_[free_[k]] = t == from ? begin[k] : begin[k] + slope * (t - from);
            end_[free_[k]] = until == to ? end[k] : begin[k] + slope * (until - from);
        }
        for (const Played& p : played_) {
            begin_[free_[p.input]] = p.line(t);
            end_[free_[p.input]] = p.line(until);
        }
        const Status status = motion().advance(t == from && until == to ? interval : until - t, begin_, end_);
        if (status != Status::done) {
            motion().restore(before_);
            return status;
        }
    }
    return Status::done;
}

auto ScenarioSimulation::answer(double interval, std::span<const double> begin, std::span<const double> end,
                                const LoadShaft& shaft, LoadAnswer& out) -> Status {
    set_references(begin, end, interval);
    for (std::size_t k = 0; k < free_.size(); ++k) {
        begin_[free_[k]] = begin[k];
        end_[free_[k]] = end[k];
    }
    return motion().answer(interval, begin_, end_, shaft, out);
}

std::optional<ScenarioSimulation::GivenShaft> ScenarioSimulation::given_shaft(const std::string& name) const {
    const auto input = [&](const std::string& of) {
        return static_cast<std::size_t>(std::ranges::find(names_.inputs, name + of) - names_.inputs.begin());
    };
    const std::size_t speed = input("_given_speed"), acceleration = input("_given_acceleration");
    if (acceleration >= names_.inputs.size()) return {};
    const int angle = variables_.place(name + "_angle");
    return GivenShaft{speed, acceleration, angle >= 0 ? angle : variables_.place(name + "_position"),
                      variables_.place(name + "_speed"), variables_.place(name + "_acceleration")};
}

auto ScenarioSimulation::advance(double interval, std::span<const double> begin, std::span<const double> end,
                                 std::span<const GivenCourse> motions) -> Status {
    std::vector<double> now(variables_.size());
    if (const Status status = read(now.data()); status != Status::done) return status;
    const auto value = [&now](int variable) { return variable < 0 ? 0.0 : now[static_cast<std::size_t>(variable)]; };
    std::vector<MotionCourse> courses;
    std::vector<double> times;
    for (const GivenCourse& m : motions) {
        courses.emplace_back(m.to, value(m.shaft.angle), value(m.shaft.speed), value(m.shaft.acceleration), interval);
        times.insert(times.end(), courses.back().times().begin(), courses.back().times().end());
    }
    std::ranges::sort(times);
    times.erase(std::unique(times.begin(), times.end()), times.end());
    const auto inputs_at = [&](double t) {
        std::vector<double> row(begin.begin(), begin.end());
        for (std::size_t k = 0; k < row.size(); ++k) row[k] += (end[k] - begin[k]) * (t / interval);
        for (std::size_t k = 0; k < motions.size(); ++k) {
            row[motions[k].shaft.speed_input] = courses[k].speed(t);
            row[motions[k].shaft.acceleration_input] = courses[k].acceleration(t);
        }
        return row;
    };
    MotionState before;
    motion().save(before);
    for (std::size_t k = 1; k < times.size(); ++k) {
        const Status status = advance(times[k] - times[k - 1], inputs_at(times[k - 1]), inputs_at(times[k]));
        if (status == Status::done) continue;
        motion().restore(before);
        return status;
    }
    return Status::done;
}

void ScenarioSimulation::hold(std::span<const double> inputs) {
    motion().save(scratch_);
    if (!scratch_.started) {
        for (std::size_t k = 0; k < free_.size(); ++k) scratch_.input[free_[k]] = inputs[k];
        for (const Played& p : played_) scratch_.input[free_[p.input]] = p.line(scratch_.time);
        motion().restore(scratch_);
    }
    set_references(inputs, inputs, 1.0);
}

void ScenarioSimulation::place(double time, std::span<const double> states, std::span<const double> inputs) {
    for (Played& p : played_)
        if (time < p.signal.breakpoints[p.segment].time) p.segment = p.signal.segment(time);
    motion().save(scratch_);
    for (std::size_t k = 0; k < states.size(); ++k) scratch_.x[k] = states[first_[k]];
    for (std::size_t k = 0; k < free_.size(); ++k) scratch_.input[free_[k]] = inputs[k];
    for (const Played& p : played_) scratch_.input[free_[p.input]] = p.line(time);
    motion().place(time, scratch_.x, scratch_.input);
    set_references(inputs, inputs, 1.0);
}

void ScenarioSimulation::states(double* out) const {
    for (std::size_t k = 0; k < names_.states.size(); ++k) out[k] = motion().state(static_cast<int>(k));
}

auto ScenarioSimulation::rates(double* out) -> Status {
    const Status status = motion().find_regime();
    if (status == Status::done) motion().rates(out);
    return status;
}

auto ScenarioSimulation::guards(double* out) -> Status {
    const Status status = motion().find_regime();
    if (status == Status::done) motion().guards(out);
    return status;
}

auto ScenarioSimulation::settle() -> Status {
    follow_signals(time(), stopped);
    motion().save(scratch_);
    for (const Played& p : played_) scratch_.input[free_[p.input]] = p.line(scratch_.time);
    motion().restore(scratch_);
    return motion().settle();
}

auto ScenarioSimulation::read(double* out) -> Status {
    const Status status = motion().find_regime();
    if (status != Status::done) return status;
    std::ranges::copy(motion().values(), out);
    if (!laws_.empty()) read_controllers(out);
    variables_.derive(out, 1, 0);
    return status;
}

void ScenarioSimulation::go_on_from(const ScenarioSimulation& before) {
    before.motion().save(scratch_);
    scratch_.started = false;
    train_.restore(scratch_);
    follow_signals(time(), accumulated);
}

MotionState ScenarioSimulation::whole_state() const {
    MotionState s;
    motion().save(s);
    s.control.slots.resize(motion().control_slots());
    return s;
}

std::size_t ScenarioSimulation::state_size() const {
    std::size_t n = 1;
    const MotionState s = whole_state();
    each_number(s, [&](const auto&) { ++n; });
    return n;
}

void ScenarioSimulation::get_state(double* to) const {
    double* const first = to;
    const MotionState s = whole_state();
    each_number(s, [&](const auto& number) { *to++ = static_cast<double>(number); });
    *to = sum(first, to);
}

bool ScenarioSimulation::set_state(const double* from) {
    const std::size_t n = state_size();
    if (from[n - 1] != sum(from, from + n - 1)) return false;
    MotionState s = whole_state();
    each_number(s, [&](auto& number) { number = static_cast<std::remove_reference_t<decltype(number)>>(*from++); });
    if (!s.started && s.control.next == 0) s.control.slots.clear();
    motion().restore(s);
    follow_signals(time(), accumulated);
    return true;
}

bool ScenarioSimulation::restore(const MotionState& from) {
    const bool well = train_.restore(from);
    if (well) follow_signals(time(), accumulated);
    return well;
}

double ScenarioSimulation::Played::line(double time) const {
    const Breakpoint& b = signal.breakpoints[segment];
    const double s = time - b.time;
    if (segment >= rate.breakpoints.size() || rate.breakpoints[segment].time != b.time) return b.value + b.slope * s;
    const Breakpoint& r = rate.breakpoints[segment];
    return b.value + s * (r.value + 0.5 * s * r.slope);
}

auto ScenarioSimulation::played_sines(const Scenario& scenario) -> InputSines {
    InputSines sines;
    if (scenario.played.empty()) return sines;
    const std::vector<FreeInput> free = lostmotion::free_inputs(scenario);
    for (std::size_t k = 0; k < free.size() && k < scenario.played.size(); ++k)
        if (scenario.played[k])
            for (const Sine& sine : scenario.inputs[free[k].number].sines)
                if (sine.amplitude != 0.0) sines.emplace_back(static_cast<int>(free[k].number), sine);
    return sines;
}

double ScenarioSimulation::next_breakpoint(double time) const {
    double next = std::numeric_limits<double>::infinity();
    for (const Played& p : played_)
        next = std::fmin(next, p.signal.next_breakpoint(std::fmax(time, p.signal.breakpoints[p.segment].time)));
    return next;
}

void ScenarioSimulation::name_all(const Scenario& scenario) {
    names_.states = model::state_names(train_.assembly());
    for (const model::Gear& g : scenario.train.gears) names_.capacities.push_back(g.name);
    for (const std::string& name : names_.states)
        first_.push_back(static_cast<std::size_t>(std::find(names_.states.begin(), names_.states.end(), name) -
                                                  names_.states.begin()));
    for (const FreeInput& i : lostmotion::free_inputs(scenario)) {
        if (const std::size_t k = free_.size(); k < scenario.played.size() && scenario.played[k])
            played_.push_back({k, scenario.inputs[i.number], 0, no_rate()});
        free_.push_back(i.number);
        names_.inputs.push_back(i.name);
    }
    for (const model::ShaftPlace& shaft : train_.assembly().places().shafts)
        for (Played& p : played_)
            if (shaft.given_speed == static_cast<int>(free_[p.input]))
                p.rate = scenario.inputs[static_cast<std::size_t>(shaft.given_acceleration)];
    for (std::size_t a = 0; a < control_.axes.size() && scenario.references_given; ++a) {
        const std::size_t k = free_.size() + a;
        name_reference(scenario, control_.axes[a]);
        own_reference_.push_back(k < scenario.played.size() && scenario.played[k]);
    }
    begin_.resize(static_cast<std::size_t>(train_.assembly().layout().inputs));
    end_ = begin_;
    for (const ControlledAxis& axis : control_.axes) {
        const auto m = static_cast<std::size_t>(axis.motor);
        torques_.push_back(static_cast<std::size_t>(variables_.place(model::motor_torque_of(scenario.train, m))));
    }
    identity_ = 0xcbf29ce484222325u;
    for (const auto* list : {&names_.states, &names_.inputs})
        for (const std::string& name : *list) mix(identity_, name.data(), name.size());
}

void ScenarioSimulation::name_reference(const Scenario& scenario, const ControlledAxis& axis) {
    const std::string of = scenario.prefix(axis);
    const control::Axis::Mode mode = axis.law.mode;
    const model::Train& t = scenario.train;
    const int motor = t.motors[static_cast<std::size_t>(axis.motor)].shaft;
    names_.references.push_back({of + "reference",
                                 mode == control::Axis::position_mode ? model::angle_unit(t, axis.reference_shaft)
                                 : mode == control::Axis::speed_mode  ? model::speed_unit(t, axis.reference_shaft)
                                                                      : model::torque_unit(t, motor),
                                 mode == control::Axis::position_mode
                                     ? model::is_slide(t, axis.reference_shaft)
                                           ? "position that the controller is to follow"
                                           : "angle that the controller is to follow"
                                 : mode == control::Axis::speed_mode
                                     ? "speed that the controller is to follow"
                                     : std::string(model::torque_word(t, motor)) + " of the motor that is to act"});
    names_.inputs.push_back(names_.references.back().name);
}

void ScenarioSimulation::set_references(std::span<const double> begin, std::span<const double> end, double interval) {
    for (std::size_t a = 0; a < names_.references.size(); ++a) {
        if (own_reference_[a]) continue;
        const std::size_t k = free_.size() + a;
        motion().set_reference(a, begin[k], (end[k] - begin[k]) / interval);
    }
}

void ScenarioSimulation::mix(std::uint64_t& hash, const void* bytes, std::size_t n) {
    for (std::size_t k = 0; k < n; ++k) hash = (hash ^ static_cast<const unsigned char*>(bytes)[k]) * 0x100000001b3u;
}

double ScenarioSimulation::sum(const double* first, const double* end) const {
    std::uint64_t hash = identity_;
    mix(hash, first, sizeof(double) * static_cast<std::size_t>(end - first));
    return static_cast<double>(hash >> 12);
}

}  // namespace lostmotion
