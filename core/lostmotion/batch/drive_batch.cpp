#include "drive_batch.hpp"

#include <algorithm>
#include <bit>
#include <limits>
#include <utility>

#include "../model/drive_train.hpp"
#include "../simulation/train_control.hpp"

namespace lostmotion::batch {

namespace lanes {

using real = double __attribute__((vector_size(4 * sizeof(double))));
struct Lane {
    using number = double;
    using mask = decltype(real{} < real{});
    static bool any(mask m) {
        m |= __builtin_shufflevector(m, m, 2, 3, 0, 1);
        return (m[0] | m[1]) != 0;
    }
};
#include "drive_series.hpp"

}  // namespace lanes

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

auto& at(auto& list, int place) { return list[static_cast<std::size_t>(place)]; }

// use(number, number of the drive, sign): what the general solver has in the place of a number of a drive. turned: -1
// where the output turns against the input.
template <class State, class Use>
void each_number(const model::Assembly& a, int turned, MotionState& s, State& x, Use&& use) {
    const model::Places& places = a.places();
    const model::GearPlace& gear = places.gears[0];
    const auto in = [&](auto& list, int place, auto& number, int sign = 1) {
        if (place != model::nowhere) use(at(list, place), number, sign);
    };
    in(s.x, places.motors[0].torque, x.q, turned);
    in(s.x, gear.twist, x.d);
    in(s.x, a.layout().coupled, x.angle);
    in(s.memory, gear.hysteresis, x.hysteresis);
    if (gear.contact != model::nowhere) in(s.memory, at(places.contacts, gear.contact).locked, x.held);
    if (!x.known) return;
    in(s.key.modes, places.shafts[0].contact, x.motor, turned);
    in(s.key.modes, gear.contact, x.twist);
    in(s.key.modes, places.shafts[1].contact, x.load);
    in(s.key.branch, gear.flanks, x.flanks);
    in(s.key.branch, gear.cell, x.cell);
    in(s.key.branch, gear.cell_back, x.back);
}

}  // namespace

// Walks of neighbouring drives, whose series are made at once.
struct Lanes {
    static constexpr std::size_t count = 4;
    DriveWalk walks[count];

    // A number of each walk, one in each lane.
    lanes::real of(auto&& number) const {
        return lanes::real{number(walks[0]), number(walks[1]), number(walks[2]), number(walks[3])};
    }
    lanes::DriveForm form(auto&& of_walk) const {
        return {
            of([&](const DriveWalk& w) { return of_walk(w).one; }),
            of([&](const DriveWalk& w) { return of_walk(w).q; }), of([&](const DriveWalk& w) { return of_walk(w).a; }),
            of([&](const DriveWalk& w) { return of_walk(w).v; }), of([&](const DriveWalk& w) { return of_walk(w).d; })};
    }
    // Moves the drives whose regime is sure to last over a time h. All have entered their regimes. Returns a bit for
    // each drive, 1 where it has moved.
    unsigned move(double h, const DriveLaws& laws) {
        const lanes::DriveRates r{form([](const DriveWalk& w) -> auto& { return w.r.q; }),
                                  form([](const DriveWalk& w) -> auto& { return w.r.a; }),
                                  form([](const DriveWalk& w) -> auto& { return w.r.w; }),
                                  form([](const DriveWalk& w) -> auto& { return w.r.v; }),
                                  of([](const DriveWalk& w) { return w.r.twists; }),
                                  of([](const DriveWalk& w) { return w.r.norm; }),
                                  of([](const DriveWalk& w) { return w.r.per_q; }),
                                  of([](const DriveWalk& w) { return w.r.per_d; })};
        lanes::DrivePoint x{of([](const DriveWalk& w) { return w.x.q; }), of([](const DriveWalk& w) { return w.x.a; }),
                            of([](const DriveWalk& w) { return w.x.v; }), of([](const DriveWalk& w) { return w.x.d; })};
        const lanes::real s = lanes::real{} + h;
        lanes::Lane::mask lasts = r.norm * h <= laws.reach[laws.most_degree];
        lanes::DriveSeries series;
        series.expand(r, x, s, laws.reach, laws.inverse, laws.most_degree);
        int guards = 0;
        for (const DriveWalk& w : walks) guards = std::max(guards, w.r.n);
        static constexpr DriveForm positive{1.0, 0.0, 0.0, 0.0, 0.0};
        for (int g = 0; g < guards; ++g)
            lasts &= lanes::DriveSeries::stays_positive(series.cubic(
                form([g](const DriveWalk& w) -> auto& { return g < w.r.n ? w.r.guards[g].form : positive; })));
        const lanes::real turned = series.move(s, lanes::real{} + 1.0, laws.inverse, x);
        unsigned out = 0;
        for (std::size_t i = 0; i < count; ++i) {
            if (lasts[i] == 0) continue;
            out |= 1u << i;
            DriveState& to = walks[i].x;
            to.q = x.q[i];
            to.a = x.a[i];
            to.v = x.v[i];
            to.d = x.d[i];
            to.angle += turned[i];
            if (walks[i].rests()) walks[i].spare_at_rest(walks[i].r.pull.at(to));
        }
        return out;
    }
};

