#include "train_run.hpp"

namespace lostmotion {

std::string check_start(const model::Assembly& a, std::span<const double> start) {
    for (std::size_t m = 0; m < a.places().motors.size(); ++m)
        if (const model::MotorPlace& p = a.places().motors[m];
            p.current != model::nowhere && p.winding == model::nowhere)
            return "the current of '" + a.train().motors[m].name +
                   "' depends on products of speed and angle, which only runs of the adaptive solver have; leave "
                   "supply_voltage out for an ideal current";
    std::vector<double> speeds;
    for (const model::ShaftPlace& s : a.places().shafts)
        speeds.push_back(start.empty() ? 0.0 : start[static_cast<std::size_t>(s.speed)]);
    return model::check_start(a.train(), speeds);
}

std::string check_run(const model::Assembly& a, std::span<const double> start, const Control& control) {
    std::string wrong = check_start(a, start);
    return wrong.empty() ? check_control(a, control) : wrong;
}

std::pair<std::vector<double>, std::vector<double>> in_layout(const model::Assembly& a, const TrainStart& start) {
    std::vector<double> x, memory(static_cast<std::size_t>(a.layout().memory));
    for (const std::string& name : model::state_names(a)) x.push_back(value_of(start.states, name));
    const std::vector<model::Gear>& gears = a.train().gears;
    for (std::size_t g = 0; g < gears.size(); ++g) {
        const model::GearPlace& p = a.places().gears[g];
        if (p.hysteresis == model::nowhere) continue;
        memory[static_cast<std::size_t>(p.hysteresis)] = value_of(start.hysteresis_capacities, gears[g].name);
        if (const int locked = a.places().contacts[static_cast<std::size_t>(p.contact)].locked;
            locked != model::nowhere)
            memory[static_cast<std::size_t>(locked)] = a.stiffness_factor(static_cast<int>(g), a.meshes_at(x)) *
                                                       gears[g].law.curve.torque(x[static_cast<std::size_t>(p.twist)]);
    }
    return {x, memory};
}

TrainRun::TrainRun(const model::Train& train) : fault_(model::check(train)) {
    if (!fault_.empty()) return;
    assembly_ = std::make_unique<model::Assembly>(train);
    channels_ = std::make_unique<const std::vector<TrainChannel>>(train_channels(*assembly_));
    kernel_ = &Kernel::of(*assembly_);
    // The adaptive solver takes smooth laws as they are, by further inputs.
    const model::Layout n = AdaptiveKernel::all().empty() ? assembly_->layout() : model::Places(train, true).layout;
    const KernelSizes& widest = Kernel::all().back()->sizes();
    if (const std::string excess = widest.excess(train, n); !excess.empty())
        fault_.reason = "the train has " + excess + "; leave some out";
    else if (!widest.hold(train, n))
        fault_.reason = "this core was built for a motor, a gear and a load alone; the train has more";
}

TrainReport TrainRun::run(const std::vector<Signal>& inputs, const TrainStart& start, const TrainOptions& options,
                          double* out, std::unique_ptr<Workspace>& workspace) const {
    const auto [x, memory] = in_layout(start);
    if (options.tolerance > 0.0) return run(inputs, x, memory, options, out);
    return run_exactly(inputs, x, memory, options, out, workspace);
}

TrainReport TrainRun::run(const std::vector<Signal>& inputs, const TrainStart& start, const TrainOptions& options,
                          double* out) const {
    std::unique_ptr<Workspace> own;
    return run(inputs, start, options, out, own);
}

TrainReport TrainRun::run(const std::vector<Signal>& inputs, std::span<const double> start,
                          std::span<const double> memory, const TrainOptions& options, double* out) const {
    if (!(options.tolerance > 0.0)) return run_exactly(inputs, start, memory, options, out);
    if (AdaptiveKernel::all().empty()) {
        TrainReport report;
        report.message = "this core was built without the adaptive solver";
        return report;
    }
    const model::Assembly smooth(assembly_->train(), true);
    return AdaptiveKernel::of(smooth).run({smooth, *channels_}, {inputs, start, memory}, options, out);
}

}  // namespace lostmotion
