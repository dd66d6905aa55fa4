// The core as a program without Python: numbers in, numbers out. Compiled to WebAssembly, it shows that another
// processor and another library give the same bits (tests/test_portable.py, which also writes what it reads).
//
// It reads doubles from the standard input: 0 and the arguments of one run of a drive, or 1 and those of a train, as
// the Python extension's run and run_train take them. A list is its length and its entries, a text likewise, with one
// number for each character; what is absent is 0. It writes doubles: status, time reached, end state, memory, energies,
// the switchings and the samples.
#include "lostmotion/simulation/run.hpp"

#include <cstdio>
#include <map>
#include <string>
#include <vector>

#include "lostmotion/drive/parameters.hpp"
#include "lostmotion/model/train_description.hpp"
#include "lostmotion/simulation/result_names.hpp"
#include "lostmotion/simulation/train_run.hpp"

namespace lostmotion {
namespace {

std::vector<double> read_all(std::FILE* from) {
    std::vector<double> all;
    double buffer[512];
    while (const std::size_t n = std::fread(buffer, sizeof(double), 512, from))
        all.insert(all.end(), buffer, buffer + n);
    return all;
}

class Input {
 public:
    explicit Input(std::vector<double> numbers) : numbers_(std::move(numbers)) {}

    double number() { return numbers_.at(next_++); }
    int integer() { return static_cast<int>(number()); }
    bool flag() { return number() != 0.0; }
    // use() for each entry of a list.
    template <class Use>
    void each(Use&& use) {
        for (int n = integer(); n > 0; --n) use();
    }
    std::vector<double> list() {
        std::vector<double> all;
        each([&] { all.push_back(number()); });
        return all;
    }
    std::string text() {
        std::string all;
        each([&] { all += static_cast<char>(integer()); });
        return all;
    }
    std::map<std::string, double> by_name() {
        std::map<std::string, double> all;
        each([&] {
            const std::string name = text();
            all[name] = number();
        });
        return all;
    }
    std::vector<std::array<double, 3>> triples() {
        std::vector<std::array<double, 3>> all;
        each([&] {
            const std::vector<double> three = list();
            all.push_back({three.at(0), three.at(1), three.at(2)});
        });
        return all;
    }
    Signal signal() {
        const auto breakpoints = triples();
        return signal_of(breakpoints, triples());
    }

    // How a law is given: 0: there is none.
    enum Given { nothing, by_points, by_formula };
    std::optional<TorsionCurve> torsion_curve() {
        const int given = integer();
        if (given == nothing) return std::nullopt;
        if (given == by_formula) {
            const double coefficient = number(), max_speed = number();
            return model::Shaft::quadratic_drag(coefficient, max_speed, number());
        }
        std::vector<double> breaks = list();
        return TorsionCurve(std::move(breaks), list());
    }
    std::optional<LossMap> loss_map() {
        if (integer() == nothing) return std::nullopt;
        std::vector<double> speeds = list(), loads = list();
        return LossMap(std::move(speeds), std::move(loads), list());
    }
    std::optional<model::PeriodicCurve> periodic_curve() {
        const int given = integer();
        if (given == nothing) return std::nullopt;
        if (given == by_formula) {
            const double amplitude = number();
            const int order = integer();
            const double phase = number();
            return model::PeriodicCurve::sine(amplitude, order, phase, number());
        }
        const double period = number();
        std::vector<double> angles = list();
        return model::PeriodicCurve(period, std::move(angles), list());
    }

