// The run that all solvers are timed on: 2-DOF-NL, E_CA = 1.0275, 1 Hz, 2 s from rest, 1 kHz.
#pragma once

#include <algorithm>
#include <chrono>
#include <cmath>
#include <vector>

#include "../core/tests/drive_runs.hpp"
#include "../core/tests/least_kernel.hpp"

namespace lostmotion {

// Calls use<D>(model) in the kernel of drives.
template <class Use>
void in_least(const TrainRun& train, Use&& use) {
    use.template operator()<model::Least>(train.model());
}

// fine: into how many each interval of speed and of load is divided.
inline LossMap stand_in_map(int fine = 1) {
    const auto divided = [fine](const std::vector<double>& edges) {
        std::vector<double> out;
        for (std::size_t k = 0; k + 1 < edges.size(); ++k)
            for (int part = 0; part < fine; ++part) out.push_back(edges[k] + (edges[k + 1] - edges[k]) * part / fine);
        out.push_back(edges.back());
        return out;
    };
    const std::vector<double> speeds = divided({0.0, 0.01, 0.1, 0.3, 0.6, 1.0, 1.5});
    const std::vector<double> loads = divided({-1.5, -1.0, -0.6, -0.3, -0.1, 0.0, 0.1, 0.3, 0.6, 1.0, 1.5});
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

// Largest difference, relative to the largest of the exact values.
inline double relative_gap(const double* a, const double* exact, std::size_t samples) {
    double size = 0.0, gap = 0.0;
    for (std::size_t k = 0; k < samples; ++k) {
        size = std::max(size, std::fabs(exact[k]));
        gap = std::max(gap, std::fabs(a[k] - exact[k]));
    }
    return gap / size;
}

struct PaperRun {
    explicit PaperRun(const LossMap& map = stand_in_map()) : drive(test::paper_drive(map)) {}

    test::Drive drive;
    model::Train train = test::train_of(drive);
    std::vector<TrainChannel> channels = train_channels(model::Assembly(train));
    std::vector<int> compared{number(test::load_speed), number(test::twist)};
    std::vector<Signal> signals{sine(1.0275, 1.0), Signal{}};
    std::size_t samples = 2001;

    TrainOptions options() const {
        TrainOptions o;
        o.duration = 2.0;
        o.sample_interval = 1e-3;
        o.samples = samples;
        o.energy = false;
        return o;
    }
    // Both loss maps, by name: the table of the scenario file and the plane of the reference end states.
    static std::vector<std::pair<const char*, PaperRun>> both() {
        return {{"table", PaperRun()}, {"plane", PaperRun(plane_map(0.02, 0.04, 0.06))}};
    }
    int number(test::Quantity q) const { return static_cast<int>(test::channel_number(channels, q)); }
    // Largest error of load speed and twist, relative to the largest of each.
    double error(const Table& a, const Table& exact) const {
        double worst = 0.0;
        for (const int c : compared)
            worst = std::max(worst, relative_gap(&a[c * samples], &exact[c * samples], samples));
        return worst;
    }
};

}  // namespace lostmotion
