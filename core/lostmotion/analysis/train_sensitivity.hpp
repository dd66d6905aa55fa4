// Derivatives of a run of a train with respect to parameters of it, of its inputs and of its start, exact through
// switchings (docs/theory.md, sensitivities).
//
// Within a regime dw/dp is propagated beside w. Where a guard g falls through zero at t*, and what is set anew is
// R(y, p, t), the components y become (Leine and Nijmeijer 2004)
//     dy+/dp = R_y dy/dp + R_p + (R_y f_before + R_t - f_after) dt*/dp,   dt*/dp = -(g_y dy/dp + g_p)/g'.
#pragma once

#include <limits>
#include <string>
#include <vector>

#include "reset_tangent.hpp"
#include "tick_tangent.hpp"

namespace lostmotion {

// What is asked for, and where it goes.
struct SensitivityOutput {
    double interval = 1e-3;      // [s]
    std::size_t samples = 0;     // at k * interval
    std::vector<int> channels;   // by their place among TrainRun::channels()
    double* out = nullptr;       // parameters x channels x samples; NaN from where the motion is not smooth
    double* axes_out = nullptr;  // parameters x (axes x signals) x samples, as TrainOptions::control_out

    double ends_at = std::numeric_limits<double>::infinity();  // [s] from where it is not, and why
    std::string ends_by;
};

template <class D>
class TrainSensitivity final : public TrainWatcher<D> {
 public:
    using System = model::TrainSystem<D>;
    using State = StateOf<D>;
    using Memory = typename D::Memory;

    TrainSensitivity(const VariedTrain& trains, const InputTangents& inputs, RegimeTangents& regimes,
                     const std::vector<Variation>& variations, const TrainStart& start, const Control& control,
                     SensitivityOutput& output)
        : trains_(trains),
          inputs_(inputs),
          regimes_(regimes),
          form_(trains.base().layout(), inputs),
          resets_(trains, form_, inputs.parameters()),
          system_(trains.base()),
          laws_(system_),
          ticks_(inputs.parameters(), variations, control),
          output_(output),
          n_(trains.base().layout()),
          parameters_(inputs.parameters()),
          w_(static_cast<std::size_t>(inputs.size())),
          derivative_(w_.size() * static_cast<std::size_t>(parameters_)) {
        begin_at(variations, start);
    }

    void begin(ExactSolver<System>& solver) override { solver_ = &solver; }
    void finish(const ClosedLoop<D>& loop) override { read_signals(loop, std::numeric_limits<double>::infinity()); }

    void segment(const Segment<System>& s) override {
        if (begun_ && s.memory != memory_) set_without_switching(s);
        enter(s.entry.regime);
        set_states(s.at.x(), s.memory);
        if (!begun_) begin_motion(s.memory);
        begun_ = true;
        time_ = s.begin;
        see_inputs(time_, false);
        if (!tangent_->propagator.ready()) regimes_.prepare(*tangent_, s.entry.propagator.length(0));
        for (; next_ < output_.samples && is_due(s, instant(next_)); ++next_) {
            advance(instant(next_));
            read(next_);
        }
        advance(s.end);
        set_states(s.x_end, s.memory);
    }

    void switching(const SwitchingOf<System>& w) override {
        const std::array<InputsOf<D>, 2> before = inputs();
        std::vector<double> left_w = w_, left = derivative_, shift(static_cast<std::size_t>(parameters_));
        const typename System::Regime& old = *regime_;
        const RegimeTangent& old_tangent = *tangent_;
        if (w.guard >= 0) {
            if (!find_shift(w, before[1], shift.data())) end(w, "a condition that it only touches");
        } else if (!inputs_.shift_of_breakpoint(w.time, shift.data())) {
            end(w, "inputs that jump together, at instants of different parameters");
        }
        const State x = state();
        const Memory memory = memory_;
        see_inputs(w.time, w.guard >= 0);
        const std::array<InputsOf<D>, 2> after = inputs();
        const auto& next = solver_->regime(w.after);
        const ResetOf<System> r{w, old, next, x, memory, before, after};
        auto jump = JacobianOf<D>::identity();
        const ResetRatesOf<D> rates = laws_.reset(r, jump);
        if (!rates.exact) end(w, "a torque at rest that comes to lie where contacts let it");
        std::vector<double> set_anew(derivative_.size());
        reset(r, old_tangent, left_w.data(), left.data(), set_anew.data());
        apply(jump, rates, r, left.data(), shift.data(), set_anew.data());
    }

