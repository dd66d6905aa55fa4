// What runs of trains cost, without samples, in the smallest kernel that holds each; first the paper's drive,
// which the others are compared with. Prints one line a case: name, states, switchings, event checks, time of the same
// train again and of a new one [ms]. With an argument: of chains, `bench_trains size`. With the number of a train and
// that of runs: makes them and prints nothing.
#include <cstdio>
#include <cstdlib>

#include "train_runs.hpp"

using namespace lostmotion;

namespace {

template <class System>
struct Run {
    const System& system;
    const SignalsOf<typename System::Dims>& signals;
    StateOf<typename System::Dims> start, scale;
    double duration;
    std::size_t switchings = 0;
    long event_checks = 0;

    void operator()(RegimeCache<System>& cache) {
        ExactSolver<System> solver(system, signals, 1e-3, scale, &cache);
        Observer<System> nothing;
        Status status = solver.begin(0.0, start, {});
        if (status == Status::done) status = solver.advance(duration, nothing);
        if (status != Status::done) {
            std::fprintf(stderr, "the run ends at %g s, status %d\n", solver.time(), static_cast<int>(status));
            std::exit(1);
        }
        switchings = solver.switchings();
        event_checks = solver.event_checks();
    }
};

template <class System>
void time_run(const char* name, int states, Run<System> run, int repeats = 100) {
    const double first = best_ms(repeats, [&] {
        const System system(run.system.assembly());  // which keeps regimes, too
        RegimeCache<System> cache(system);
        Run<System>{system, run.signals, run.start, run.scale, run.duration}(cache);
    });
    RegimeCache<System> cache(run.system);
    const double again = best_ms(4 * repeats, [&] { run(cache); });
    std::printf("%s|%d|%zu|%ld|%.6f|%.6f\n", name, states, run.switchings, run.event_checks, again, first);
}

template <class D>
Run<model::TrainSystem<D>> run_of(const TrainIn<D>& in, const TimedTrain& t) {
    return {in.system, in.signals, in.start, in.system.balanced_scale(), t.duration};
}

}  // namespace

int main(int argc, char** argv) {
    if (argc == 2) {  // sizes: chains of masses
        for (const TimedTrain& t : chains())
            in_kernel(t, [&](const auto& in) {
                const int repeats = t.train.shafts.size() > 16 ? 5 : 40;
                time_run(t.name.c_str(), in.assembly.layout().coupled, run_of(in, t), repeats);
                std::fflush(stdout);
            });
        return 0;
    }
    const std::vector<TimedTrain> trains = timed_trains();
    if (argc > 2) {
        const TimedTrain& t = trains.at(static_cast<std::size_t>(std::atoi(argv[1])));
        in_kernel(t, [&]<class D>(const TrainIn<D>& in) {
            auto run = run_of(in, t);
            RegimeCache<model::TrainSystem<D>> cache(in.system);
            for (int k = std::atoi(argv[2]); k > 0; --k) run(cache);
        });
        return 0;
    }
    const auto time_train = [](const TimedTrain& t, const std::string& name, const auto& in) {
        time_run(name.c_str(), in.assembly.layout().coupled, run_of(in, t));
    };
    for (const TimedTrain& t : trains) in_kernel(t, [&](const auto& in) { time_train(t, t.name, in); });
    // What the width of a kernel costs, apart from how stiff a train is.
    time_train(trains[0], "the same in the kernel of 8 states", TrainIn<model::Middle>(trains[0]));
}
