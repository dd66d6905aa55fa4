// Times the paper's run (2-DOF-NL, E_CA = 1.0275, 1 Hz, 2 s from rest, 1 kHz) by both solvers. The exact one records
// what the peers do, load speed and twist, and once all channels. Prints one line a case: loss map, name, best time
// [ms], largest error of load speed and twist against the exact run, relative. With a number: makes the run that often
// and prints nothing, for counting instructions.
#include <cstdio>
#include <cstdlib>
#include <numeric>

#include "paper_run.hpp"

using namespace lostmotion;

namespace {

// The same drive again and again.
template <class D>
class Repeated {
 public:
    using System = model::TrainSystem<D>;

    Repeated(const TrainModel& model, const PaperRun& paper, std::span<const int> channels)
        : model_(model),
          paper_(paper),
          channels_(channels),
          system_(model.assembly),
          solver_(system_, model::packed_signals<D>(paper.signals), 1e-3, system_.balanced_scale()),
          table(channels.size() * paper.samples) {}
    void run() {
        SamplerOf<System, TrainReader<D>> sampler(model_, {1e-3, paper_.samples}, table.data(), channels_);
        solver_.begin(0.0, {}, {});
        solver_.advance(2.0, sampler);
    }

 private:
    const TrainModel& model_;
    const PaperRun& paper_;
    std::span<const int> channels_;
    System system_;
    ExactSolver<System> solver_;

 public:
    Table table;
};

void compare(const char* map, const PaperRun& paper) {
    const TrainRun train(paper.train);
    TrainOptions options = paper.options();
    const std::size_t channels = paper.channels.size();
    Table exact(channels * paper.samples), other(channels * paper.samples);
    train.run(paper.signals, {}, {}, options, exact.data());
    in_least(train, [&]<class D>(const TrainModel& model) {
        std::vector<int> numbers(channels);
        std::iota(numbers.begin(), numbers.end(), 0);
        Repeated<D> repeated(model, paper, paper.compared), whole(model, paper, numbers);
        const double warm = best_ms(600, [&] { repeated.run(); }), all = best_ms(600, [&] { whole.run(); });
        std::printf("%s|exact, same drive again|%.6f|0\n", map, warm);
        std::printf("%s|exact, same drive again, all %zu channels|%.6f|%.3g\n", map, channels, all,
                    paper.error(whole.table, exact));
    });

    options.channels = paper.compared;
    for (const bool energy : {false, true}) {
        options.energy = energy;
        const double cold =
            best_ms(300, [&] { TrainRun(paper.train).run(paper.signals, {}, {}, options, other.data()); });
        std::printf("%s|exact, new drive%s|%.6f|0\n", map, energy ? ", with energy ledger" : "", cold);
    }

    options.energy = false;
    options.channels.reset();
    for (const double tolerance : {1e-6, 1e-8}) {
        options.tolerance = tolerance;
        const double time = best_ms(50, [&] { train.run(paper.signals, {}, {}, options, other.data()); });
        std::printf("%s|adaptive (Dormand-Prince 5(4)), rtol %g|%.6f|%.3g\n", map, tolerance, time,
                    paper.error(other, exact));
    }
}

}  // namespace

int main(int argc, char** argv) {
    if (argc > 1) {
        const PaperRun paper;
        const TrainRun train(paper.train);
        in_least(train, [&]<class D>(const TrainModel& model) {
            Repeated<D> repeated(model, paper, paper.compared);
            for (int k = std::atoi(argv[1]); k > 0; --k) repeated.run();
        });
        return 0;
    }
    for (const auto& [map, paper] : PaperRun::both()) compare(map, paper);

    const PaperRun paper;
    test::Simulation simulation(paper.drive, 1e-3);
    double t = 0.0;
    const double step = best_ms(20, [&] {
        for (int k = 0; k < 1000; ++k, t += 1e-3) {
            const double c = 1.0275 * std::sin(2.0 * pi * t);
            simulation.advance(1e-3, c, c, 0.0, 0.0);
        }
    });
    std::printf("table|step of 1 ms (Simulation)|%.6f|\n", step / 1000.0);
}