    void tick(const ClosedLoop<D>& loop, const ControlCourse& course, const State& x, const Memory& memory) override {
        if (!begun_) set_states(x, memory);
        read_signals(loop, loop.ticks.time(course.next));
        ticks_.template step<D>(loop, course, form_, trains_, w_.data(), derivative_.data());
        if (!ticks_.error().empty() && output_.ends_by.empty()) {
            output_.ends_at = loop.ticks.time(course.next);
            output_.ends_by = ticks_.error();
        }
    }

 private:
    using ComponentsRow = ComponentsOf<D>;

    double* row(int k) { return derivative_.data() + k * parameters_; }
    double instant(std::size_t k) const { return static_cast<double>(k) * output_.interval; }
    static bool is_due(const Segment<System>& s, double t) {
        return t < s.end || (s.last && t <= s.end * (1.0 + 4.0 * std::numeric_limits<double>::epsilon()));
    }
    bool ended() const { return !output_.ends_by.empty(); }
    void end(const SwitchingOf<System>& w, const char* why) {
        if (ended()) return;
        output_.ends_at = w.time;
        output_.ends_by = why;
        if (w.guard >= 0 && w.contact >= 0) output_.ends_by += ": " + model::contact_name(trains_.base(), w.contact);
    }

    // A tick after which everything rests as before, at other torques: no switching is shown.
    void set_without_switching(const Segment<System>& s) {
        SwitchingOf<System> w;
        w.time = s.begin;
        w.input_jump = true;
        w.before = w.after = s.entry.regime.key;
        w.x = s.at.x();
        w.memory = s.memory;
        switching(w);
    }

    // Place of a component of the kernel in w, or -1.
    int place(int component) const {
        if (component < D::coupled) return component < n_.coupled ? component : -1;
        if (component < D::states) return component - D::coupled < n_.angles ? n_.coupled + component - D::coupled : -1;
        return component - D::states < n_.memory ? n_.first_memory + component - D::states : -1;
    }
    void set_states(const State& x, const Memory& memory) {
        memory_ = memory;
        model::unpack_state<D>(x, n_, w_.begin());
        std::copy_n(memory.begin(), n_.memory, w_.begin() + n_.first_memory);
    }
    State state() const {
        State x{};
        std::copy_n(w_.begin(), n_.coupled, x.begin());
        std::copy_n(w_.begin() + n_.coupled, n_.angles, x.begin() + D::coupled);
        return x;
    }
    void see_inputs(double t, bool left) {
        inputs_.fill(t, left, w_.data(), derivative_.data());
        ticks_.hold(inputs_, w_.data(), derivative_.data());
    }
    // Values and rates.
    std::array<InputsOf<D>, 2> inputs() const {
        std::array<InputsOf<D>, 2> u{};
        for (int i = 0; i < n_.inputs; ++i) {
            u[0][i] = form_.value(model::Row::unit(n_.first_input + i), w_.data());
            u[1][i] = inputs_.rate(i, w_.data());
        }
        return u;
    }
    void enter(const typename System::Regime& r) {
        regime_ = &r;
        tangent_ = &regimes_(r.key, r.rows);
        if (!tangent_->alike && !ended()) {
            output_.ends_at = time_;
            output_.ends_by = "a regime that has other conditions beside the value of a parameter";
        }
    }
    void advance(double to) {
        tangent_->propagator.advance(w_.data(), derivative_.data(), to - time_);
        time_ = to;
    }

