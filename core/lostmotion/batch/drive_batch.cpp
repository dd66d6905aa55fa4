#include "drive_batch.hpp"

#include <algorithm>

#include "../model/drive_train.hpp"
#include "../simulation/train_status.hpp"
#include "walk.hpp"

namespace lostmotion::batch {

namespace {

constexpr std::size_t most_solvers = 64;  // that a thread keeps
constexpr std::size_t ahead = 4;          // drives whose tables are fetched

}  // namespace

model::Train Models::train(std::size_t m) const {
    model::Train t = bases[static_cast<std::size_t>(base[m])];
    const double* values = row(m);
    for (const std::string& key : keys) *model::find_parameter(t, key) = *values++;
    if (curve_breaks >= 0) {
        const double *slopes = values + curve_breaks, *end = slopes + curve_breaks + 1;
        t.gears[0].law.curve = TorsionCurve({values, slopes}, {slopes, end});
    }
    return t;
}

int Models::place(const char* key) const {
    const auto at = std::ranges::find(keys, key);
    return at == keys.end() ? -1 : static_cast<int>(at - keys.begin());
}

// What a thread keeps: general solvers of some models.
struct DriveBatch::Worker {
    struct Kept {
        std::size_t model;
        long used;
        std::unique_ptr<TrainSimulation> simulation;
    };
    std::vector<Kept> solvers;
    long clock = 0;
    Counts counts;
    Failure failure;
    MotionState state;  // its memory is used again

