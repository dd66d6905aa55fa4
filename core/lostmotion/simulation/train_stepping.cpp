#include "train_stepping.hpp"

namespace lostmotion {

TrainSimulation::TrainSimulation(const model::Train& train, double step, const Control& control,
                                 const InputSines& sines)
    : run_(train) {
    run_.in_kernel([&]<class D>(const typename TrainReader<D>::Model&) {
        in_ = std::make_unique<TrainSimulationIn<D>>(run_, step, control, sines);
    });
}

auto TrainSimulation::advance(double interval, std::span<const double> begin, std::span<const double> end) -> Status {
    return with([&]<class D>(TrainSimulationIn<D>& s) {
        InputsOf<D> first{}, last{};
        std::copy(begin.begin(), begin.end(), first.begin());
        std::copy(end.begin(), end.end(), last.begin());
        return s.advance(interval, first, last);
    });
}

std::string TrainSimulation::reset(const TrainStart& start) {
    const auto [x, memory] = run_.in_layout(start);
    if (std::string error = check_start(assembly(), x); !error.empty()) return error;
    with([&, &x = x, &memory = memory]<class D>(TrainSimulationIn<D>& s) {
        const auto begin = model::packed_start<D>(assembly().layout(), x, memory);
        typename TrainSimulationIn<D>::Snapshot to;
        to.x = begin.x;
        to.memory = begin.memory;
        s.restore(to);
    });
    return "";
}

}  // namespace lostmotion
