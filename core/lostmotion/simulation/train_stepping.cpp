#include "train_stepping.hpp"

#include <algorithm>
#include <cmath>

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

std::optional<LoadShaft> TrainSimulation::load_shaft(int shaft) const {
    const model::Assembly& a = assembly();
    const model::Layout& layout = a.layout();
    const model::ShaftPlace& place = a.places().shafts[static_cast<std::size_t>(shaft)];
    if (place.load == model::nowhere) return {};
    for (const model::MassMatrix& m : a.train().mass_matrices)
        if (std::ranges::find(m.shafts, shaft) != m.shafts.end()) return {};
    int angle = place.angle;
    for (std::size_t part = 0; angle == model::nowhere && part < a.places().last_shaft.size(); ++part)
        if (a.places().last_shaft[part] == shaft) angle = layout.coupled + static_cast<int>(part);
    if (angle == model::nowhere) return {};
    if (angle >= layout.coupled) angle += with([&]<class S>(const S&) { return int{S::D::coupled}; }) - layout.coupled;
    return LoadShaft{place.speed, angle, place.load, a.train().shafts[static_cast<std::size_t>(shaft)].inertia};
}

auto TrainSimulation::answer(double interval, std::span<const double> begin, std::span<const double> end,
                             const LoadShaft& shaft, LoadAnswer& out) -> Status {
    return with([&]<class D>(TrainSimulationIn<D>& s) {
        InputsOf<D> first{}, last{};
        std::copy(begin.begin(), begin.end(), first.begin());
        std::copy(end.begin(), end.end(), last.begin());
        const double before = s.snapshot().x[shaft.speed_state];
        const Status status = s.respond(interval, first, last, shaft.load);
        if (status != Status::done) return status;
        const double after = s.snapshot().x[shaft.speed_state];
        out.acceleration = (after - before) / interval;
        out.rounding = 0x1p-52 * std::fmax(std::fabs(before), std::fabs(after)) / interval;
        out.compliance = std::fmax(0.0, -s.response()[shaft.speed_state] / interval);
        return status;
    });
}

bool TrainSimulation::restore(const Snapshot& from) {
    return with([&]<class S>(S& s) {
        const auto* snapshot = std::get_if<typename S::Snapshot>(&from);
        if (snapshot != nullptr) s.restore(*snapshot);
        return snapshot != nullptr;
    });
}

std::string TrainSimulation::reset(const TrainStart& start) {
    const auto [x, memory] = run_.in_layout(start);
    if (std::string error = check_start(assembly(), x); !error.empty()) return error;
    with([&, &states = x, &kept = memory]<class D>(TrainSimulationIn<D>& s) {
        const auto begin = model::packed_start<D>(assembly().layout(), states, kept);
        typename TrainSimulationIn<D>::Snapshot to;
        to.x = begin.x;
        to.memory = begin.memory;
        s.restore(to);
    });
    return "";
}

}  // namespace lostmotion
