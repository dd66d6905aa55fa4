// Runs of drives, whole and step by step, read by what the tests call their quantities.
#pragma once

#include <stdexcept>

#include "lostmotion/simulation/train_stepping.hpp"
#include "recorded.hpp"

namespace lostmotion::test {

struct Start {
    State x{};
    double hysteresis_capacity = 0.0;  // [N m]
};

inline Start start_at(std::initializer_list<std::pair<Quantity, double>> states) {
    Start s;
    for (const auto& [state, value] : states) s.x[state] = value;
    return s;
}

inline std::size_t channel_number(const std::vector<TrainChannel>& channels, Quantity q) {
    for (std::size_t c = 0; c < channels.size(); ++c)
        if (channels[c].name == quantity_names[q]) return c;
    throw std::out_of_range(quantity_names[q]);
}

struct Samples : model::Recorded {
    using Recorded::Recorded;

    double operator()(Quantity q, std::size_t k) const {
        if (q == twist && run.assembly().train().gears[0].rigid()) return 0.0;
        return out[channel_number(run.channels(), q) * samples + k];
    }
    // [J]
    double energy(const char* flow) const { return value_of(named_ledger(report, run.assembly()), flow); }
    // The number of a contact among those of the train.
    int contact(Quantity q) const { return run.channels()[channel_number(run.channels(), q)].index; }
};

// By the exact solver, or by the adaptive one to a tolerance.
inline Samples run(const Drive& drive, const Signals& signals, double duration, double interval = 1e-3,
                   const Start& start = {}, double adaptive_tolerance = 0.0) {
    const model::Train train = train_of(drive);
    TrainStart named{{}, {{"gearbox", start.hysteresis_capacity}}};
    for (int k = 0; k < n_states; ++k) named.states[quantity_names[k]] = start.x[k];
    const auto [x, memory] = in_layout(model::Assembly(train), named);
    return {train, {signals.begin(), signals.end()}, duration, interval, adaptive_tolerance, x, memory};
}

// To where another simulation of the same train is.
inline void restore(TrainSimulation& to, const TrainSimulation& from) {
    MotionState state;
    from.motion().save(state);
    to.restore(state);
}
inline TrainPoint point(TrainSimulation& s) { return s.motion().point(); }

// A drive step by step.
class Simulation {
 public:
    Simulation(const Drive& drive, double step) : train(train_of(drive), step) {}

    Status advance(double interval, double command_begin, double command_end, double load_begin, double load_end) {
        return train.motion().advance(interval, std::array{command_begin, load_begin},
                                      std::array{command_end, load_end});
    }
    double operator()(Quantity q) { return point(train).values[channel_number(train.channels(), q)]; }

    TrainSimulation train;
};

}  // namespace lostmotion::test
