#include "train_run.hpp"

namespace lostmotion {

std::string check_start(const model::Assembly& a, std::span<const double> start) {
    std::vector<double> speeds;
    for (const model::ShaftPlace& s : a.places().shafts)
        speeds.push_back(start.empty() ? 0.0 : start[static_cast<std::size_t>(s.speed)]);
    return model::check_start(a.train(), speeds);
}

std::string check_run(const model::Assembly& a, std::span<const double> start, const Control& control) {
    std::string wrong = check_start(a, start);
    return wrong.empty() ? check_control(a, control) : wrong;
}

TrainRun::TrainRun(const model::Train& train) : fault_(model::check(train)) {
    if (!fault_.empty()) return;
    assembly_ = std::make_unique<model::Assembly>(train);
    channels_ = std::make_unique<const std::vector<TrainChannel>>(train_channels(*assembly_));
    const model::Layout n = model::Places(train, true).layout;
    fault_.reason = too_large(train, n);
    if (fault_.empty() && !model::fits<model::Widest>(train, n))
        fault_.reason = "this core was built for a motor, a gear and a load alone; the train has more";
}

const char* TrainRun::kernel() const {
    const model::Train& train = assembly_->train();
    const model::Layout& n = assembly_->layout();
    return model::fits<model::Least>(train, n)    ? "drive"
           : model::fits<model::Narrow>(train, n) ? "narrow"
           : model::fits<model::Middle>(train, n) ? "middle"
                                                  : "wide";
}

}  // namespace lostmotion
