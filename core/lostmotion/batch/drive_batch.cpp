#include "drive_batch.hpp"

#include <algorithm>
#include <span>
#include <utility>

#include "../model/drive_train.hpp"
#include "../simulation/train_status.hpp"

namespace lostmotion::batch {

namespace {

constexpr std::size_t most_solvers = 64;  // that a thread keeps
constexpr const char* backlash = "gearbox.stiffness.backlash";

// A train with another gap, of an odd torsion curve.
void set_gap(model::Train& train, double half_gap) {
    TorsionCurve& curve = train.gears[0].law.curve;
    auto [breaks, slopes] = curve.forward();
    if (slopes[0] == 0.0) {
        const double was = breaks[0];
        slopes.erase(slopes.begin());
        breaks.erase(breaks.begin());
        for (double& at : breaks) at -= was;
    }
    if (half_gap > 0.0) {
        for (double& at : breaks) at += half_gap;
        breaks.insert(breaks.begin(), half_gap);
        slopes.insert(slopes.begin(), 0.0);
    }
    curve = TorsionCurve(std::move(breaks), std::move(slopes));
}

}  // namespace

// What a thread keeps: general solvers of some drives.
struct DriveBatch::Worker {
    struct Kept {
        std::size_t number;
        long used;
        std::unique_ptr<TrainSimulation> simulation;
    };
    std::vector<Kept> solvers;
    long clock = 0;
    Counts counts;
    Failure failure;
    MotionState state;  // its memory is used again
};

std::string DriveBatch::error(const model::Train& train) {
    const TrainRun run(train);
    return run.error().empty() ? not_walked(train) : run.error();
}

DriveBatch::DriveBatch(const std::vector<model::Train>& kinds, std::vector<int> kind_of, double step)
    : kind_of_(std::move(kind_of)),
      step_(step),
      drives_(kind_of_.size()),
      inputs_(2 * kind_of_.size()),
      shown_(states * kind_of_.size()) {
    for (const model::Train& train : kinds) {
        const DriveKind& made = *kinds_.emplace_back(std::make_unique<const DriveKind>(train));
        numbers_.push_back(numbers_of(made, train, made.half_gap()));
    }
}

DriveBatch::~DriveBatch() = default;

double DriveBatch::half_gap_of(std::size_t k) const {
    const auto at = std::ranges::find(own_, backlash, &Own::key);
    return at == own_.end() ? kind(k).half_gap() : 0.5 * at->values[k];
}

model::Train DriveBatch::train_of(std::size_t k) const {
    model::Train t = kind(k).train();
    for (const Own& own : own_)
        if (double* value = model::find_parameter(t, own.key)) *value = own.values[k];
    if (const double half_gap = half_gap_of(k); half_gap != kind(k).half_gap()) set_gap(t, half_gap);
    return t;
}

bool DriveBatch::set(const std::string& key, const double* values) {
    model::Train first = kinds_[0]->train();
    if (key != backlash && model::find_parameter(first, key) == nullptr) return false;
    auto at = std::ranges::find(own_, key, &Own::key);
    const bool added = at == own_.end();
    if (added) {
        spread_numbers();
        at = own_.insert(at, {key, std::vector<double>(size())});
        for (std::size_t k = 0; k < size(); ++k) {
            model::Train t = kind(k).train();
            at->values[k] = key == backlash ? 2.0 * kind(k).half_gap() : *model::find_parameter(t, key);
        }
    }
    for (std::size_t k = 0; k < size(); ++k)
        if (at->values[k] != values[k]) {
            at->values[k] = values[k];
            renew(k);
        }
    return true;
}

void DriveBatch::replace(std::size_t k, const model::Train& train) {
    spread_numbers();
    auto made = std::make_unique<const DriveKind>(train);
    const auto [at, added] = replaced_.emplace(k, static_cast<int>(kinds_.size()));
    if (added)
        kinds_.push_back(std::move(made));
    else
        kinds_[static_cast<std::size_t>(at->second)] = std::move(made);
    kind_of_[k] = at->second;
    renew(k);
}

void DriveBatch::spread_numbers() {
    if (std::exchange(each_its_own_, true)) return;
    std::vector<DriveNumbers> each;
    for (const int kind : kind_of_) each.push_back(numbers_[static_cast<std::size_t>(kind)]);
    numbers_ = std::move(each);
    for (const auto& w : workers_) w->solvers.clear();
}

// The numbers of a drive, after its parameters have changed. One whose gap closes becomes one of a kind without it.
void DriveBatch::renew(std::size_t k) {
    const model::Train train = train_of(k);
    if (kind(k).laws().has_gap != train.gears[0].has_backlash()) {
        const auto [at, added] = other_gap_.emplace(kind_of_[k], static_cast<int>(kinds_.size()));
        if (added) {
            other_gap_[at->second] = kind_of_[k];
            kinds_.push_back(std::make_unique<const DriveKind>(train));
        }
        kind_of_[k] = at->second;
    }
    DriveState& x = drives_[k];
    const double before = ratio(k), motor_speed = before * x.a, load_speed = x.a - x.v,
                 torque = numbers(k).turned * x.q;
    numbers_[k] = numbers_of(kind(k), train, half_gap_of(k));
    if (ratio(k) != before) {
        x.q = numbers(k).turned * torque;
        x.a = motor_speed / ratio(k);
        x.v = x.a - load_speed;
    }
    x.known = false;
    ++changes_;
    for (const auto& w : workers_)
        std::erase_if(w->solvers, [k](const Worker::Kept& kept) { return kept.number == k; });
}

Failure DriveBatch::step(const Input& command, const Input& load_torque, unsigned threads, LoadAnswer* answers) {
    while (workers_.size() < Team::needed(size(), threads)) workers_.push_back(std::make_unique<Worker>());
    team_.share(size(), threads, [&](std::size_t begin, std::size_t end, std::size_t who) {
        step_range(begin, end, command, load_torque, answers, *workers_[who]);
    });
    Failure first;
    for (const auto& w : workers_) {
        counts_ += std::exchange(w->counts, {});
        first.add(std::exchange(w->failure, {}));
    }
    return first;
}

void DriveBatch::step_range(std::size_t begin, std::size_t end, const Input& command, const Input& load_torque,
                            LoadAnswer* answers, Worker& worker) {
    for (std::size_t k = begin; k < end; ++k) {
        ++worker.counts.steps;
        DriveWalk walk(kind(k).laws(), numbers(k), drives_[k], command[k], load_torque[k]);
        if (answers != nullptr) walk.differ(0.0, 1.0);
        if (walk.advance(step_)) {
            if (answers != nullptr)
                answers[k] = {((walk.x.a - walk.x.v) - (drives_[k].a - drives_[k].v)) / step_, 0.0,
                              (walk.tangent[2] - walk.tangent[1]) / step_};
            drives_[k] = walk.x;
            worker.counts.walked += walk.switchings > 0;
            worker.counts.switchings += walk.switchings;
        } else if (!solve(k, command[k], load_torque[k], answers == nullptr ? nullptr : answers + k, worker)) {
            continue;
        }
        inputs_[2 * k] = command[k];
        inputs_[2 * k + 1] = load_torque[k];
        show(k);
    }
}

// By the general solver. False: the motion cannot go on.
bool DriveBatch::solve(std::size_t k, double command, double load_torque, LoadAnswer* answer, Worker& worker) {
    ++worker.counts.general;
    const std::size_t number = each_its_own_ ? k : static_cast<std::size_t>(kind_of_[k]);
    auto kept = std::ranges::find(worker.solvers, number, &Worker::Kept::number);
    if (kept == worker.solvers.end()) {
        if (worker.solvers.size() == most_solvers)
            worker.solvers.erase(std::ranges::min_element(worker.solvers, {}, &Worker::Kept::used));
        worker.solvers.push_back({number, 0, std::make_unique<TrainSimulation>(train_of(k), step_)});
        kept = worker.solvers.end() - 1;
    }
    kept->used = ++worker.clock;
    TrainSimulation& simulation = *kept->simulation;
    const model::Assembly& a = simulation.assembly();
    const model::Layout& n = a.layout();
    const model::Places& places = a.places();
    const model::GearPlace& gear = places.gears[0];
    const model::ShaftPlace &first = places.shafts[0], &last = places.shafts[1];
    const auto at = [](auto& list, int place) -> auto& { return list[static_cast<std::size_t>(place)]; };
    const DriveNumbers& p = numbers(k);
    const int torque = places.motors[0].torque, limit = places.motors[0].branch, zero = kind(k).laws().zero;
    const int locked = gear.contact == model::nowhere ? model::nowhere : at(places.contacts, gear.contact).locked;
    DriveState& x = drives_[k];
    MotionState& s = worker.state;
    s.clear();
    s.x.resize(static_cast<std::size_t>(n.states));
    s.memory.resize(static_cast<std::size_t>(n.memory));
    if (torque != model::nowhere) at(s.x, torque) = p.turned * x.q;
    at(s.x, first.speed) = ratio(k) * x.a;
    at(s.x, last.speed) = x.a - x.v;
    if (gear.twist != model::nowhere) at(s.x, gear.twist) = x.d;
    at(s.x, n.coupled) = x.angle;
    if (gear.hysteresis != model::nowhere) at(s.memory, gear.hysteresis) = x.hysteresis;
    if (locked != model::nowhere) at(s.memory, locked) = x.held;
    s.started = x.known;
    if (x.known) {
        if (first.contact != model::nowhere)
            at(s.key.modes, first.contact) = static_cast<std::int8_t>(p.turned * x.motor);
        if (gear.contact != model::nowhere) at(s.key.modes, gear.contact) = x.twist;
        if (last.contact != model::nowhere) at(s.key.modes, last.contact) = x.load;
        if (gear.piece != model::nowhere) at(s.key.branch, gear.piece) = static_cast<std::int16_t>(x.piece - zero);
        if (gear.flanks != model::nowhere) at(s.key.branch, gear.flanks) = x.flanks;
        if (gear.cell != model::nowhere) at(s.key.branch, gear.cell) = x.cell;
        if (gear.cell_back != model::nowhere) at(s.key.branch, gear.cell_back) = x.back;
        if (limit != model::nowhere)
            at(s.key.branch, limit) = static_cast<std::int16_t>(inputs_[2 * k] > p.command_limit) -
                                      static_cast<std::int16_t>(inputs_[2 * k] < -p.command_limit);
        s.rate_input.assign(inputs_.begin() + static_cast<std::ptrdiff_t>(2 * k),
                            inputs_.begin() + static_cast<std::ptrdiff_t>(2 * k) + n.inputs);
    } else if (locked != model::nowhere && gear.twist != model::nowhere) {
        at(s.memory, locked) = a.train().gears[0].law.curve.torque(x.d);
    }
    simulation.motion().restore(s);
    const std::array<double, 2> both{command, load_torque};
    const auto inputs = std::span(both).first(static_cast<std::size_t>(n.inputs));
    const Status status = answer == nullptr
                              ? simulation.motion().advance(step_, inputs, inputs)
                              : simulation.motion().answer(step_, inputs, inputs, *simulation.load_shaft(1), *answer);
    if (status != Status::done) {
        const Motion& m = simulation.motion();
        worker.failure.add({k, train_status_text(a, status, m.time(), m.stopped_at(), m.too_many_guards())});
        return false;
    }
    simulation.motion().save(s);
    if (torque != model::nowhere) x.q = p.turned * at(s.x, torque);
    x.a = at(s.x, first.speed) / ratio(k);
    x.v = x.a - at(s.x, last.speed);
    if (gear.twist != model::nowhere) x.d = at(s.x, gear.twist);
    x.angle = at(s.x, n.coupled);
    if (gear.hysteresis != model::nowhere) x.hysteresis = at(s.memory, gear.hysteresis);
    if (locked != model::nowhere) x.held = at(s.memory, locked);
    x.known = true;
    if (first.contact != model::nowhere) x.motor = static_cast<signed char>(p.turned * at(s.key.modes, first.contact));
    if (gear.contact != model::nowhere) x.twist = at(s.key.modes, gear.contact);
    if (last.contact != model::nowhere) x.load = at(s.key.modes, last.contact);
    if (gear.piece != model::nowhere) x.piece = static_cast<short>(at(s.key.branch, gear.piece) + zero);
    if (gear.flanks != model::nowhere) x.flanks = static_cast<signed char>(at(s.key.branch, gear.flanks));
    if (gear.cell != model::nowhere) x.cell = at(s.key.branch, gear.cell);
    if (gear.cell_back != model::nowhere) x.back = at(s.key.branch, gear.cell_back);
    if (gear.contact != model::nowhere && x.twist == 0) x.v = 0.0;
    return true;
}

void DriveBatch::reset(const bool* which, const double* start) {
    for (std::size_t k = 0; k < size(); ++k) {
        if (which != nullptr && !which[k]) continue;
        DriveState& x = drives_[k] = {};
        inputs_[2 * k] = inputs_[2 * k + 1] = 0.0;
        if (start != nullptr) {
            const double* from = start + k * states;
            x.q = numbers(k).turned * from[0];
            x.a = from[1] / ratio(k);
            x.v = x.a - from[2];
            x.d = from[3];
            x.angle = from[4];
        }
        show(k);
    }
}

void DriveBatch::restore(const Snapshot& s) {
    drives_ = s.drives;
    inputs_ = s.inputs;
    for (std::size_t k = 0; k < size(); ++k) {
        drives_[k].known = drives_[k].known && s.changes == changes_;
        show(k);
    }
}

void DriveBatch::show(std::size_t k) {
    const DriveState& x = drives_[k];
    const double numbers_shown[states] = {numbers(k).turned * x.q, ratio(k) * x.a, x.a - x.v, x.d, x.angle};
    for (std::size_t s = 0; s < states; ++s) shown_[s * size() + k] = numbers_shown[s];
}

// From the regime that a drive is in, under the inputs of its last step.
template <class Read>
void DriveBatch::read(double* out, Read&& what) const {
    for (std::size_t k = 0; k < size(); ++k) {
        DriveWalk walk(kind(k).laws(), numbers(k), drives_[k], inputs_[2 * k], inputs_[2 * k + 1]);
        if (!walk.x.known) walk.begin();
        out[k] = walk.make() ? what(walk, k) : 0.0;
    }
}

void DriveBatch::read_output_torque(double* out) const {
    read(out, [](const DriveWalk& w, std::size_t) { return w.r.output.at(w.x); });
}

void DriveBatch::read_motor_torque(double* out) const {
    read(out, [this](const DriveWalk& w, std::size_t k) { return numbers(k).turned * w.r.pull.at(w.x); });
}

void DriveBatch::read_input_contact(std::int8_t* out) const {
    for (std::size_t k = 0; k < size(); ++k) out[k] = static_cast<std::int8_t>(numbers(k).turned * drives_[k].motor);
}

void DriveBatch::read_twist_contact(std::int8_t* out) const {
    for (std::size_t k = 0; k < size(); ++k) out[k] = drives_[k].twist;
}

std::size_t DriveBatch::memory() const {
    return size() * (sizeof(DriveState) + sizeof(int) + (2 + states + own_.size()) * sizeof(double)) +
           numbers_.size() * sizeof(DriveNumbers);
}

}  // namespace lostmotion::batch
