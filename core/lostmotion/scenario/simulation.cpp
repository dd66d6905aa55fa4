#include "simulation.hpp"

namespace lostmotion {

ScenarioSimulation::ScenarioSimulation(const Scenario& scenario, double step)
    : control_(scenario.control), variables_(scenario) {
    if (scenario.is_of_drive()) {
        if constexpr (holds(Kernel::drive)) drive_ = std::make_unique<Simulation>(scenario.drive, step, control_);
    } else if constexpr (holds_trains) {
        train_ = std::make_unique<TrainSimulation>(scenario.train, step, control_);
    }
    laws_ = control_.laws();
    name_all(scenario);
    reset(scenario.start, scenario.hysteresis_capacities);
}

std::string ScenarioSimulation::text(Status status) const {
    return with([&]<class S>(const S& s) {
        if constexpr (std::is_same_v<S, Simulation>)
            return status_text(status, s.time(), s.stopped_at());
        else
            return train_status_text(train_->assembly(), status, s.time(), s.stopped_at(), s.too_many_guards());
    });
}

std::string ScenarioSimulation::reset(std::span<const double> states, std::span<const double> capacities) {
    return with([&]<class S>(S& s) -> std::string {
        if constexpr (std::is_same_v<S, Simulation>) {
            Simulation::Snapshot start;
            std::copy(states.begin(), states.end(), start.x.begin());
            start.memory = {capacities[0], 0.0};
            s.restore(start);
            return "";
        } else {
            return train_->reset(train_start(states, capacities));
        }
    });
}

auto ScenarioSimulation::advance(double interval, std::span<const double> begin, std::span<const double> end)
    -> Status {
    for (std::size_t k = 0; k < free_.size(); ++k) {
        begin_[free_[k]] = begin[k];
        end_[free_[k]] = end[k];
    }
    set_references(begin, end, interval);
    return with([&]<class S>(S& s) {
        InputsOf<typename S::D> first{}, last{};
        std::copy(begin_.begin(), begin_.end(), first.begin());
        std::copy(end_.begin(), end_.end(), last.begin());
        return s.advance(interval, first, last);
    });
}

void ScenarioSimulation::hold(std::span<const double> inputs) {
    with([&](auto& s) {
        if (s.snapshot().started) return;
        auto snapshot = s.snapshot();
        for (std::size_t k = 0; k < free_.size(); ++k) snapshot.input[free_[k]] = inputs[k];
        s.restore(snapshot);
    });
    set_references(inputs, inputs, 1.0);
}

void ScenarioSimulation::place(double time, std::span<const double> states, std::span<const double> inputs) {
    with([&]<class S>(S& s) {
        auto x = s.snapshot().x;
        auto u = s.snapshot().input;
        for (std::size_t k = 0; k < states.size(); ++k) x[place_of<typename S::D>(k)] = states[first_[k]];
        for (std::size_t k = 0; k < free_.size(); ++k) u[free_[k]] = inputs[k];
        s.place(time, x, u);
    });
    set_references(inputs, inputs, 1.0);
}

void ScenarioSimulation::states(double* out) const {
    with([&]<class S>(const S& s) {
        for (std::size_t k = 0; k < names_.states.size(); ++k) out[k] = s.snapshot().x[place_of<typename S::D>(k)];
    });
}

auto ScenarioSimulation::rates(double* out) -> Status {
    return with([&]<class S>(S& s) {
        const Status status = s.find_regime();
        if (status != Status::done) return status;
        const auto rates = s.rates();
        for (std::size_t k = 0; k < names_.states.size(); ++k) out[k] = rates[place_of<typename S::D>(k)];
        return status;
    });
}

auto ScenarioSimulation::guards(double* out) -> Status {
    return with([&](auto& s) {
        const Status status = s.find_regime();
        if (status == Status::done) std::ranges::copy(s.guards(), out);
        return status;
    });
}

auto ScenarioSimulation::read(double* out) -> Status {
    const Status status = with([](auto& s) { return s.find_regime(); });
    if (status != Status::done) return status;
    with([&]<class S>(S& s) {
        if constexpr (std::is_same_v<S, Simulation>)
            std::ranges::copy(s.reading().value, out);
        else
            std::ranges::copy(s.values(), out);
    });
    if (!laws_.empty()) with([&](const auto& in) { read_controllers(in.snapshot(), out); });
    variables_.derive(out, 1, 0);
    return status;
}

void ScenarioSimulation::go_on_from(const ScenarioSimulation& before) {
    with([&]<class S>(S& to) {
        before.with([&]<class From>(const From& from) {
            if constexpr (std::is_same_v<S, From>) {
                auto snapshot = from.snapshot();
                snapshot.started = false;
                to.restore(snapshot);
            }
        });
    });
}

std::size_t ScenarioSimulation::state_size() const {
    std::size_t n = 1;
    with([&](const auto& s) { each_number_of_snapshot(s.snapshot(), s.control_slots(), [&](const auto&) { ++n; }); });
    return n;
}

void ScenarioSimulation::get_state(double* to) const {
    double* const first = to;
    with([&](const auto& s) {
        each_number_of_snapshot(s.snapshot(), s.control_slots(),
                                [&](const auto& number) { *to++ = static_cast<double>(number); });
    });
    *to = sum(first, to);
}

bool ScenarioSimulation::set_state(const double* from) {
    const std::size_t n = state_size();
    if (from[n - 1] != sum(from, from + n - 1)) return false;
    with([&](auto& s) {
        auto snapshot = s.snapshot();
        each_number_of_snapshot(snapshot, s.control_slots(), [&](auto& number) {
            number = static_cast<std::remove_reference_t<decltype(number)>>(*from++);
        });
        if (!snapshot.started && snapshot.control.next == 0) snapshot.control.slots.clear();
        s.restore(snapshot);
    });
    return true;
}

auto ScenarioSimulation::of_train(const model::Train& train) -> Scenario {
    Scenario s;
    s.form = Scenario::of_train;
    s.train = train;
    const model::Assembly a(train);
    s.start.resize(static_cast<std::size_t>(a.layout().states));
    s.hysteresis_capacities.resize(train.gears.size());
    return s;
}

void ScenarioSimulation::name_all(const Scenario& scenario) {
    if (drive_) {
        for (const StateName& s : state_names) names_.states.emplace_back(s.name);
        names_.capacities.emplace_back("gearbox");
    } else {
        names_.states = model::state_names(train_->assembly());
        for (const model::Gear& g : scenario.train.gears) names_.capacities.push_back(g.name);
    }
    for (const std::string& name : names_.states)
        first_.push_back(static_cast<std::size_t>(std::find(names_.states.begin(), names_.states.end(), name) -
                                                  names_.states.begin()));
    for (const FreeInput& i : lostmotion::free_inputs(scenario)) {
        free_.push_back(i.number);
        names_.inputs.push_back(i.name);
        at_start_.push_back(i.number < scenario.inputs.size() ? value_at_start(scenario.inputs[i.number]) : 0.0);
    }
    for (std::size_t a = 0; a < control_.axes.size() && scenario.references_given; ++a)
        name_reference(scenario, control_.axes[a]);
    begin_.resize(scenario.is_of_drive() ? std::size_t{n_inputs}
                                         : static_cast<std::size_t>(train_->assembly().layout().inputs));
    end_ = begin_;
    for (const ControlledAxis& axis : control_.axes) {
        const auto m = static_cast<std::size_t>(axis.motor);
        const std::string motor = scenario.is_of_drive() ? "motor" : scenario.train.motors[m].name;
        torques_.push_back(static_cast<std::size_t>(variables_.place(motor + "_torque")));
    }
    identity_ = 0xcbf29ce484222325u;
    for (const auto* list : {&names_.states, &names_.inputs})
        for (const std::string& name : *list) mix(identity_, name.data(), name.size());
}

void ScenarioSimulation::name_reference(const Scenario& scenario, const ControlledAxis& axis) {
    const auto m = static_cast<std::size_t>(axis.motor);
    const std::string of = scenario.is_of_drive() ? "" : scenario.train.motors[m].name + "_";
    const control::Axis::Mode mode = axis.law.mode;
    names_.references.push_back({of + "reference",
                                 mode == control::Axis::position_mode ? "rad"
                                 : mode == control::Axis::speed_mode  ? "rad/s"
                                                                      : "N*m",
                                 mode == control::Axis::position_mode ? "angle that the controller is to follow"
                                 : mode == control::Axis::speed_mode  ? "speed that the controller is to follow"
                                                                      : "torque of the motor that is to act"});
    names_.inputs.push_back(names_.references.back().name);
    at_start_.push_back(axis.law.reference.at(0.0).value);
}

void ScenarioSimulation::set_references(std::span<const double> begin, std::span<const double> end, double interval) {
    for (std::size_t a = 0; a < names_.references.size(); ++a) {
        const std::size_t k = free_.size() + a;
        with([&](auto& s) { s.set_reference(a, begin[k], (end[k] - begin[k]) / interval); });
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
