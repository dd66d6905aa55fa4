// Times the paper's run (2-DOF-NL, E_CA = 1.0275, 1 Hz, 2 s from rest, 1 kHz, stand-in loss table) by both solvers.
// Prints one line a case: name, best time [ms], largest error of load speed and twist against the exact run, relative.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <vector>

#include "../core/tests/support.hpp"
#include "lostmotion/simulation.hpp"

using namespace lostmotion;

namespace {

LossMap stand_in_map() {
    const std::vector<double> speeds{0.0, 0.01, 0.1, 0.3, 0.6, 1.0, 1.5};
    const std::vector<double> loads{-1.5, -1.0, -0.6, -0.3, -0.1, 0.0, 0.1, 0.3, 0.6, 1.0, 1.5};
    std::vector<double> values;
    for (const double mu : loads)
        for (const double v : speeds) {
            const double load = std::fabs(mu);
            const double m =
                v == 0.0 ? 0.020 + 0.06 * load : 0.018 + 0.032 * std::pow(v, 0.7) + (0.05 + 0.02 * v) * load;
            values.push_back(std::round(m * 1e6) * 1e-6);  // as printed in the scenario file
        }
    return LossMap(speeds, loads, values);
}

constexpr std::size_t samples = 2001;
using Table = std::vector<double>;

template <class F>
double best_ms(int repeats, F&& work) {
    double best = 1e9;
    for (int k = 0; k < repeats; ++k) {
        const auto begin = std::chrono::steady_clock::now();
        work();
        best =
            std::min(best, std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - begin).count());
    }
    return best;
}

double error(const Table& a, const Table& exact) {
    double worst = 0.0;
    for (const Channel c : {ch_load_speed, ch_twist}) {
        double size = 0.0, gap = 0.0;
        for (std::size_t k = 0; k < samples; ++k) {
            size = std::max(size, std::fabs(exact[c * samples + k]));
            gap = std::max(gap, std::fabs(a[c * samples + k] - exact[c * samples + k]));
        }
        worst = std::max(worst, gap / size);
    }
    return worst;
}

struct SamplesOnly {
    Sampler sampler;
    bool segment(const Segment<SwitchedDrive>& s, const std::vector<InputBasis>& basis) {
        return sampler.segment(s, basis);
    }
    void switching(const Switching&) {}
};

}  // namespace

int main() {
    const Drive drive = paper_drive(stand_in_map());
    const Signals signals{sine(1.0275, 1.0), Signal{}};
    RunOptions options;
    options.duration = 2.0;
    options.sample_interval = 1e-3;
    options.samples = samples;
    options.energy = false;
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
    std::printf("exact, same drive again|%.6f|%.3g\n", warm, error(other, exact));

    options.energy = true;
    const double ledger = best_ms(300, [&] { run_exact(drive, signals, {}, options, other.data()); });
    std::printf("exact, new drive, with energy ledger|%.6f|%.3g\n", ledger, error(other, exact));

    for (const double tolerance : {1e-6, 1e-8}) {
        const double time = best_ms(50, [&] { run_adaptive(drive, signals, {}, options, tolerance, other.data()); });
        std::printf("adaptive (Dormand-Prince 5(4)), rtol %g|%.6f|%.3g\n", tolerance, time, error(other, exact));
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
}