 private:
    std::vector<double> numbers_;
    std::size_t next_ = 0;
};

template <class T>
const T* address(const std::optional<T>& of) {
    return of ? &*of : nullptr;
}

using Output = std::vector<double>;

Output run_drive(Input& in) {
    const auto parameters = in.by_name();
    const bool torque_source = in.flag();
    const auto curve = in.torsion_curve();
    const auto map = in.loss_map();
    const Drive drive = drive_of(parameters, torque_source, address(curve), address(map));
    const Signal command = in.signal(), load_torque = in.signal();
    Start start;
    const std::vector<double> x = in.list();
    std::copy_n(x.begin(), n_states, start.x.begin());
    start.memory.hysteresis_capacity = in.number();
    RunOptions options;
    options.duration = in.number();
    options.sample_interval = in.number();
    options.samples = static_cast<std::size_t>(in.number());
    options.energy = in.flag();
    const double tolerance = in.number();
    options.max_switchings = static_cast<std::size_t>(in.number());

    std::vector<double> samples(n_channels * options.samples);
    const Signals signals{command, load_torque};
    const RunReport r = tolerance > 0.0 ? run_adaptive(drive, signals, start, options, tolerance, samples.data())
                                        : run_exact(drive, signals, start, options, samples.data());
    Output out{static_cast<double>(r.status), r.time};
    out.insert(out.end(), r.x.begin(), r.x.begin() + n_states);
    out.push_back(r.memory.hysteresis_capacity);
    for (const EnergyEntry& entry : energy_entries) out.push_back(entry.of(r.energy));
    for (const Switching& s : r.switchings)
        for (const SwitchingColumn& c : switching_columns()) out.push_back(c.value(s));
    out.insert(out.end(), samples.begin(), samples.end());
    return out;
}

model::Shaft shaft(Input& in) {
    model::Shaft s;
    s.name = in.text();
    s.inertia = in.number();
    s.viscous_friction = in.number();
    in.integer();  // of the friction: four entries
    s.friction.torque = in.number();
    s.friction.breakaway_torque = in.number();
    s.friction.speeds = in.list();
    s.friction.torques = in.list();
    if (const auto drag = in.torsion_curve()) s.drag = *drag;
    s.loaded = in.flag();
    return s;
}

void add_gear(Input& in, model::TrainDescription& train) {
    const std::string name = in.text(), input = in.text(), output = in.text();
    const auto parameters = in.by_name();
    const auto curve = in.torsion_curve();
    const auto map = in.loss_map();
    const std::vector<double> given = in.list();
    std::optional<std::pair<double, double>> efficiencies;
    if (!given.empty()) efficiencies.emplace(given.at(0), given.at(1));
    const double mesh_damping = in.number();
    const auto error = in.periodic_curve();
    train.add_gear(name, input, output, drive_of(parameters, false, address(curve), address(map)).gearbox, efficiencies,
                   mesh_damping, address(error));
}

// Elements in the order in which they were added, each with the name of what adds it.
model::TrainDescription train_of(Input& in) {
    model::TrainDescription train;
    in.each([&] {
        const std::string what = in.text();
        if (what == "add_shaft") return train.add_shaft(shaft(in));
        if (what == "add_gear") return add_gear(in, train);
        const std::string name = in.text(), at = in.text();
        if (what == "set_housing") return train.set_housing(name, at);
        if (what == "add_motor") {
            const auto parameters = in.by_name();
            const bool torque_source = in.flag();
            const Motor law = drive_of(parameters, torque_source, nullptr, nullptr).motor;
            train.add_motor(name, at, law, in.number());
        } else if (what == "add_brake") {
            const double torque = in.number();
            train.add_brake(name, at, torque, in.number());
        } else if (what == "add_angle_torque") {
            train.add_angle_torque(name, at, *in.periodic_curve());
        } else {
            using model::Coupling;
            const std::string output = in.text();
            const Coupling::Kind kind = what == "add_clutch"          ? Coupling::clutch
                                        : what == "add_safety_clutch" ? Coupling::safety_clutch
                                                                      : Coupling::freewheel;
            const bool free = kind == Coupling::freewheel;
            const double torque = free ? 0.0 : in.number(), breakaway_torque = free ? 0.0 : in.number();
            train.add_coupling(name, at, output, torque, breakaway_torque, kind);
        }
    });
    return train;
}

Output run_train(Input& in) {
    const TrainRun run(train_of(in).train);
    std::vector<Signal> signals;
    in.each([&] { signals.push_back(in.signal()); });
    const Named states = in.by_name();
    const TrainStart start{states, in.by_name()};
    TrainOptions options;
    options.duration = in.number();
    options.sample_interval = in.number();
    options.samples = static_cast<std::size_t>(in.number());
    options.energy = in.flag();
    options.tolerance = in.number();
    options.max_switchings = static_cast<std::size_t>(in.number());

    std::vector<double> samples(run.channels().size() * options.samples);
    const TrainReport r = run.run(signals, start, options, samples.data());
    Output out{static_cast<double>(r.status), r.time};
    for (const auto& [name, value] : named_end(r, run.assembly())) out.push_back(value);
    for (const auto& [name, energy] : named_ledger(r, run.assembly())) out.push_back(energy);
    const int contacts = run.assembly().layout().contacts;
    std::vector<double> row(2 + 2 * static_cast<std::size_t>(contacts));
    for (const TrainSwitching& s : r.switchings) {
        write_switching(s, contacts, row.data());
        out.insert(out.end(), row.begin(), row.end());
    }
    out.insert(out.end(), samples.begin(), samples.end());
    return out;
}

}  // namespace
}  // namespace lostmotion

int main() {
    using namespace lostmotion;
    Input in(read_all(stdin));
    const Output out = in.integer() == 0 ? run_drive(in) : run_train(in);
    return std::fwrite(out.data(), sizeof(double), out.size(), stdout) == out.size() ? 0 : 1;
}
