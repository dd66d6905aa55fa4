// Times the paper's run (2-DOF-NL, E_CA = 1.0275, 1 Hz, 2 s from rest, 1 kHz) by both solvers. The exact one records
// what the peers do, load speed and twist, and once all channels. Prints one line a case: loss map, name, best time
// [ms], largest error of load speed and twist against the exact run, relative. With a number: makes the run that often
// and prints nothing, for counting instructions.
#include <cstdio>
#include <cstdlib>

#include "lostmotion/simulation/sampler.hpp"
#include "lostmotion/simulation/stepping.hpp"
#include "paper_run.hpp"

using namespace lostmotion;

namespace {

constexpr std::array<int, 2> compared{ch_load_speed, ch_twist};

// The same drive again and again.
class Repeated {
 public:
    Repeated(const PaperRun& paper, std::span<const int> channels)
        : paper_(paper),
          channels_(channels),
          system_(paper.drive),
          solver_(system_, paper.signals, 1e-3, paper.drive.balanced_scale()),
          table(n_channels * paper.samples) {}
    void run() {
        Sampler sampler(paper_.drive, 0.0, 1e-3, paper_.samples, table.data(), channels_);
        solver_.begin(0.0, {}, {});
        solver_.advance(2.0, sampler);
    }

 private:
    const PaperRun& paper_;
    std::span<const int> channels_;
    SwitchedDrive system_;
    ExactSolver<SwitchedDrive> solver_;

 public:
    Table table;
};

void compare(const char* map, const PaperRun& paper) {
    const Drive& drive = paper.drive;
    RunOptions options = paper.options();
    Table exact(n_channels * paper.samples), other(n_channels * paper.samples);
    run_exact(drive, paper.signals, {}, options, exact.data());
    Repeated repeated(paper, compared), whole(paper, all_channels);
    const double warm = best_ms(600, [&] { repeated.run(); }), all = best_ms(600, [&] { whole.run(); });
    std::printf("%s|exact, same drive again|%.6f|0\n", map, warm);
    std::printf("%s|exact, same drive again, all %d channels|%.6f|%.3g\n", map, static_cast<int>(n_channels), all,
                paper.error(whole.table, exact));

    options.channels = compared;
    for (const bool energy : {false, true}) {
        options.energy = energy;
        const double cold = best_ms(300, [&] { run_exact(drive, paper.signals, {}, options, other.data()); });
        std::printf("%s|exact, new drive%s|%.6f|0\n", map, energy ? ", with energy ledger" : "", cold);
    }

    options.energy = false;
    for (const double tolerance : {1e-6, 1e-8}) {
        const double time =
            best_ms(50, [&] { run_adaptive(drive, paper.signals, {}, options, tolerance, other.data()); });
        std::printf("%s|adaptive (Dormand-Prince 5(4)), rtol %g|%.6f|%.3g\n", map, tolerance, time,
                    paper.error(other, exact));
    }
}

}  // namespace

int main(int argc, char** argv) {
    if (argc > 1) {
        const PaperRun paper;
        Repeated repeated(paper, compared);
        for (int k = std::atoi(argv[1]); k > 0; --k) repeated.run();
        return 0;
    }
    for (const auto& [map, paper] : PaperRun::both()) compare(map, paper);

    const PaperRun paper;
    Simulation simulation(paper.drive, 1e-3);
    double t = 0.0;
    const double step = best_ms(20, [&] {
        for (int k = 0; k < 1000; ++k, t += 1e-3) {
            const double c = 1.0275 * std::sin(2.0 * pi * t);
            simulation.advance(1e-3, c, c, 0.0, 0.0);
        }
    });
    std::printf("table|step of 1 ms (Simulation)|%.6f|\n", step / 1000.0);
}
