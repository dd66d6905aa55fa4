#include "analyses.hpp"

namespace lostmotion {

namespace {

// Ticks, delays and schedules that differ beside the value of a parameter have no derivative.
bool acts_at_the_same_instants(const Control& a, const Control& b) {
    const auto same = [](const control::Schedule& s, const control::Schedule& t) {
        return s.every == t.every && s.phase == t.phase;
    };
    if (a.tick != b.tick || a.axes.size() != b.axes.size()) return false;
    const std::vector<control::Axis> one = a.laws(), other = b.laws();
    for (std::size_t k = 0; k < one.size(); ++k) {
        const control::Axis &s = one[k], &t = other[k];
        if (s.slots() != t.slots() || s.delay.samples != t.delay.samples || !same(s.speed_schedule, t.speed_schedule) ||
            !same(s.position_schedule, t.position_schedule) || !same(s.current_schedule, t.current_schedule))
            return false;
    }
    return true;
}

}  // namespace

DerivativeFault check_derivatives(const Control& control, const std::vector<Variation>& variations) {
    for (const ControlledAxis& axis : control.axes) {
        if (axis.law.field_orientation)
            return {{}, "field-oriented control has no derivatives here; take a current loop of kind \"pi\""};
        if (axis.law.camera.present && axis.law.camera.pixel > 0.0)
            return {{}, "a camera of finite resolution has no derivative; leave its pixels out"};
        for (const auto* encoder : {&axis.law.speed_sensor.encoder, &axis.law.position_sensor.encoder})
            if (encoder->step() > 0.0 && encoder->error > 0.0)
                return {{},
                        "an encoder with a resolution and an interpolation error has no derivatives here; leave one "
                        "of them out"};
    }
    for (const Variation& v : variations)
        for (const Neighbour& n : v.neighbours)
            if (n.control && !acts_at_the_same_instants(control, *n.control))
                return {v.name, "changes the instants at which a controller acts, which has no derivative"};
    return {};
}

TrainReport run_with_derivatives(const SensitiveCase& c, double* out, SensitivityOutput& output) {
    return Analyses::of(c.run->assembly()).run_with_derivatives(c.run->model(), c, out, output);
}

std::vector<std::size_t> pieces_of_work(const std::vector<SensitiveCase>& cases) {
    std::vector<std::size_t> first{0};
    for (std::size_t k = 1; k < cases.size(); ++k)
        if (cases[k].run != cases[k - 1].run ||
            cases[k].options.sample_interval != cases[k - 1].options.sample_interval || k - first.back() == together)
            first.push_back(k);
    first.push_back(cases.size());
    return first;
}

std::vector<SensitiveRow> run_sensitive(const std::vector<SensitiveCase>& cases,
                                        const std::vector<std::string>& channels, bool signals, unsigned threads,
                                        const std::function<bool(std::size_t)>& waiting) {
    std::vector<SensitiveRow> rows(cases.size());
    const std::vector<std::size_t> first = pieces_of_work(cases);
    distribute(first.size() - 1, threads, waiting, [&](auto next, std::atomic<bool>& stop) {
        for (std::size_t n = next(); n + 1 < first.size() && !stop; n = next()) {
            const std::size_t begin = first[n], count = first[n + 1] - begin;
            const TrainRun& run = *cases[begin].run;
            if (!run.error().empty()) {
                for (std::size_t k = 0; k < count; ++k) rows[begin + k].problem.reason = run.error();
                continue;
            }
            Analyses::of(run.assembly())
                .run_sensitive(run.model(), std::span(cases).subspan(begin, count),
                               std::span(rows).subspan(begin, count), channels, signals, stop);
        }
    });
    return rows;
}

}  // namespace lostmotion
