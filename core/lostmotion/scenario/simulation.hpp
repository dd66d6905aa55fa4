// A scenario, a drive or a train step by step, whichever kernel it takes.
#pragma once

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <memory>
#include <span>
#include <string>
#include <type_traits>
#include <utility>
#include <variant>
#include <vector>

#include "../simulation/hybrid.hpp"
#include "../simulation/train_stepping.hpp"
#include "variables.hpp"

namespace lostmotion {

// What a snapshot consists of, number by number: use(number) may read or write. slots: how many the controllers have.
template <class Snapshot, class Use>
void each_number_of_snapshot(Snapshot& s, int slots, Use&& use) {
    use(s.time);
    for (auto& x : s.x) use(x);
    if constexpr (requires { s.memory.hysteresis_capacity; }) {
        use(s.memory.hysteresis_capacity);
        use(s.memory.locked_torque);
    } else {
        for (auto& m : s.memory) use(m);
    }
    for (auto& m : s.key.modes) use(m);
    if constexpr (requires { s.key.branch; }) {
        for (auto& b : s.key.branch) use(b);
    } else {
        use(s.key.amplifier);
        use(s.key.piece);
        use(s.key.cell);
        use(s.key.cell_back);
    }
    for (auto& u : s.input) use(u);
    use(s.started);
    use(s.steady);
    each_number(s.course, use);
    use(s.control.next);
    if constexpr (!std::is_const_v<Snapshot>) s.control.slots.resize(static_cast<std::size_t>(slots));
    for (std::size_t k = 0; k < static_cast<std::size_t>(slots); ++k) {
        if constexpr (std::is_const_v<Snapshot>)
            use(k < s.control.slots.size() ? s.control.slots[k] : 0.0);
        else
            use(s.control.slots[k]);
    }
}

class ScenarioSimulation {
 public:
    // The scenario has passed its check. It begins at its start.
    ScenarioSimulation(const Scenario& scenario, double step) : control_(scenario.control), variables_(scenario) {
        if (scenario.is_of_drive()) {
            if constexpr (holds(Kernel::drive)) drive_ = std::make_unique<Simulation>(scenario.drive, step, control_);
        } else if constexpr (holds_trains) {
            train_ = std::make_unique<TrainSimulation>(scenario.train, step, control_);
        }
        laws_ = control_.laws();
        name_all(scenario);
        reset(scenario.start, scenario.hysteresis_capacities);
    }
    // A train that has passed its check, from rest.
    ScenarioSimulation(const model::Train& train, double step) : ScenarioSimulation(of_train(train), step) {}

    struct Names {
        std::vector<std::string> states, inputs, capacities;
        std::vector<Variable> references;  // those of sampled controllers that are inputs, the last of them
    };
    const Names& names() const { return names_; }
    const Variables& variables() const { return variables_; }
    // How many inputs the solver has, those of controllers among them, and which of them is the k-th of the names.
    std::size_t solver_inputs() const { return begin_.size(); }
    std::size_t solver_input(std::size_t k) const { return free_[k]; }
    std::size_t free_inputs() const { return free_.size(); }
    // Of an input in the scenario, at t = 0.
    double input_at_start(std::size_t k) const { return at_start_[k]; }

    // use(simulation) with that of its kernel.
    template <class Use>
    decltype(auto) with(Use&& use) {
        if constexpr (holds(Kernel::drive))
            if (!holds_trains || drive_) return use(*drive_);
        if constexpr (holds_trains) return train_->with(use);
    }
    template <class Use>
    decltype(auto) with(Use&& use) const {
        if constexpr (holds(Kernel::drive))
            if (!holds_trains || drive_) return use(std::as_const(*drive_));
        if constexpr (holds_trains) return std::as_const(*train_).with(use);
    }
    TrainSimulation* train() { return train_.get(); }

    double time() const {
        return with([](const auto& s) { return s.time(); });
    }
    // Why a status is what it is, in words; empty if all is well.
    std::string text(Status status) const {
        return with([&]<class S>(const S& s) {
            if constexpr (std::is_same_v<S, Simulation>)
                return status_text(status, s.time(), s.stopped_at());
            else
                return train_status_text(train_->assembly(), status, s.time(), s.stopped_at(), s.too_many_guards());
        });
    }