// What a thread keeps: controllers, whose references change, and general solvers of some drives.
struct DriveBatch::Worker {
    struct Kept {
        std::size_t number;
        long used;
        std::unique_ptr<ScenarioSimulation> simulation;
    };
    std::vector<control::Axis> laws;
    std::vector<Kept> solvers;
    long clock = 0;
    int pause = 0, left_alone = 0;  // groups of drives whose series are not made at once
    Counts counts;
    Failure failure;
    MotionState state;  // its memory is used again
    std::vector<double> slots, values;
};

std::string DriveBatch::error(const model::Train& train, const Control& control) {
    const TrainRun run(train);
    if (!run.error().empty()) return run.error();
    if (std::string error = not_walked(train); !error.empty()) return error;
    for (const ControlledAxis& axis : control.axes)
        if (axis.law.field_orientation) return "has a winding, whose currents and speed act on each other";
    return check_control(run.assembly(), control);
}

DriveBatch::DriveBatch(std::vector<Scenario> kinds, std::vector<int> kind_of, double step)
    : kind_of_(std::move(kind_of)),
      step_(step),
      drives_(kind_of_.size()),
      inputs_(2 * kind_of_.size()),
      shown_(states * kind_of_.size()),
      control_of_(kind_of_),
      instants_(kind_of_.size()),
      times_(kind_of_.size()) {
    std::vector<std::size_t> slots;
    for (const Scenario& s : kinds) {
        const DriveKind& made = *kinds_.emplace_back(std::make_unique<const DriveKind>(s.train));
        numbers_.push_back(numbers_of(made, s.train, made.half_gap()));
        controls_.push_back(s.control);
        const std::vector<control::Axis> laws = s.control.laws();
        slots.push_back(laws.empty() ? 0 : static_cast<std::size_t>(laws[0].slots()));
    }
    slots_at_.push_back(0);
    for (const int kind : kind_of_) slots_at_.push_back(slots_at_.back() + slots[static_cast<std::size_t>(kind)]);
    slots_.resize(slots_at_.back());
    const ScenarioSimulation first(kinds[0], step);
    variables_ = std::make_unique<const Variables>(first.variables());
    names_ = first.names();
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
    tangent_walks_.resize(std::min(tangent_walks_.size(), static_cast<std::size_t>(at->second)));
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
    if (!slopes_.empty()) {
        sheets_[k] = sheet_of(train, half_gap_of(k));
        make_tangent_walks();
    }
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
    while (workers_.size() < Team::needed(size(), threads)) add_worker();
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

DriveBatch::Worker& DriveBatch::add_worker() {
    Worker& worker = *workers_.emplace_back(std::make_unique<Worker>());
    for (const Control& control : controls_)
        for (control::Axis& law : control.laws()) worker.laws.push_back(std::move(law));
    return worker;
}

void DriveBatch::step_range(std::size_t begin, std::size_t end, const Input& command, const Input& load_torque,
                            LoadAnswer* answers, Worker& worker) {
    DriveState from{};  // of a drive whose tangents are carried along
    std::size_t k = begin;
    if (!controlled() && answers == nullptr && slopes_.empty())
        for (; k + Lanes::count <= end; k += Lanes::count) step_lanes(k, command, load_torque, worker);
    for (; k < end; ++k) {
        ++worker.counts.steps;
        if (!slopes_.empty()) from = drives_[k];
        LoadAnswer* const answer = answers == nullptr ? nullptr : answers + k;
        // The answer of a controller to what its encoders read is that of the general solver.
        const bool walked = !controlled()
                                ? walk(k, command[k], load_torque[k], answer, worker)
                                : answer == nullptr && walk_under_control(k, command[k], load_torque[k], worker);
        if (!walked && !solve(k, command[k], load_torque[k], answer, worker)) continue;
        end_step(k, load_torque[k]);
        if (!slopes_.empty()) follow_tangents(k, from);
    }
}

void DriveBatch::end_step(std::size_t k, double load_torque) {
    times_[k] += step_;
    inputs_[2 * k + 1] = load_torque;
    show(k);
}

void DriveBatch::step_lanes(std::size_t first, const Input& command, const Input& load_torque, Worker& worker) {
    const auto walk = [&](std::size_t k) {
        return DriveWalk(kind(k).laws(), numbers(k), drives_[k], command[k], load_torque[k]);
    };
    Lanes all{{walk(first), walk(first + 1), walk(first + 2), walk(first + 3)}};
    bool well[Lanes::count], entered = true;
    for (std::size_t i = 0; i < Lanes::count; ++i) entered &= well[i] = all.walks[i].enter();
    // Series in vain cost time: after a group in which few drives moved, some groups are stepped one by one.
    unsigned moved = 0;
    if (entered && worker.left_alone == 0) {
        moved = all.move(step_, kind(first).laws());
        worker.pause = std::popcount(moved) > 1 ? 0 : std::min(2 * worker.pause + 1, 31);
        worker.left_alone = worker.pause;
    } else if (worker.left_alone > 0) {
        --worker.left_alone;
    }
    for (std::size_t i = 0; i < Lanes::count; ++i) {
        const std::size_t k = first + i;
        DriveWalk& w = all.walks[i];
        ++worker.counts.steps;
        if ((moved >> i & 1u) != 0 || (well[i] && w.finish(step_)))
            keep(k, w, command[k], worker);
        else if (!solve(k, command[k], load_torque[k], nullptr, worker))
            continue;
        end_step(k, load_torque[k]);
    }
}

void DriveBatch::follow_tangents(std::size_t k, const DriveState& from) {
    constexpr double nan = std::numeric_limits<double>::quiet_NaN();
    const TangentWalk& walk = *tangent_walks_[static_cast<std::size_t>(kind_of_[k])];
    for (std::size_t p = 0; p < slopes_.size(); ++p) {
        DriveTangent& tangent = tangents_[p * size() + k];
        if (!walk.carry(sheets_[k], slopes_[p], from, inputs_[2 * k], inputs_[2 * k + 1], step_, drives_[k], tangent))
            tangent = {nan, nan, nan, nan, nan, nan};
    }
}

bool DriveBatch::carry_tangents(const std::vector<std::string>& keys) {
    model::Train first = kinds_[0]->train();
    for (const std::string& key : keys) {
        if (key != backlash && model::find_parameter(first, key) == nullptr) return false;
        DriveSheet slope{};
        slope.backlash = 1.0;
        slopes_.push_back(key == backlash ? slope : sheet_slope(first, key));
    }
    tangents_.resize(slopes_.size() * size());
    for (std::size_t k = 0; k < size(); ++k) sheets_.push_back(sheet_of(train_of(k), half_gap_of(k)));
    make_tangent_walks();
    return true;
}

void DriveBatch::make_tangent_walks() {
    for (std::size_t k = tangent_walks_.size(); k < kinds_.size(); ++k)
        tangent_walks_.push_back(std::make_unique<const TangentWalk>(*kinds_[k]));
}

void DriveBatch::read_tangent(std::size_t parameter, std::size_t state, double* out) const {
    constexpr double DriveTangent::* of[states] = {&DriveTangent::motor_torque, &DriveTangent::motor_speed,
                                                   &DriveTangent::load_speed, &DriveTangent::twist,
                                                   &DriveTangent::load_angle};
    for (std::size_t k = 0; k < size(); ++k) out[k] = tangents_[parameter * size() + k].*of[state];
}

// False: something was not certain.
bool DriveBatch::walk(std::size_t k, double command, double load_torque, LoadAnswer* answer, Worker& worker) {
    DriveWalk walk(kind(k).laws(), numbers(k), drives_[k], command, load_torque);
    if (answer != nullptr) walk.differ(0.0, 1.0);
    if (!walk.advance(step_)) return false;
    if (answer != nullptr)
        *answer = {((walk.x.a - walk.x.v) - (drives_[k].a - drives_[k].v)) / step_, 0.0,
                   (walk.tangent[2] - walk.tangent[1]) / step_};
    keep(k, walk, command, worker);
    return true;
}

void DriveBatch::keep(std::size_t k, const DriveWalk& walk, double command, Worker& worker) {
    drives_[k] = walk.x;
    inputs_[2 * k] = command;
    worker.counts.walked += walk.switchings > 0;
    worker.counts.switchings += walk.switchings;
}

// The same from one sample instant of the controller to the next.
bool DriveBatch::walk_under_control(std::size_t k, double reference, double load_torque, Worker& worker) {
    control::Axis& law = worker.laws[static_cast<std::size_t>(control_of_[k])];
    law.reference.pieces.assign(1, {times_[k], {reference}});
    law.reference.sines.clear();
    const Ticks instants{control(k).tick};
    double* const slot = slots_.data() + slots_at_[k];
    worker.slots.assign(slot, slot + slot_count(k));
    const double end = times_[k] + step_;
    std::int64_t next = instants_[k];
    double command = inputs_[2 * k];
    DriveWalk walk(kind(k).laws(), numbers(k), drives_[k], command, load_torque);
    bool well = true;
    for (double time = times_[k]; well && time != end;) {
        const double instant = instants.time(next);
        if (instants.before(time, instant)) {
            const double until = instants.before(instant, end) ? instant : end;
            well = walk.advance(until - time);
            time = until;
            continue;
        }
        const control::Sampled y = sampled(k, walk, time);
        if (next == 0) law.start(y, instants.length, slot);
        well = law.step(next++, instants.length, y, slot);
        walk.set_command(command = law.command(slot));
    }
    if (well) {
        keep(k, walk, command, worker);
        instants_[k] = next;
    } else {
        std::ranges::copy(worker.slots, slot);
    }
    return well;
}

// What the encoders read, and what the motor gives under its last command.
control::Sampled DriveBatch::sampled(std::size_t k, const DriveWalk& walk, double time) const {
    const ControlledAxis& axis = control(k).axes[0];
    const DriveState& x = walk.x;
    const DriveNumbers& p = numbers(k);
    const double angles[] = {ratio(k) * (x.angle + x.d), x.angle}, speeds[] = {ratio(k) * x.a, x.a - x.v};
    const double torque = kind(k).laws().delays_torque ? x.q : p.stall_torque * walk.command - p.back_torque * x.a;
    return {angles[axis.position_shaft],
            angles[axis.speed_shaft],
            speeds[axis.speed_shaft],
            p.turned * torque,
            angles[0],
            speeds[0],
            angles[axis.reference_shaft],
            time};
}

// The general solver of a drive, which goes on being kept while others need one more.
ScenarioSimulation& DriveBatch::solver(std::size_t k, Worker& worker) const {
    const std::size_t number = each_its_own_ ? k : static_cast<std::size_t>(kind_of_[k]);
    auto kept = std::ranges::find(worker.solvers, number, &Worker::Kept::number);
    if (kept == worker.solvers.end()) {
        if (worker.solvers.size() == most_solvers)
            worker.solvers.erase(std::ranges::min_element(worker.solvers, {}, &Worker::Kept::used));
        worker.solvers.push_back(
            {number, 0, std::make_unique<ScenarioSimulation>(stepped_scenario(train_of(k), control(k)), step_)});
        kept = worker.solvers.end() - 1;
    }
    kept->used = ++worker.clock;
    return *kept->simulation;
}

// Where the general solver has the state of a drive, as it is now.
void DriveBatch::give_state(std::size_t k, ScenarioSimulation& simulation, Worker& worker) const {
    const model::Assembly& a = simulation.train().assembly();
    const model::Layout& n = a.layout();
    const model::Places& places = a.places();
    const model::GearPlace& gear = places.gears[0];
    const DriveNumbers& p = numbers(k);
    const int limit = places.motors[0].branch;
    const DriveState& x = drives_[k];
    MotionState& s = worker.state;
    s.clear();
    s.time = times_[k];
    s.x.resize(static_cast<std::size_t>(n.states));
    s.memory.resize(static_cast<std::size_t>(n.memory));
    s.input.assign(inputs_.begin() + static_cast<std::ptrdiff_t>(2 * k),
                   inputs_.begin() + static_cast<std::ptrdiff_t>(2 * k) + n.inputs);
    s.control.next = instants_[k];
    if (instants_[k] > 0)
        s.control.slots.assign(slots_.begin() + static_cast<std::ptrdiff_t>(slots_at_[k]),
                               slots_.begin() + static_cast<std::ptrdiff_t>(slots_at_[k + 1]));
    each_number(a, p.turned, s, x, [](auto& there, auto here, int sign) {
        there = static_cast<std::decay_t<decltype(there)>>(sign * here);
    });
    at(s.x, places.shafts[0].speed) = ratio(k) * x.a;
    at(s.x, places.shafts[1].speed) = x.a - x.v;
    s.started = x.known;
    if (x.known) {
        if (gear.piece != model::nowhere)
            at(s.key.branch, gear.piece) = static_cast<std::int16_t>(x.piece - kind(k).laws().zero);
        if (limit != model::nowhere)
            at(s.key.branch, limit) = static_cast<std::int16_t>(inputs_[2 * k] > p.command_limit) -
                                      static_cast<std::int16_t>(inputs_[2 * k] < -p.command_limit);
        s.rate_input = s.input;
    } else if (gear.contact != model::nowhere && gear.twist != model::nowhere) {
        if (const int locked = at(places.contacts, gear.contact).locked; locked != model::nowhere)
            at(s.memory, locked) = a.train().gears[0].law.curve.torque(x.d);
    }
    simulation.motion().restore(s);
}

// By the general solver. False: the motion cannot go on.
bool DriveBatch::solve(std::size_t k, double command, double load_torque, LoadAnswer* answer, Worker& worker) {
    ++worker.counts.general;
    ScenarioSimulation& simulation = solver(k, worker);
    give_state(k, simulation, worker);
    const std::array<double, 2> both{controlled() ? load_torque : command, controlled() ? command : load_torque};
    const Status status = answer == nullptr
                              ? simulation.advance(step_, both, both)
                              : simulation.answer(step_, both, both, *simulation.train().load_shaft(1), *answer);
    if (status != Status::done) {
        worker.failure.add({k, simulation.text(status)});
        return false;
    }
    const model::Assembly& a = simulation.train().assembly();
    const model::Places& places = a.places();
    const model::GearPlace& gear = places.gears[0];
    DriveState& x = drives_[k];
    MotionState& s = worker.state;
    simulation.motion().save(s);
    x.known = true;
    each_number(a, numbers(k).turned, s, x, [](auto there, auto& here, int sign) {
        here = static_cast<std::decay_t<decltype(here)>>(sign * there);
    });
    x.a = at(s.x, places.shafts[0].speed) / ratio(k);
    x.v = x.a - at(s.x, places.shafts[1].speed);
    if (gear.piece != model::nowhere) x.piece = static_cast<short>(at(s.key.branch, gear.piece) + kind(k).laws().zero);
    if (gear.contact != model::nowhere && x.twist == 0) x.v = 0.0;
    inputs_[2 * k] = controlled() ? s.input[0] : command;
    instants_[k] = s.control.next;
    std::ranges::copy(s.control.slots, slots_.begin() + static_cast<std::ptrdiff_t>(slots_at_[k]));
    return true;
}

void DriveBatch::reset(const bool* which, const double* start) {
    for (std::size_t k = 0; k < size(); ++k) {
        if (which != nullptr && !which[k]) continue;
        DriveState& x = drives_[k] = {};
        inputs_[2 * k] = inputs_[2 * k + 1] = times_[k] = 0.0;
        instants_[k] = 0;
        for (std::size_t p = 0; p < slopes_.size(); ++p) tangents_[p * size() + k] = {};
        std::fill_n(slots_.begin() + static_cast<std::ptrdiff_t>(slots_at_[k]), slot_count(k), 0.0);
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
    instants_ = s.instants;
    times_ = s.times;
    slots_ = s.slots;
    tangents_ = s.tangents;
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

void DriveBatch::read_variable(std::size_t variable, double* out) {
    if (workers_.empty()) add_worker();
    Worker& worker = *workers_[0];
    worker.values.resize(variables().size());
    for (std::size_t k = 0; k < size(); ++k) {
        if (variable >= variables().first_shown()) {
            const int signal = variables().shown()[variable - variables().first_shown()].signal;
            out[k] = control::Axis::signal(signal, slots_.data() + slots_at_[k]);
            continue;
        }
        ScenarioSimulation& simulation = solver(k, worker);
        give_state(k, simulation, worker);
        out[k] = simulation.read(worker.values.data()) == Status::done ? worker.values[variable] : 0.0;
    }
}

std::size_t DriveBatch::memory() const {
    const std::size_t each = sizeof(DriveState) + 2 * sizeof(int) + sizeof(std::size_t) + sizeof(std::int64_t) +
                             (3 + states + own_.size()) * sizeof(double);
    return size() * each + numbers_.size() * sizeof(DriveNumbers) + slots_.size() * sizeof(double) +
           tangents_.size() * sizeof(DriveTangent) + sheets_.size() * sizeof(DriveSheet);
}

}  // namespace lostmotion::batch
