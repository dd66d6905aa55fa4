// Derivatives of runs of random trains, against differences of the runs themselves.
#pragma once

#include <doctest/doctest.h>

#include <functional>
#include <set>

#include "lostmotion/analysis/sensitive_run.hpp"
#include "random_train_runs.hpp"

namespace lostmotion::model {

struct RandomCase {
    Train train;
    std::vector<Signal> inputs;
    TrainStart start;
    Control control;
};

// A number that a run depends on.
struct Knob {
    std::string name;
    std::function<double&(RandomCase&)> at;
    std::function<void(RandomCase&, double)> set_value;  // where it is no number of its own

    double get(const RandomCase& c) const {
        RandomCase copy = c;
        return at(copy);
    }
    void set(RandomCase& c, double v) const { set_value ? set_value(c, v) : static_cast<void>(at(c) = v); }
};

// Everything of a case that is a number other than 0 and can be changed by itself.
inline std::vector<Knob> knobs(const RandomCase& c) {
    std::vector<Knob> out;
    const auto add = [&](std::string name, std::function<double&(RandomCase&)> at) {
        Knob k{std::move(name), std::move(at), {}};
        if (const double v = k.get(c); v != 0.0 && std::isfinite(v)) out.push_back(std::move(k));
    };
    const auto number = [](std::size_t k) { return std::to_string(k); };
    for (std::size_t s = 0; s < c.train.shafts.size(); ++s) {
        add("inertia" + number(s), [s](RandomCase& x) -> double& { return x.train.shafts[s].inertia; });
        add("viscous" + number(s), [s](RandomCase& x) -> double& { return x.train.shafts[s].viscous_friction; });
        add("friction" + number(s), [s](RandomCase& x) -> double& { return x.train.shafts[s].friction.torque; });
        add("breakaway" + number(s),
            [s](RandomCase& x) -> double& { return x.train.shafts[s].friction.breakaway_torque; });
        for (std::size_t k = 0; k < c.train.shafts[s].friction.torques.size(); ++k)
            add("friction" + number(s) + "_torque" + number(k),
                [s, k](RandomCase& x) -> double& { return x.train.shafts[s].friction.torques[k]; });
        for (std::size_t k = 1; k < c.train.shafts[s].friction.speeds.size(); ++k)
            add("friction" + number(s) + "_speed" + number(k),
                [s, k](RandomCase& x) -> double& { return x.train.shafts[s].friction.speeds[k]; });
    }
    for (std::size_t m = 0; m < c.train.motors.size(); ++m) {
        add("rated_torque" + number(m), [m](RandomCase& x) -> double& { return x.train.motors[m].law.rated_torque; });
        add("rated_speed" + number(m), [m](RandomCase& x) -> double& { return x.train.motors[m].law.rated_speed; });
        add("time_constant" + number(m),
            [m](RandomCase& x) -> double& { return x.train.motors[m].law.electrical_time_constant; });
        add("motor_friction" + number(m),
            [m](RandomCase& x) -> double& { return x.train.motors[m].law.friction_torque; });
        add("torque_limit" + number(m), [m](RandomCase& x) -> double& { return x.train.motors[m].torque_limit; });
        add("voltage_limit" + number(m), [m](RandomCase& x) -> double& { return x.train.motors[m].law.voltage_limit; });
    }
    for (std::size_t g = 0; g < c.train.gears.size(); ++g) {
        if (c.train.gears.size() + c.train.clutches.size() + c.train.freewheels.size() < c.train.shafts.size())
            add("ratio" + number(g), [g](RandomCase& x) -> double& { return x.train.gears[g].law.ratio; });
        add("mesh_damping" + number(g), [g](RandomCase& x) -> double& { return x.train.gears[g].mesh_damping; });
        if (c.train.gears[g].law.hysteresis_efficiency < 1.0)
            add("hysteresis" + number(g),
                [g](RandomCase& x) -> double& { return x.train.gears[g].law.hysteresis_efficiency; });
        if (c.train.gears[g].law.efficiency < 1.0)
            add("efficiency" + number(g), [g](RandomCase& x) -> double& { return x.train.gears[g].law.efficiency; });
        if (!c.train.gears[g].rigid()) {
            const TorsionCurve curve = c.train.gears[g].law.curve;
            const int last = curve.last_piece();
            std::vector<double> edges, slopes;
            for (int k = 0; k <= last; ++k) slopes.push_back(curve.slope(k));
            for (int k = 0; k < last; ++k) edges.push_back(curve.upper(k));
            auto value = std::make_shared<double>();
            const auto with = [=](bool edge, std::size_t n, double v) {
                auto e = edges, s = slopes;
                (edge ? e : s)[n] = v;
                return TorsionCurve(e, s);
            };
            for (std::size_t n = 0; n < slopes.size(); ++n)
                if (slopes[n] != 0.0)
                    out.push_back({"stiffness" + number(g) + "_" + number(n),
                                   [=](RandomCase&) -> double& { return *value = slopes[n]; },
                                   [=](RandomCase& x, double v) { x.train.gears[g].law.curve = with(false, n, v); }});
            for (std::size_t n = 0; n < edges.size(); ++n)
                out.push_back({"play" + number(g) + "_" + number(n),
                               [=](RandomCase&) -> double& { return *value = edges[n]; },
                               [=](RandomCase& x, double v) { x.train.gears[g].law.curve = with(true, n, v); }});
        }
    }
    for (std::size_t k = 0; k < c.train.clutches.size(); ++k)
        add("clutch" + number(k), [k](RandomCase& x) -> double& { return x.train.clutches[k].torque; });
    for (std::size_t k = 0; k < c.train.brakes.size(); ++k)
        add("brake" + number(k), [k](RandomCase& x) -> double& { return x.train.brakes[k].torque; });
    for (std::size_t a = 0; a < c.control.axes.size(); ++a) {
        const auto of_axis = [&](const char* name, auto member) {
            add(name + number(a), [a, member](RandomCase& x) -> double& { return member(x.control.axes[a].law); });
        };
        using control::Axis;
        of_axis("speed_gain", [](Axis& x) -> double& { return x.speed_loop.gain; });
        of_axis("reference_weight", [](Axis& x) -> double& { return x.speed_loop.reference_weight; });
        of_axis("speed_integral_gain", [](Axis& x) -> double& { return x.speed_loop.integral_gain; });
        of_axis("speed_torque_limit", [](Axis& x) -> double& { return x.speed_loop.torque_limit; });
        of_axis("position_gain", [](Axis& x) -> double& { return x.position_loop.gain; });
        of_axis("speed_feedforward", [](Axis& x) -> double& { return x.position_loop.feedforward; });
        of_axis("inertia_feedforward", [](Axis& x) -> double& { return x.feedforward.inertia; });
        of_axis("time_constant", [](Axis& x) -> double& { return x.estimate.time_constant; });
        of_axis("observer_bandwidth", [](Axis& x) -> double& { return x.estimate.bandwidth; });
        of_axis("reference_amplitude", [](Axis& x) -> double& { return x.reference.sines[0].amplitude; });
        of_axis("reference_frequency", [](Axis& x) -> double& { return x.reference.sines[0].frequency; });
        if (c.control.axes[a].law.current_loop) {
            of_axis("current_gain", [](Axis& x) -> double& { return x.current_loop->gain; });
            of_axis("current_limit", [](Axis& x) -> double& { return x.current_loop->command_limit; });
        }
    }
    for (std::size_t i = 0; i < c.inputs.size(); ++i) {
        for (std::size_t k = 0; k < c.inputs[i].breakpoints.size(); ++k) {
            add("value" + number(i) + "_" + number(k),
                [i, k](RandomCase& x) -> double& { return x.inputs[i].breakpoints[k].value; });
            add("slope" + number(i) + "_" + number(k),
                [i, k](RandomCase& x) -> double& { return x.inputs[i].breakpoints[k].slope; });
            add("time" + number(i) + "_" + number(k),
                [i, k](RandomCase& x) -> double& { return x.inputs[i].breakpoints[k].time; });
        }
        for (std::size_t k = 0; k < c.inputs[i].sines.size(); ++k) {
            add("amplitude" + number(i), [i, k](RandomCase& x) -> double& { return x.inputs[i].sines[k].amplitude; });
            add("frequency" + number(i), [i, k](RandomCase& x) -> double& { return x.inputs[i].sines[k].frequency; });
            add("phase" + number(i), [i, k](RandomCase& x) -> double& { return x.inputs[i].sines[k].phase; });
        }
    }
    return out;
}

inline RandomCase with(const RandomCase& c, const Knob& knob, double value) {
    RandomCase out = c;
    knob.set(out, value);
    return out;
}

// The parts of a case that a knob is of.
inline Variation variation(const RandomCase& c, const Knob& knob) {
    const double p = knob.get(c), h = 0x1p-11 * std::fabs(p);
    Variation v{knob.name, {}};
    for (const auto& [offset, weight] : {std::pair{-2.0, 1.0}, {-1.0, -8.0}, {1.0, 8.0}, {2.0, -1.0}}) {
        const RandomCase at = with(c, knob, p + offset * h);
        Neighbour n;
        n.offset = offset * h;
        n.weight = weight / (12.0 * h);
        n.train = std::make_shared<const lostmotion::TrainRun>(at.train);
        n.inputs = at.inputs;
        n.start = at.start;
        if (c.control.present()) n.control = at.control;
        v.neighbours.push_back(n);
    }
    return v;
}

struct SensitiveRecord {
    TrainReport report;
    std::size_t samples, channels;
    std::vector<double> values, derivatives;  // channels x samples; parameters x channels x samples
    SensitivityOutput output;