    void begin_at(const std::vector<Variation>& variations, const TrainStart& start) {
        const auto [x, memory] = in_layout(trains_.base(), start);
        auto beside = trains_.beside().begin();
        for (int p = 0; p < parameters_; ++p)
            for (const Neighbour& n : variations[static_cast<std::size_t>(p)].neighbours) {
                const model::Assembly& a = n.train ? (*beside++)->assembly : trains_.base();
                const auto [x_n, memory_n] = in_layout(a, n.start ? *n.start : start);
                for (std::size_t k = 0; k < x.size(); ++k) row(static_cast<int>(k))[p] += n.weight * (x_n[k] - x[k]);
                for (std::size_t k = 0; k < memory.size(); ++k)
                    row(n_.first_memory + static_cast<int>(k))[p] += n.weight * (memory_n[k] - memory[k]);
            }
        start_memory_ = memory;
    }
    // What the search for the first regime has set: torques that the motion leaves open.
    void begin_motion(const Memory& memory) {
        see_inputs(0.0, false);
        const model::Regime& r = tangent_->regime;
        for (int c = 0; c < n_.contacts; ++c)
            if (r.at_rest[static_cast<std::size_t>(c)] && sets_in_motion(c) && !ended()) {
                output_.ends_at = 0.0;
                output_.ends_by = "a contact at rest that a parameter sets in motion at the start: " +
                                  model::contact_name(trains_.base(), c);
            }
        const auto& contacts = trains_.base().places().contacts;
        for (std::size_t c = contacts.size(); c-- > 0;) {
            const int locked = contacts[c].locked;
            if (locked == model::nowhere || !r.ties.redundant[c]) continue;
            const double now = memory[static_cast<std::size_t>(locked)],
                         given = start_memory_[static_cast<std::size_t>(locked)];
            if (std::fabs(now - given) <= rounding * std::fabs(given)) continue;
            const int limit = laws_.limit_of(c, *regime_, state(), memory, inputs()[0]);
            if (limit >= 0)
                resets_.at_limit(n_.first_memory + locked, r.guards[static_cast<std::size_t>(limit)].form,
                                 tangent_->guard, limit, w_.data(), derivative_.data(), derivative_.data());
        }
    }

    bool sets_in_motion(int contact) const {
        const model::Row speed = trains_.base().contact_speed(contact);
        std::vector<double> change(static_cast<std::size_t>(parameters_)), size = change;
        form_.add_motion(speed, derivative_.data(), 1.0, change.data());
        for (const auto& b : trains_.beside())
            change[static_cast<std::size_t>(b->parameter)] +=
                b->weight *
                (form_.value(b->assembly.contact_speed(contact), w_.data()) - form_.value(speed, w_.data()));
        for (int k = 0; k < n_.states; ++k)
            for (int p = 0; p < parameters_; ++p)
                size[static_cast<std::size_t>(p)] += std::fabs(
                    speed.c[static_cast<std::size_t>(k)] * derivative_[static_cast<std::size_t>(k * parameters_ + p)]);
        for (std::size_t p = 0; p < change.size(); ++p)
            if (std::fabs(change[p]) > 1e-6 * size[p]) return true;
        return false;
    }

    // By how much the instant shifts at which a guard falls through zero. False if it only touches it.
    bool find_shift(const SwitchingOf<System>& w, const InputsOf<D>& input_rate, double* shift) const {
        const model::Regime& r = tangent_->regime;
        const model::Row& g = r.guards[static_cast<std::size_t>(w.guard)].form;
        double fall = 0.0, noise = 0.0;
        const auto add = [&](int term, double rate) {
            fall += g.c[static_cast<std::size_t>(term)] * rate;
            noise += std::fabs(g.c[static_cast<std::size_t>(term)] * rate);
        };
        for (int k = 0; k < n_.states; ++k) add(k, form_.value(r.rate[static_cast<std::size_t>(k)], w_.data()));
        for (int i = 0; i < n_.inputs; ++i) add(n_.first_input + i, input_rate[i]);
        if (!(fall < -rounding * noise)) return false;
        form_.add_own(tangent_->guard, w.guard, w_.data(), -1.0 / fall, shift);
        form_.add_motion(g, derivative_.data(), -1.0 / fall, shift);
        return true;
    }

