// Times the paper's run (2-DOF-NL, E_CA = 1.0275, 1 Hz, 2 s from rest, 1 kHz, stand-in loss table) by both solvers.
// Prints one line a case: name, best time [ms], largest error of load speed and twist against the exact run, relative.
#include <cstdio>

#include "lostmotion/response.hpp"
#include "lostmotion/simulation.hpp"
#include "paper_run.hpp"

using namespace lostmotion;

namespace {

struct SamplesOnly {
    Sampler sampler;
    bool segment(const Segment<SwitchedDrive>& s) { return sampler.segment(s); }
    void switching(const Switching&) {}
};

struct Nothing {
    bool segment(const Segment<SwitchedDrive>&) { return true; }
    void switching(const Switching&) {}
    void step(const Regime&, const Memory&, const DenseStep&, bool) {}
};

// Follows a transient until no state changes by more than `tolerance` of its size over a period. Returns the periods.
template <class Solver>
int follow(Solver& solver, double period, double tolerance) {
    Nothing nothing;
    solver.begin(0.0, {}, {});
    std::array<double, n_states> size{};
    for (int k = 1; k <= 20000; ++k) {
        const State before = solver.state();
        for (int part = 1; part <= 8; ++part) {
            solver.advance((k - 1 + part / 8.0) * period, nothing);
            for (int n = 0; n < n_states; ++n) size[n] = std::max(size[n], std::fabs(solver.state()[n]));
        }
        double worst = 0.0;
        for (int n = 0; n < load_angle; ++n)
            if (size[n] > 0.0) worst = std::max(worst, std::fabs(solver.state()[n] - before[n]) / size[n]);
        if (worst <= tolerance) return k;
    }
    return 20000;
}

// 60 frequencies from 0.1 to 100 Hz at 8 amplitudes: shooting on all cores and on one, and following transients.
void response(const Drive& drive) {
    struct Pool : WorkspacePool {
        const Drive& drive;
        explicit Pool(const Drive& d) : drive(d) {}
        std::unique_ptr<Workspace> take() override { return std::make_unique<Workspace>(drive); }
        void give_back(std::unique_ptr<Workspace>) override {}
    };
    std::vector<ResponsePoint> points;
    for (const double a : {0.02, 0.035, 0.06, 0.1, 0.2, 0.4, 0.7, 1.0275})
        for (int k = 0; k < 60; ++k) {
            const double f = 0.1 * std::pow(1000.0, k / 59.0);
            points.push_back({Signals{sine(a, f), Signal{}}, 1.0 / f, {}});
        }
    Pool pool(drive);
    const auto going = [](std::size_t) { return true; };
    int missed = 0;
    const unsigned cores = std::max(1u, std::thread::hardware_concurrency());
    for (const unsigned threads : {cores, 1u}) {
        const double time = best_ms(3, [&] {
            missed = 0;
            for (const ResponseResult& r : respond_all(pool, points, {}, threads, going)) missed += !r.motion.converged;
        });
        std::printf("response, 480 points by shooting, %u thread%s, %d not found|%.6f|\n", threads,
                    threads > 1 ? "s" : "", missed, time);
    }
    // Every eighth point, times eight.
    const SwitchedDrive system(drive);
    const double exact = best_ms(1, [&] {
        for (std::size_t k = 0; k < points.size(); k += 8) {
            const ResponsePoint& p = points[k];
            ExactSolver<SwitchedDrive> solver(system, p.signals, p.period / 2048.0, drive.balanced_scale());
            follow(solver, p.period, 1e-10);
        }
    });
    std::printf("response, transients followed to 1e-10, exact solver, 1 thread|%.6f|\n", 8.0 * exact);
    const double adaptive = best_ms(1, [&] {
        for (std::size_t k = 0; k < points.size(); k += 8) {
            const ResponsePoint& p = points[k];
            AdaptiveSolver<SwitchedDrive> solver(system, p.signals, 1e-8, drive.rated_scale());
            follow(solver, p.period, 1e-6);  // its own noise hides anything finer
        }
    });
    std::printf("response, transients followed to 1e-6, adaptive solver at 1e-8, 1 thread|%.6f|\n", 8.0 * adaptive);
}

}  // namespace

int main() {
    const PaperRun paper;
    const Drive& drive = paper.drive;
    const Signals& signals = paper.signals;
    const std::size_t samples = paper.samples;
    RunOptions options = paper.options();
    Table exact(n_channels * samples), other(n_channels * samples);

    const double cold = best_ms(300, [&] { run_exact(drive, signals, {}, options, exact.data()); });
    std::printf("exact, new drive|%.6f|0\n", cold);

    const SwitchedDrive system(drive);
    ExactSolver<SwitchedDrive> solver(system, signals, 1e-3, drive.balanced_scale());
    const double warm = best_ms(300, [&] {
        SamplesOnly observer{Sampler(drive, 0.0, 1e-3, samples, other.data())};
        solver.begin(0.0, {}, {});
        solver.advance(2.0, observer);
    });
    std::printf("exact, same drive again|%.6f|%.3g\n", warm, paper.error(other, exact));

    options.energy = true;
    const double ledger = best_ms(300, [&] { run_exact(drive, signals, {}, options, other.data()); });
    std::printf("exact, new drive, with energy ledger|%.6f|%.3g\n", ledger, paper.error(other, exact));

    for (const double tolerance : {1e-6, 1e-8}) {
        const double time = best_ms(50, [&] { run_adaptive(drive, signals, {}, options, tolerance, other.data()); });
        std::printf("adaptive (Dormand-Prince 5(4)), rtol %g|%.6f|%.3g\n", tolerance, time, paper.error(other, exact));
    }

    Simulation simulation(drive, 1e-3);
    double t = 0.0;
    const double step = best_ms(20, [&] {
        for (int k = 0; k < 1000; ++k, t += 1e-3) {
            const double c = 1.0275 * std::sin(2.0 * pi * t);
            simulation.advance(1e-3, c, c, 0.0, 0.0);
        }
    });
    std::printf("step of 1 ms (Simulation)|%.6f|\n", step / 1000.0);

    response(drive);
}
