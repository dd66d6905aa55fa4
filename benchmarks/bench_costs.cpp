// What a run costs: over simulated time, number of switchings and size of the loss map; a frequency response; and the
// floating-point peak of this machine. Prints one line a case: table, then its cells.
#include <cstdio>
#include <stdexcept>
#include <thread>

#include "lostmotion/analysis/respond.hpp"
#include "lostmotion/solver/adaptive_solver.hpp"
#include "paper_run.hpp"

using namespace lostmotion;

namespace {

struct Cost {
    double again = 0.0, first = 0.0;  // [ms], the same drive again and a new one
    std::size_t switchings = 0;
};

// Without samples, so that only the motion itself is timed.
Cost cost_of(const model::Train& train, const std::vector<Signal>& signals, double duration, int repeats) {
    TrainOptions options;
    options.duration = duration;
    options.energy = false;
    options.max_switchings = 0;
    const TrainRun run(train);
    if (!run.error().empty()) throw std::runtime_error(run.error());
    Cost cost;
    cost.first = best_ms(repeats, [&] { TrainRun(train).run(signals, {}, {}, options, nullptr); });
    std::unique_ptr<Workspace> workspace;
    cost.again = best_ms(repeats, [&] {
        cost.switchings = run.run_exactly(signals, {}, {}, options, nullptr, workspace).switching_count;
    });
    return cost;
}

void costs() {
    const PaperRun paper;
    for (const double duration : {1.0, 10.0, 100.0, 1000.0}) {
        const Cost c = cost_of(paper.train, paper.signals, duration, duration > 10.0 ? 3 : 100);
        std::printf("time|%g|%zu|%.4f|%.4f\n", duration, c.switchings, c.again, c.again / duration);
    }
    for (const double amplitude : {0.025, 0.1, 0.3, 1.0275})
        for (const double frequency : {0.2, 1.0, 5.0, 25.0}) {
            const Cost c = cost_of(paper.train, {sine(amplitude, frequency), Signal{}}, 10.0, 20);
            std::printf("events|%g|%g|%zu|%.4f|%.3f\n", amplitude, frequency, c.switchings, c.again,
                        c.switchings > 0 ? 1e3 * c.again / static_cast<double>(c.switchings) : 0.0);
        }
    for (const int fine : {1, 2, 4, 8, 12}) {
        const PaperRun finer(stand_in_map(fine));
        const Cost c = cost_of(finer.train, finer.signals, 2.0, 50);
        std::printf("map|%d x %d|%zu|%.4f|%.4f\n", 6 * fine + 1, 10 * fine + 1, c.switchings, c.again, c.first);
    }
}

// Follows a transient until no state changes by more than `tolerance` of its size over a period. Returns the periods.
template <class Solver>
int follow(Solver& solver, double period, double tolerance) {
    using D = typename Solver::D;
    Observer<typename Solver::System> nothing;
    solver.begin(0.0, {}, {});
    StateOf<D> size{};
    for (int k = 1; k <= 20000; ++k) {
        const StateOf<D> before = solver.state();
        for (int part = 1; part <= 8; ++part) {
            solver.advance((k - 1 + part / 8.0) * period, nothing);
            for (int n = 0; n < D::coupled; ++n) size[n] = std::max(size[n], std::fabs(solver.state()[n]));
        }
        double worst = 0.0;
        for (int n = 0; n < D::coupled; ++n)
            if (size[n] > 0.0) worst = std::max(worst, std::fabs(solver.state()[n] - before[n]) / size[n]);
        if (worst <= tolerance) return k;
    }
    return 20000;
}

// 60 frequencies from 0.1 to 100 Hz at 8 amplitudes: shooting on all cores and on one, and following transients.
void response(const TrainRun& train) {
    std::vector<ResponseRequest> points;
    for (const double a : {0.02, 0.035, 0.06, 0.1, 0.2, 0.4, 0.7, 1.0275})
        for (int k = 0; k < 60; ++k) {
            const double f = 0.1 * std::pow(1000.0, k / 59.0);
            points.push_back({{sine(a, f), Signal{}}, 1.0 / f, {}});
        }
    const auto going = [](std::size_t) { return true; };
    int missed = 0;
    const unsigned cores = std::max(1u, std::thread::hardware_concurrency());
    for (const unsigned threads : {cores, 1u}) {
        const double time = best_ms(3, [&] {
            const std::vector<double> found = respond_train(train, points, {}, threads, going).converged;
            missed = static_cast<int>(std::count(found.begin(), found.end(), 0.0));
        });
        std::printf("response|480 points by shooting, %u thread%s, %d not found|%.6f\n", threads,
                    threads > 1 ? "s" : "", missed, time);
    }
    // Every eighth point, times eight.
    in_least(train, [&]<class D>(const TrainModel& model) {
        using System = model::TrainSystem<D>;
        const System system(model.assembly);
        const double exact = best_ms(1, [&] {
            for (std::size_t k = 0; k < points.size(); k += 8) {
                const ResponseRequest& p = points[k];
                ExactSolver<System> solver(system, model::packed_signals<D>(p.inputs), p.period / 2048.0,
                                           system.balanced_scale());
                follow(solver, p.period, 1e-10);
            }
        });
        std::printf("response|transients followed to 1e-10, exact solver, 1 thread|%.6f\n", 8.0 * exact);
        const double adaptive = best_ms(1, [&] {
            for (std::size_t k = 0; k < points.size(); k += 8) {
                const ResponseRequest& p = points[k];
                AdaptiveSolver<System> solver(system, model::packed_signals<D>(p.inputs), 1e-8, system.rated_scale());
                follow(solver, p.period, 1e-6);  // its own noise hides anything finer
            }
        });
        std::printf("response|transients followed to 1e-6, adaptive solver at 1e-8, 1 thread|%.6f\n", 8.0 * adaptive);
    });
}

// Multiplications and additions in equal numbers, in chains side by side; nothing leaves the registers. [Gflop/s]
constexpr int abreast = 6, rounds = 1000000;

[[gnu::noinline]] void multiply_and_add() {
    const Vec factor = Vec{} + 1.0000000001, summand = Vec{} + 1e-9;
    Vec product[abreast], sum[abreast];
#pragma GCC unroll 6
    for (int c = 0; c < abreast; ++c) product[c] = sum[c] = factor;
    for (int k = 0; k < rounds; ++k) {
#pragma GCC unroll 6
        for (int c = 0; c < abreast; ++c) {
            product[c] *= factor;
            sum[c] += summand;
            asm volatile("" : "+x"(product[c]), "+x"(sum[c]));  // so that no round is left out
        }
    }
}

double peak() { return 2.0 * abreast * vec_width * rounds / (1e6 * best_ms(10, multiply_and_add)); }

}  // namespace

int main(int argc, char**) {
    if (argc == 1) {
        costs();
        response(TrainRun(PaperRun().train));
    }
    std::printf("peak|%.3f\n", peak());
}