    // R_p, where w_ has the inputs of after the switching.
    void reset(const ResetOf<System>& r, const RegimeTangent& old, const double* left_w, const double* left,
               double* to) {
        const SwitchingOf<System>& w = r.switching;
        const model::Assembly& a = trains_.base();
        std::array<std::int8_t, model::max_contacts> modes{};
        for (int c = 0; c < n_.contacts; ++c) modes[static_cast<std::size_t>(c)] = r.before.at_rest[c] ? 0 : 1;
        if (w.guard >= 0 && w.kind == model::Guard::speed) modes[static_cast<std::size_t>(w.contact)] = 0;
        resets_.tied_speeds(modes.data(), left_w, to);
        const model::Ties now =
            model::tie(a.places().contacts, static_cast<int>(a.train().shafts.size()), modes.data());
        for (std::size_t g = 0; g < a.places().gears.size(); ++g) {
            const model::GearPlace& p = a.places().gears[g];
            if (p.hysteresis == model::nowhere || r.before.at_rest[p.contact]) continue;
            if (model::kept_at_rest(a.places().contacts[static_cast<std::size_t>(p.contact)], now))
                resets_.capacity(g, left_w[p.twist], to);
        }
        if (w.guard >= 0) resets_.turn(old, static_cast<std::size_t>(w.guard), to);
        enter(r.after);
        set_states(w.x, w.memory);
        for (std::size_t c = a.places().contacts.size(); c-- > 0;) {
            const model::ContactPlace& contact = a.places().contacts[c];
            if (contact.locked == model::nowhere || !tangent_->regime.ties.redundant[c]) continue;
            const int row = n_.first_memory + contact.locked;
            const auto at = laws_.locked_at(c, r);
            if (at.was != nullptr) {
                const bool gear = contact.kind == model::ContactPlace::gear;
                const int index = gear ? contact.element : static_cast<int>(c);
                const auto& was = gear ? old.regime.output_torque : old.regime.contact_torque;
                resets_.kept(row, was[static_cast<std::size_t>(index)], gear ? old.output_torque : old.contact_torque,
                             index, left_w, left, to);
            } else if (at.limit >= 0) {
                resets_.at_limit(row, tangent_->regime.guards[static_cast<std::size_t>(at.limit)].form, tangent_->guard,
                                 at.limit, w_.data(), derivative_.data(), to);
            }
        }
    }

    void apply(const JacobianOf<D>& jump, const ResetRatesOf<D>& rates, const ResetOf<System>& r, const double* left,
               const double* shift, const double* set_anew) {
        ComponentsRow before{}, after{};
        for (int c = 0; c < D::states; ++c)
            if (const int k = place(c); k >= 0) {
                before[c] = evaluate<D>(r.before.rate[c], r.x, r.memory, r.input[0]);
                after[c] = evaluate<D>(r.after.rate[c], r.switching.x, r.switching.memory, r.input_after[0]);
            }
        for (int c = 0; c < component_count<D>; ++c) {
            const int k = place(c);
            if (k < 0) continue;
            double* to = row(k);
            std::copy_n(set_anew + k * parameters_, parameters_, to);
            double gap = rates.by_time[c] - after[c];
            for (int j = 0; j < component_count<D>; ++j) {
                const double share = jump.row[c][j];
                if (share == 0.0 || place(j) < 0) continue;
                add_scaled(to, share, left + place(j) * parameters_, parameters_);
                gap += share * before[j];
            }
            if (gap != 0.0) add_scaled(to, gap, shift, parameters_);
        }
    }

    void read(std::size_t sample) {
        const std::vector<int>& all = output_.channels;
        std::vector<double> value(static_cast<std::size_t>(parameters_));
        for (std::size_t c = 0; c < all.size(); ++c) {
            std::fill(value.begin(), value.end(), 0.0);
            if (const auto& f = tangent_->channel[c]; f) {
                form_.add_own(tangent_->channel_varied, static_cast<int>(c), w_.data(), 1.0, value.data());
                form_.add_motion(*f, derivative_.data(), 1.0, value.data());
            }
            if (const int g = shared(regimes_.channels()[c]); g >= 0)
                add_shared(static_cast<std::size_t>(g), value.data());
            for (std::size_t p = 0; p < value.size(); ++p)
                output_.out[(p * all.size() + c) * output_.samples + sample] =
                    ended() ? std::numeric_limits<double>::quiet_NaN() : value[p];
        }
    }