    TrainSimulation& solver(const Models& models, std::size_t model, double step) {
        ++clock;
        for (Kept& k : solvers)
            if (k.model == model) {
                k.used = clock;
                return *k.simulation;
            }
        if (solvers.size() == most_solvers) solvers.erase(std::ranges::min_element(solvers, {}, &Kept::used));
        solvers.push_back({model, clock, std::make_unique<TrainSimulation>(models.train(model), step)});
        return *solvers.back().simulation;
    }
};

std::string DriveBatch::error(const model::Train& train) {
    const TrainRun run(train);
    if (!run.error().empty()) return run.error();
    if (!model::is_drive(train) || !sizes_of<D>.hold(train, run.assembly().layout()) ||
        run.assembly().layout().branches > Label::max_branches)
        return "is more than a motor, a gearbox with torsion curve and losses, and a load with plain friction";
    return "";
}

DriveBatch::DriveBatch(Models models, std::vector<int> model_of, double step)
    : models_(std::move(models)),
      model_of_(std::move(model_of)),
      step_(step),
      drives_(model_of_.size()),
      inputs_(model_of_.size()),
      states_(model_of_.size() * D::states),
      tables_(models_.size()),
      rated_output_torque_(models_.place("gearbox.rated_output_torque")),
      rated_input_speed_(models_.place("gearbox.rated_input_speed")) {}

DriveBatch::~DriveBatch() = default;

RegimeTable* DriveBatch::find(std::size_t model, const Label& label) const {
    RegimeTable* t = tables_[model].load(std::memory_order_acquire);
    while (t != nullptr && !(t->label == label)) t = t->next;
    return t;
}

// Two threads may make the same table, with the same numbers; the first one stays.
RegimeTable* DriveBatch::table(std::size_t model, const Label& label, Worker& worker) {
    if (RegimeTable* known = find(model, label)) return known;
    const Tabulated made = tabulate(worker.solver(models_, model, step_).assembly(), label, step_);
    const std::lock_guard lock(adding_);
    if (RegimeTable* known = find(model, label)) return known;
    RegimeTable* added = store_.add(made, tables_[model].load(std::memory_order_relaxed));
    tables_[model].store(added, std::memory_order_release);
    return added;
}

Failure DriveBatch::step(const Input& command, const Input& load_torque, unsigned threads) {
    while (workers_.size() < Team::needed(size(), threads)) workers_.push_back(std::make_unique<Worker>());
    team_.share(size(), threads, [&](std::size_t begin, std::size_t end, std::size_t who) {
        step_range(begin, end, command, load_torque, *workers_[who]);
    });
    Failure first;
    for (const auto& w : workers_) {
        counts_ += std::exchange(w->counts, {});
        first.add(std::exchange(w->failure, {}));
    }
    return first;
}

// Fetches what the drives that follow read into the cache: tables, and after them what these share.
[[gnu::always_inline]] inline void DriveBatch::fetch(std::size_t k, std::size_t end) const {
    const auto lines = [](const void* from, std::size_t bytes) ALWAYS_INLINE {
        for (std::size_t at = 0; at < bytes; at += 64) __builtin_prefetch(static_cast<const char*>(from) + at);
    };
    if (k + 2 * ahead < end && drives_[k + 2 * ahead].regime != nullptr)
        lines(drives_[k + 2 * ahead].regime, sizeof(RegimeTable) + 2 * sizeof(Column));
    if (k + ahead < end && drives_[k + ahead].regime != nullptr && drives_[k + ahead].regime->plain())
        lines(drives_[k + ahead].regime->shared, sizeof(SharedTable) + 6 * sizeof(Column));
}

void DriveBatch::step_range(std::size_t begin, std::size_t end, const Input& command, const Input& load_torque,
                            Worker& worker) {
    struct Known final : Regimes {
        Known(DriveBatch& batch, Worker& worker) : batch_(batch), worker_(worker) {}
        RegimeTable* at(const Label& label) override { return batch_.table(model, label, worker_); }
        void locate_losses(Label& label, const RegimeDetails& of, double T_2, double speed) const override {
            const Models& all = batch_.models_;
            const model::Gear& gear = all.bases[static_cast<std::size_t>(all.base[model])].gears[0];
            const int s = label.modes[static_cast<std::size_t>(of.input_contact)];
            const double rated =
                gear.efficiencies ? 1.0 : all.number(model, batch_.rated_output_torque_, gear.law.rated_output_torque);
            const double rated_speed = all.number(model, batch_.rated_input_speed_, gear.law.rated_input_speed);
            const auto cells = gear.loss_cells(s, gear.sense() * T_2 / rated, speed, rated_speed);
            label.branch[static_cast<std::size_t>(of.cell)] = cells[0];
            label.branch[static_cast<std::size_t>(of.cell_back)] = cells[1];
        }
        std::size_t model = 0;

     private:
        DriveBatch& batch_;
        Worker& worker_;
    } known(*this, worker);
    const double h = step_;
    const std::size_t n = drives_.size();
    double* out = states_.data();
    for (std::size_t k = begin; k < end; ++k) {
        DriveState& d = drives_[k];
        const Inputs u{command[k], load_torque[k]};
        const RegimeTable* r = d.regime;
        fetch(k, end);
        ++worker.counts.steps;
        bool done = false;
        if (r != nullptr && r->plain()) [[likely]] {
            const Four x = Four::load(d.x.data());
            const SharedTable& t = *r->shared;
            const Forms rates = r->rates();
            const Four rate = rates.of_state(x) + rates.constant(d.memory, u);
            const Four to = x + t.G * rate, size = absolute(rate);
            bool clear = true;
            for (int b = 0; b < t.n_blocks; ++b) {
                const Forms g = r->guards(b);
                const Four constant = g.constant(d.memory, u);
                const Four first = constant + g.of_state(x), last = constant + g.of_state(to);
                const Four apart = sum_in_fours<D::coupled>(
                    [&](auto j) ALWAYS_INLINE { return size.template spread<j>() * t.departure(b, j); });
                clear = clear && above(least_of(first, last), apart) == 15u;
            }
            if (clear) [[likely]] {
                const double angle = d.x[D::coupled] +
                                     t.angle_coefficient * (h * d.x[static_cast<std::size_t>(t.angle_speed)]) +
                                     (load<D>(t.angle) * rate).sum();
                to.store(d.x.data());
                d.x[D::coupled] = angle;
                done = true;
            } else {
                known.model = static_cast<std::size_t>(model_of_[k]);
                Walk walk(known, d, u);
                if (walk.over(h)) {
                    walk.store(d);
                    ++worker.counts.walked;
                    worker.counts.switchings += walk.switchings();
                    done = true;
                }
            }
        }
        if (!done && !solve(k, u, worker)) continue;
        inputs_[k] = u;
        for (std::size_t s = 0; s < D::states; ++s) out[s * n + k] = d.x[s];
    }
}

// By the general solver. False: the motion cannot go on.
bool DriveBatch::solve(std::size_t k, const Inputs& u, Worker& worker) {
    ++worker.counts.general;
    DriveState& d = drives_[k];
    const auto model = static_cast<std::size_t>(model_of_[k]);
    TrainSimulation& simulation = worker.solver(models_, model, step_);
    const model::Assembly& a = simulation.assembly();
    const model::Layout& n = a.layout();
    MotionState& s = worker.state;
    s.clear();
    s.x.resize(static_cast<std::size_t>(n.states));
    model::unpack_state<D>(d.x, n, s.x.begin());
    s.memory.assign(d.memory.begin(), d.memory.begin() + n.memory);
    if (d.regime != nullptr) {
        s.started = true;
        s.key = d.regime->label.key();
        s.rate_input.assign(inputs_[k].begin(), inputs_[k].begin() + n.inputs);
    } else {
        const model::GearPlace& gear = a.places().gears[0];
        const int locked = gear.contact == model::nowhere
                               ? model::nowhere
                               : a.places().contacts[static_cast<std::size_t>(gear.contact)].locked;
        if (locked != model::nowhere && gear.twist != model::nowhere)
            s.memory[static_cast<std::size_t>(locked)] =
                a.train().gears[0].law.curve.torque(d.x[static_cast<std::size_t>(gear.twist)]);
    }
    simulation.motion().restore(s);
    const auto inputs = std::span(u).first(static_cast<std::size_t>(n.inputs));
    const Status status = simulation.motion().advance(step_, inputs, inputs);
    if (status != Status::done) {
        const Motion& m = simulation.motion();
        worker.failure.add({k, train_status_text(a, status, m.time(), m.stopped_at(), m.too_many_guards())});
        return false;
    }
    simulation.motion().save(s);
    const auto to = model::packed_start<D>(n, s.x, s.memory);
    std::ranges::copy(to.x, d.x.begin());
    d.memory = to.memory;
    d.regime = table(model, Label::of(s.key), worker);
    return true;
}

void DriveBatch::reset(const bool* which, const double* start) {
    for (std::size_t k = 0; k < drives_.size(); ++k) {
        if (which != nullptr && !which[k]) continue;
        drives_[k] = {};
        if (start != nullptr) std::copy_n(start + k * D::states, D::states, drives_[k].x.begin());
        inputs_[k] = {};
        show(k);
    }
}

void DriveBatch::restore(const Snapshot& s) {
    drives_ = s.drives;
    inputs_ = s.inputs;
    for (std::size_t k = 0; k < drives_.size(); ++k) show(k);
}

void DriveBatch::read(double* out, Coefficients RegimeDetails::* form, double RegimeTable::* constant) const {
    for (std::size_t k = 0; k < drives_.size(); ++k) {
        const DriveState& d = drives_[k];
        out[k] = 0.0;
        if (d.regime == nullptr) continue;
        StateOf<D> x;
        std::ranges::copy(d.x, x.begin());
        out[k] = value_of((*d.regime->details).*form, (*d.regime).*constant, x, d.memory, inputs_[k]);
    }
}

void DriveBatch::read_contact(std::int8_t* out, std::int8_t RegimeDetails::* contact) const {
    for (std::size_t k = 0; k < drives_.size(); ++k) {
        const RegimeTable* r = drives_[k].regime;
        const int number = r == nullptr ? -1 : (*r->details).*contact;
        out[k] = number < 0 ? 0 : r->label.modes[static_cast<std::size_t>(number)];
    }
}

std::size_t DriveBatch::memory() const {
    std::size_t bytes =
        drives_.size() * (sizeof(DriveState) + sizeof(Inputs) + sizeof(int) + D::states * sizeof(double));
    bytes += models_.size() * (models_.width() * sizeof(double) + sizeof(int) + sizeof(tables_[0]));
    return bytes + store_.memory();
}

}  // namespace lostmotion::batch
