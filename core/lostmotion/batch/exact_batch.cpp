#include "exact_batch.hpp"

namespace lostmotion::batch {

ExactBatch::ExactBatch(const std::vector<Scenario>& kinds, std::span<const int> kind_of, double step) : step_(step) {
    for (const int kind : kind_of)
        drives_.push_back(std::make_unique<ScenarioSimulation>(kinds[static_cast<std::size_t>(kind)], step));
    for (const model::Shaft& shaft : drives_[0]->train().assembly().train().shafts)
        if (shaft.given_motion) given_ = drives_[0]->given_shaft(shaft.name);
    values_.resize(variables().size() * size());
}

void ExactBatch::step_one(std::size_t k, std::span<const Input> inputs, const std::optional<Motion>& motion,
                          const std::optional<Answers>& answers, Worker& worker) {
    ScenarioSimulation& s = *drives_[k];
    worker.inputs.clear();
    for (const Input& input : inputs) worker.inputs.push_back(input[k]);
    Status status;
    if (motion) {
        ScenarioSimulation::GivenCourse course{*given_, {motion->speed[k], {}, {}}};
        if (motion->angle) course.to.angle = (*motion->angle)[k];
        if (motion->acceleration) course.to.acceleration = (*motion->acceleration)[k];
        status = s.advance(step_, worker.inputs, worker.inputs, {&course, 1});
    } else if (answers) {
        status = s.answer(step_, worker.inputs, worker.inputs, *load_shaft(k, answers->shaft), answers->of[k]);
    } else {
        status = s.advance(step_, worker.inputs, worker.inputs);
    }
    worker.values.resize(variables().size());
    if (status == Status::done) status = s.read(worker.values.data());
    if (status != Status::done) return worker.failure.add({k, s.text(status)});
    for (std::size_t v = 0; v < worker.values.size(); ++v) values_[v * size() + k] = worker.values[v];
}

Failure ExactBatch::step(std::span<const Input> inputs, const std::optional<Motion>& motion, unsigned threads,
                         const std::optional<Answers>& answers) {
    workers_.resize(std::max(workers_.size(), Team::needed(size(), threads)));
    team_.share(size(), threads, [&](std::size_t begin, std::size_t end, std::size_t who) {
        for (std::size_t k = begin; k < end; ++k) step_one(k, inputs, motion, answers, workers_[who]);
    });
    Failure first;
    for (Worker& w : workers_) first.add(std::exchange(w.failure, {}));
    return first;
}

bool ExactBatch::replace(std::size_t k, const Scenario& scenario) {
    auto made = std::make_unique<ScenarioSimulation>(scenario, step_);
    if (made->state_size() != drives_[k]->state_size() || made->names().states != states()) return false;
    made->go_on_from(*drives_[k]);
    drives_[k] = std::move(made);
    return true;
}

std::string ExactBatch::reset(const bool* which, const double* start) {
    const std::size_t n = states().size();
    const std::vector<double> capacities(drives_[0]->names().capacities.size());
    std::vector<double> held(inputs().size());
    for (std::size_t k = 0; k < size(); ++k) {
        if (which != nullptr && !which[k]) continue;
        ScenarioSimulation& s = *drives_[k];
        const std::span<const double> x(start + k * (n + 1), n);
        if (std::string wrong = s.reset(x, capacities); !wrong.empty()) return wrong;
        const auto show = [&](int v, double value) {
            if (v >= 0) values_[static_cast<std::size_t>(v) * size() + k] = value;
        };
        for (std::size_t v = 0; v < variables().size(); ++v) show(static_cast<int>(v), 0.0);
        for (std::size_t i = 0; i < n; ++i) show(s.variables().place(states()[i]), x[i]);
        if (!given_) continue;
        held[given_->speed_input] = start[k * (n + 1) + n];
        s.hold(held);
        show(given_->speed, held[given_->speed_input]);
    }
    return "";
}

auto ExactBatch::snapshot() const -> Snapshot {
    Snapshot s{this, std::vector<MotionState>(size()), values_};
    for (std::size_t k = 0; k < size(); ++k) drives_[k]->motion().save(s.drives[k]);
    return s;
}

void ExactBatch::restore(const Snapshot& s) {
    for (std::size_t k = 0; k < size(); ++k) drives_[k]->restore(s.drives[k]);
    values_ = s.values;
}

std::size_t ExactBatch::memory() const {
    std::size_t bytes = values_.size() * sizeof(double);
    for (const auto& d : drives_) bytes += sizeof(*d) + d->motion().memory();
    return bytes;
}

}  // namespace lostmotion::batch
