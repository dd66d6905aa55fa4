// Times the paper's drive under a servo cascade: current and speed loop every 125 us, position every 1 ms, encoder on
// the motor, voltages in steps. Prints one line a case: name, ticks, switchings, event checks, best time [ms] of 1 s,
// the same of the drive alone under the same voltages on average. With a number: makes the run that often and prints
// nothing.
#include <cstdio>
#include <cstdlib>

#include "cascade.hpp"
#include "lostmotion/simulation/train_run.hpp"

using namespace lostmotion;

int main(int argc, char** argv) {
    const PaperRun paper;
    TrainOptions options;
    options.duration = 1.0;
    options.sample_interval = 1e-3;
    options.samples = 0;
    options.energy = false;
    options.max_switchings = 0;
    const TrainRun train(paper.train);
    const std::vector<Signal> none(2);
    std::unique_ptr<Workspace> workspace;
    const auto run = [&] { return train.run_exactly(none, {}, {}, options, nullptr, workspace); };
    if (argc > 1) {
        options.control = cascade(paper.drive, 2.0 * std::numbers::pi / 8192.0, 0.2);
        for (int k = std::atoi(argv[1]); k > 0; --k) run();
        return 0;
    }
    struct Case {
        const char* name;
        double resolution, amplitude;
    };
    const double lines = 2.0 * std::numbers::pi / 8192.0;
    for (const Case& c : {Case{"standing still", 0.0, 0.0}, Case{"sine of 0.2 rad", 0.0, 0.2},
                          Case{"sine of 0.2 rad, encoder of 2048 lines", lines, 0.2}}) {
        options.control = cascade(paper.drive, c.resolution, c.amplitude);
        const TrainReport report = run();
        if (report.status != Status::done) return 1;
        const double ms = best_ms(50, run);
        std::printf("%s|8000|%zu|%ld|%.6f\n", c.name, report.switching_count, report.steps, ms);
    }
    return 0;
}