    // Of an input torque: its gear, if its input shaft is at rest and what that holds is shared by what is dry there;
    // -1.
    int shared(const TrainChannel& c) const {
        if (c.kind != TrainChannel::input_torque) return -1;
        const model::Gear& gear = trains_.base().train().gears[static_cast<std::size_t>(c.index)];
        const int contact = trains_.base().places().shafts[static_cast<std::size_t>(gear.input)].contact;
        return gear.has_dry_losses() && tangent_->regime.key.modes[static_cast<std::size_t>(contact)] == 0 ? c.index
                                                                                                           : -1;
    }
    // What the contact of the input shaft holds is shared as the capacities are, T_1 + F l/C; see TrainReader. to: the
    // derivatives of T_1.
    void add_shared(std::size_t g, double* to) const {
        const model::Train& train = trains_.base().train();
        const model::Gear& gear = train.gears[g];
        const model::Regime& r = tangent_->regime;
        const int contact = trains_.base().places().shafts[static_cast<std::size_t>(gear.input)].contact;
        const model::Row &friction = r.contact_torque[static_cast<std::size_t>(contact)], &output = r.output_torque[g];
        const double F = form_.value(friction, w_.data()), T_2 = form_.value(output, w_.data());
        const int s = F >= 0.0 ? 1 : -1;
        std::size_t margin = 0;
        while (r.guards[margin].kind != model::Guard::capacity || r.guards[margin].contact != contact ||
               (r.guards[margin].neighbour > 0) != (s > 0))
            ++margin;
        const double C = form_.value(r.guards[margin].form, w_.data()) + s * F;
        if (!(C > 0.0)) return;
        const model::MeshLoss loss = gear.loss(s * T_2, 0.0);
        const double l = loss.torque / gear.law.ratio, own = F * l / (C * C);
        const double by_friction = l / C - s * own, by_output = F * s * loss.per_torque / (gear.law.ratio * C);
        form_.add_own(tangent_->contact_torque, contact, w_.data(), by_friction, to);
        form_.add_motion(friction, derivative_.data(), by_friction, to);
        form_.add_own(tangent_->output_torque, static_cast<int>(g), w_.data(), by_output, to);
        form_.add_motion(output, derivative_.data(), by_output, to);
        form_.add_own(tangent_->guard, static_cast<int>(margin), w_.data(), -own, to);
        form_.add_motion(r.guards[margin].form, derivative_.data(), -own, to);
        for (const auto& b : trains_.beside()) {
            const model::Gear& other = b->assembly.train().gears[g];
            to[b->parameter] += b->weight * F / C * (other.loss(s * T_2, 0.0).torque / other.law.ratio - l);
        }
    }

    // What the controllers have shown until a time.
    void read_signals(const ClosedLoop<D>& loop, double until) {
        if (output_.axes_out == nullptr) return;
        for (; next_signal_ < output_.samples && instant(next_signal_) < until; ++next_signal_) {
            double* to = output_.axes_out + next_signal_;
            for (int p = 0; p < parameters_; ++p) {
                int first = 0;
                for (const control::Axis& a : loop.axes) {
                    for (int s = 0; s < control::n_axis_signals; ++s, to += output_.samples)
                        *to = ended() ? std::numeric_limits<double>::quiet_NaN() : ticks_.signal(first, s)[p];
                    first += a.slots();
                }
            }
        }
    }

    const VariedTrain& trains_;
    const InputTangents& inputs_;
    RegimeTangents& regimes_;
    FormTangent form_;
    ResetTangent resets_;
    const System system_;
    const ComponentLaws<System> laws_;
    TickTangent ticks_;
    SensitivityOutput& output_;
    const model::Layout& n_;
    int parameters_;
    std::vector<double> w_, derivative_;  // w; its derivatives, those of one entry together
    std::vector<double> start_memory_;
    Memory memory_{};
    ExactSolver<System>* solver_ = nullptr;
    const typename System::Regime* regime_ = nullptr;
    RegimeTangent* tangent_ = nullptr;
    double time_ = 0.0;
    std::size_t next_ = 0, next_signal_ = 0;
    bool begun_ = false;
};

}  // namespace lostmotion
