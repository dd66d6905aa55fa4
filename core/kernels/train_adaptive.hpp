// Runs of a train in one kernel by the adaptive solver. Only core/kernels takes it.
#pragma once

#include "lostmotion/solver/adaptive_solver.hpp"
#include "train_solving.hpp"

namespace lostmotion {

template <class D>
class AdaptiveTrainObserver final : public Observer<model::TrainSystem<D>> {
 public:
    using System = model::TrainSystem<D>;

    AdaptiveTrainObserver(TrainRecorder<D>& recorder, AdaptiveSolver<System>& solver)
        : recorder_(recorder), solver_(solver) {}
    void step(const typename System::Regime& r, const typename D::Memory& m, const DenseStepOf<D>& dense,
              bool last) override {
        recorder_.sample(solver_, r, m, dense, last);
    }
    bool wants_switching() const override { return recorder_.wants_switching(); }
    void switching(const SwitchingOf<System>& s) override { recorder_.switching(s); }

 private:
    TrainRecorder<D>& recorder_;
    AdaptiveSolver<System>& solver_;
};

template <class D>
class AdaptiveKernelIn final : public AdaptiveKernel {
 public:
    explicit AdaptiveKernelIn(const char* name) : AdaptiveKernel(name, sizes_of<D>) {}
    TrainReport run(const TrainModel& model, const RunStart& start, const TrainOptions& options,
                    double* out) const override;
};

// The driver of a stepper is on before a run begins.
template <class D>
void establish_currents(const model::Assembly& a, PackedRun<D>& run) {
    for (std::size_t m = 0; m < a.places().motors.size(); ++m) {
        const model::MotorPlace& p = a.places().motors[m];
        if (p.winding == model::nowhere) continue;
        const auto first = [&](int input) {
            const Signal& signal = run.signals[static_cast<std::size_t>(input)];
            double sum = signal.breakpoints[0].value;
            for (const Sine& sine : signal.sines) sum += sine.at(0.0);
            return sum;
        };
        const auto i = StepperWinding{a.train().motors[m].law}.wanted(first(p.command),
                                                                      p.level == model::nowhere ? 1.0 : first(p.level));
        for (int k = 0; k < 2; ++k) run.start.x[p.current + k] = i[static_cast<std::size_t>(k)];
    }
}

template <class D>
TrainReport AdaptiveKernelIn<D>::run(const TrainModel& model, const RunStart& start, const TrainOptions& options,
                                     double* out) const {
    using System = model::TrainSystem<D>;
    TrainReport report;
    report.message = check_run(model.assembly, start.start, options.control);
    if (!report.message.empty()) return report;
    PackedRun<D> c(model.assembly, start, options);
    establish_currents(model.assembly, c);
    TrainRecorder<D> recorder(model, options, out, report, nullptr);
    const System system(model.assembly);
    AdaptiveSolver<System> solver(system, c.signals, options.tolerance, system.rated_scale());
    AdaptiveTrainObserver<D> observer(recorder, solver);
    report.status = run_recorded(solver, c.start, options, observer, c.in_train());
    report.steps = solver.steps();
    c.end(report, system, solver);
    return report;
}

}  // namespace lostmotion