    // all: of states and torques.
    SensitiveRecord(const RandomCase& c, const std::vector<Variation>& variations, double duration, double interval) {
        const auto run = std::make_shared<const lostmotion::TrainRun>(c.train);
        TrainOptions options;
        options.duration = duration;
        options.sample_interval = interval;
        options.energy = false;
        options.control = c.control;
        samples = options.samples = static_cast<std::size_t>(duration / interval + 1.5);
        channels = run->channels().size();
        std::vector<int> all(channels);
        std::iota(all.begin(), all.end(), 0);
        options.channels = all;
        output.channels = all;
        values.resize(channels * samples);
        derivatives.resize(variations.size() * channels * samples);
        output.out = derivatives.data();
        report = run_with_derivatives({run, c.inputs, c.start, options, variations}, values.data(), output);
    }
    bool done() const { return report.message.empty() && report.status == Status::done && !report.too_many_guards; }
};

struct SensitivityTally {
    int trains = 0, parameters = 0, failed_runs = 0, ended = 0;
    long compared = 0, undecided = 0, wrong = 0, switchings = 0;
    double worst = 0.0;  // relative to the largest of a channel in a run
};

// Central differences of sixth order with steps that halve; doubt: by how much they differ, and rounding.
inline void differences_of_run(const RandomCase& c, const Knob& knob, double duration, double interval,
                               std::vector<double>& best, std::vector<double>& doubt) {
    const double p = knob.get(c);
    std::vector<double> last;
    for (int e = 8; e <= 10; ++e) {
        const double h = std::ldexp(std::fabs(p), -e);
        std::vector<double> d, rounded;
        for (const auto& [offset, weight] :
             {std::pair{1.0, 45.0}, {2.0, -9.0}, {3.0, 1.0}, {-1.0, -45.0}, {-2.0, 9.0}, {-3.0, -1.0}}) {
            const SensitiveRecord at(with(c, knob, p + offset * h), {}, duration, interval);
            d.resize(at.values.size());
            rounded.resize(d.size());
            if (!at.done()) {
                d.assign(d.size(), std::numeric_limits<double>::quiet_NaN());
                break;
            }
            for (std::size_t k = 0; k < d.size(); ++k) {
                d[k] += weight / (60.0 * h) * at.values[k];
                rounded[k] += std::numeric_limits<double>::epsilon() / h * std::fabs(at.values[k]);
            }
        }
        if (best.empty()) {
            best = d;
            doubt.assign(d.size(), std::numeric_limits<double>::infinity());
        }
        if (!last.empty())
            for (std::size_t k = 0; k < d.size(); ++k)
                if (const double gap = std::fabs(d[k] - last[k]) + rounded[k]; gap < doubt[k]) {
                    doubt[k] = gap;
                    best[k] = d[k];
                }
        last = std::move(d);
    }
}

inline void compare_sensitivities(const RandomCase& c, const std::vector<Knob>& chosen, double duration,
                                  SensitivityTally& tally, double near = 1e-8, const char* tell = nullptr) {
    const double interval = duration / 20.0;
    std::vector<Variation> variations;
    for (const Knob& k : chosen) variations.push_back(variation(c, k));
    const SensitiveRecord exact(c, variations, duration, interval);
    if (!exact.done()) {
        if (tell != nullptr)
            std::printf("  %s: %s status %d\n", tell, exact.report.message.c_str(),
                        static_cast<int>(exact.report.status));
        ++tally.failed_runs;
        return;
    }
    ++tally.trains;
    tally.switchings += static_cast<long>(exact.report.switching_count);
    if (!exact.output.ends_by.empty()) {
        ++tally.ended;
        if (tell != nullptr)
            std::printf("  %s: ends at %g by %s\n", tell, exact.output.ends_at, exact.output.ends_by.c_str());
    }
    for (std::size_t p = 0; p < chosen.size(); ++p) {
        ++tally.parameters;
        std::vector<double> best, doubt;
        differences_of_run(c, chosen[p], duration, interval, best, doubt);
        for (std::size_t k = 0; k < exact.channels; ++k) {
            const double* d = &exact.derivatives[(p * exact.channels + k) * exact.samples];
            const double *own = &best[k * exact.samples], *own_doubt = &doubt[k * exact.samples];
            const double* value = &exact.values[k * exact.samples];
            double size = 0.0, value_size = 0.0;
            for (std::size_t n = 0; n < exact.samples; ++n) {
                if (std::isfinite(d[n])) size = std::fmax(size, std::fabs(d[n]));
                value_size = std::fmax(value_size, std::fabs(value[n]));
            }
            size = std::fmax(size, 1e-4 * std::fmax(value_size, 1e-6) / std::fabs(chosen[p].get(c)));
            for (std::size_t n = 0; n < exact.samples; ++n) {
                if (!std::isfinite(d[n])) continue;  // has ended
                if (!(own_doubt[n] <= 0.25 * near * size)) {
                    ++tally.undecided;
                    continue;
                }
                ++tally.compared;
                const double gap = std::fabs(d[n] - own[n]) / std::fmax(size, 1e-300);
                tally.worst = std::fmax(tally.worst, size > 0.0 ? gap : 0.0);
                if (size == 0.0 || gap <= near) continue;
                ++tally.wrong;
                if (tell != nullptr && n % 4 == 0)
                    std::printf("  %s: d %s / d %s at %g: %.10g, by differences %.10g (doubt %.1g, scale %.3g)\n", tell,
                                lostmotion::TrainRun(c.train).channels()[k].name.c_str(), chosen[p].name.c_str(),
                                interval * static_cast<double>(n), d[n], own[n], own_doubt[n], size);
            }
        }
    }
}

// A random train, under controllers or not.
inline RandomCase random_case(RandomTrains& random, int shafts, double duration, bool closed_loop) {
    const RandomRun r(random, shafts, duration);
    RandomCase c{r.train, r.inputs, {}, {}};
    if (!closed_loop) return c;
    const Assembly a(r.train);
    c.control = random_control(random, a);
    for (const ControlledAxis& axis : c.control.axes)
        c.inputs[static_cast<std::size_t>(a.places().motors[static_cast<std::size_t>(axis.motor)].command)] = Signal{};
    return c;
}

// Some of the knobs of a case.
inline std::vector<Knob> some_knobs(RandomTrains& random, const RandomCase& c, int count) {
    std::vector<Knob> all = knobs(c), out;
    for (; count > 0 && !all.empty(); --count) {
        const auto k = static_cast<std::size_t>(random.pick(0, static_cast<int>(all.size()) - 1));
        out.push_back(all[k]);
        all.erase(all.begin() + static_cast<long>(k));
    }
    return out;
}

// Differences of a run are rounded to some 1e-12 of its values over the step; where two steps agree to 2.5e-9, they
// must with the derivative to 1e-8.
inline void compare_one(unsigned seed, bool closed_loop, SensitivityTally& tally) {
    CAPTURE(seed);
    RandomTrains random(seed);
    const RandomCase c = random_case(random, 5, 0.3, closed_loop);
    compare_sensitivities(c, some_knobs(random, c, 1), 0.3, tally, 1e-8, "differs");
}

}  // namespace lostmotion::model