    // To t = 0, with the contacts still to be found. Returns what is wrong with the start, or nothing.
    std::string reset(std::span<const double> states, std::span<const double> capacities) {
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
    TrainStart train_start(std::span<const double> states, std::span<const double> capacities) const {
        return lostmotion::train_start(train_->assembly(), states, capacities);
    }

    // Each input of names().inputs runs in a straight line from its first to its second value.
    Status advance(double interval, std::span<const double> begin, std::span<const double> end) {
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
    // What acts at t = 0, for what is read before the first step.
    void hold(std::span<const double> inputs) {
        with([&](auto& s) {
            if (s.snapshot().started) return;
            auto snapshot = s.snapshot();
            for (std::size_t k = 0; k < free_.size(); ++k) snapshot.input[free_[k]] = inputs[k];
            s.restore(snapshot);
        });
        set_references(inputs, inputs, 1.0);
    }

    // --- as a hybrid system, which an integrator of the caller's own solves ---

    // Windings exchange torque and speed with the solver within a tick.
    bool has_windings() const {
        return std::any_of(laws_.begin(), laws_.end(), [](const control::Axis& a) { return !!a.field_orientation; });
    }
    // At a time, with states by names().states and inputs by names().inputs, in the regime that it is in.
    void place(double time, std::span<const double> states, std::span<const double> inputs) {
        with([&]<class S>(S& s) {
            auto x = s.snapshot().x;
            auto u = s.snapshot().input;
            for (std::size_t k = 0; k < states.size(); ++k) x[place_of<typename S::D>(k)] = states[first_[k]];
            for (std::size_t k = 0; k < free_.size(); ++k) u[free_[k]] = inputs[k];
            s.place(time, x, u);
        });
        set_references(inputs, inputs, 1.0);
    }
    void states(double* out) const {
        with([&]<class S>(const S& s) {
            for (std::size_t k = 0; k < names_.states.size(); ++k) out[k] = s.snapshot().x[place_of<typename S::D>(k)];
        });
    }
    // Of the states.
    Status rates(double* out) {
        return with([&]<class S>(S& s) {
            const Status status = s.find_regime();
            if (status != Status::done) return status;
            const auto rates = s.rates();
            for (std::size_t k = 0; k < names_.states.size(); ++k) out[k] = rates[place_of<typename S::D>(k)];
            return status;
        });
    }
    std::size_t guard_count() const {
        return with([]<class S>(const S&) { return static_cast<std::size_t>(S::n_guards); });
    }
    Status guards(double* out) {
        return with([&](auto& s) {
            const Status status = s.find_regime();
            if (status == Status::done) std::ranges::copy(s.guards(), out);
            return status;
        });
    }
    Status settle() {
        return with([](auto& s) { return s.settle(); });
    }
    double next_tick() const {
        return with([](const auto& s) { return s.next_tick(); });
    }
    bool accept() {
        return with([](auto& s) { return s.find_regime() == Status::done && s.accept(); });
    }

    // All variables at the present instant, with the inputs at their last values.
    Status read(double* out) {
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

    // Another scenario of the same elements, at the present state: the contacts are found anew.
    void go_on_from(const ScenarioSimulation& before) {
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

    // The whole state as numbers, with one that tells whether they belong to this simulation and are whole.
    std::size_t state_size() const {
        std::size_t n = 1;
        with([&](const auto& s) {
            each_number_of_snapshot(s.snapshot(), s.control_slots(), [&](const auto&) { ++n; });
        });
        return n;
    }
    void get_state(double* to) const {
        double* const first = to;
        with([&](const auto& s) {
            each_number_of_snapshot(s.snapshot(), s.control_slots(),
                                    [&](const auto& number) { *to++ = static_cast<double>(number); });
        });
        *to = sum(first, to);
    }
    // False: the numbers are not those of a state of such a simulation.
    bool set_state(const double* from) {
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

 private:
    static Scenario of_train(const model::Train& train) {
        Scenario s;
        s.form = Scenario::of_train;
        s.train = train;
        const model::Assembly a(train);
        s.start.resize(static_cast<std::size_t>(a.layout().states));
        s.hysteresis_capacities.resize(train.gears.size());
        return s;
    }
    void name_all(const Scenario& scenario) {
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

    void name_reference(const Scenario& scenario, const ControlledAxis& axis) {
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
    // The last inputs, each in a straight line from its first to its second value.
    void set_references(std::span<const double> begin, std::span<const double> end, double interval) {
        for (std::size_t a = 0; a < names_.references.size(); ++a) {
            const std::size_t k = free_.size() + a;
            with([&](auto& s) { s.set_reference(a, begin[k], (end[k] - begin[k]) / interval); });
        }
    }
    // Of a state, by its number among the names, that in the kernel.
    template <class D>
    std::size_t place_of(std::size_t k) const {
        if (drive_) return k;
        const auto coupled = static_cast<std::size_t>(train_->assembly().layout().coupled);
        return k < coupled ? k : k - coupled + static_cast<std::size_t>(D::coupled);
    }

    static void mix(std::uint64_t& hash, const void* bytes, std::size_t n) {
        for (std::size_t k = 0; k < n; ++k)
            hash = (hash ^ static_cast<const unsigned char*>(bytes)[k]) * 0x100000001b3u;
    }
    // What the controllers show. A motor with a winding has the torque of its currents, in the place of the straight
    // line that drives the mechanics.
    template <class Snapshot>
    void read_controllers(const Snapshot& now, double* out) const {
        std::vector<const double*> slots{now.control.slots.data()};
        std::vector<std::array<double, control::n_winding_signals>> windings;
        for (const control::Axis& law : laws_) {
            windings.push_back(winding_signals_of(law, now.time, slots.back()));
            slots.push_back(slots.back() + law.slots());
        }
        double* to = out + variables_.first_shown();
        for (const Variables::Shown& shown : variables_.shown()) {
            const auto a = static_cast<std::size_t>(shown.axis);
            *to++ = shown.signal < control::n_axis_signals
                        ? laws_[a].signal(shown.signal, slots[a])
                        : windings[a][static_cast<std::size_t>(shown.signal - control::n_axis_signals)];
        }
        for (std::size_t a = 0; a < laws_.size(); ++a)
            if (laws_[a].field_orientation) out[torques_[a]] = laws_[a].winding_torque(now.time, slots[a]);
    }

    // Of the bits of numbers, as a number without a fraction.
    double sum(const double* first, const double* end) const {
        std::uint64_t hash = identity_;
        mix(hash, first, sizeof(double) * static_cast<std::size_t>(end - first));
        return static_cast<double>(hash >> 12);
    }

    std::unique_ptr<Simulation> drive_;
    std::unique_ptr<TrainSimulation> train_;
    Control control_;
    std::vector<control::Axis> laws_;
    std::vector<std::size_t> torques_;  // variables of the motors that the laws turn
    Variables variables_;
    Names names_;
    std::vector<std::size_t> free_;   // inputs that no controller gives
    std::vector<std::size_t> first_;  // of each state the first of its name
    std::vector<double> at_start_;    // of each input
    std::vector<double> begin_, end_;
    std::uint64_t identity_ = 0;
};

}  // namespace lostmotion
