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

#include "lostmotion/analysis/reset_tangent.hpp"
#include "lostmotion/analysis/sample_tangent.hpp"
#include "lostmotion/analysis/sensitive_run.hpp"
#include "lostmotion/analysis/start_tangent.hpp"
#include "lostmotion/analysis/tick_tangent.hpp"
#include "train_solving.hpp"

namespace lostmotion {

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
          samples_(trains, form_, regimes),
          resets_(trains, form_, inputs.parameters()),
          system_(trains.base()),
          laws_(system_),
          locked_(system_),
          ticks_(inputs.parameters(), variations, control),
          output_(output),
          n_(trains.base().layout()),
          parameters_(inputs.parameters()),
          w_(static_cast<std::size_t>(inputs.size())),
          derivative_(w_.size() * static_cast<std::size_t>(parameters_)) {
        start_memory_ = set_start(trains, variations, start, derivative_.data());
    }

    void begin(ExactSolver<System>& solver) override { solver_ = &solver; }
    void finish(const ClosedLoop<D>& loop) override { read_signals(loop, std::numeric_limits<double>::infinity()); }

    void segment(const Segment<System>& s) override {
        if (begun_ && s.memory != memory_) set_without_switching(s);
        enter(*s.entry.regime);
        set_states(s.at.x(), s.memory);
        if (!begun_) begin_motion(s.memory);
        begun_ = true;
        time_ = s.begin;
        see_inputs(time_, false);
        if (!tangent_->propagator.ready()) regimes_.prepare(*tangent_, s.entry.propagator.length(0));
        for (; next_ < output_.times.count && is_due(s, output_.times[next_]); ++next_) {
            advance(output_.times[next_]);
            read(next_);
        }
        advance(s.end);
        set_states(s.x_end, s.memory);
    }

    void switching(const SwitchingOf<System>& w) override {
        const std::array<InputsOf<D>, 2> before = inputs();
        left_w_ = w_;
        left_ = derivative_;
        shift_.assign(static_cast<std::size_t>(parameters_), 0.0);
        const typename System::Regime& old = *regime_;
        const RegimeTangent& old_tangent = *tangent_;
        if (w.guard >= 0) {
            if (!find_shift(w, before[1], shift_.data())) end(w, "a condition that it only touches");
        } else if (!inputs_.shift_of_breakpoint(w.time, shift_.data())) {
            end(w, "inputs that jump together, at instants of different parameters");
        }
        const State x = state();
        const Memory memory = memory_;
        see_inputs(w.time, w.guard >= 0);
        const std::array<InputsOf<D>, 2> after = inputs();
        const auto& next = solver_->regime(w.after);
        const ResetOf<System> r{w, old, next, x, memory, before, after};
        auto jump = JacobianOf<D>::identity(system_.counts());
        const ResetRatesOf<D> rates = laws_.reset(r, jump);
        if (!rates.exact) end(w, torque_at_rest);
        set_anew_.assign(derivative_.size(), 0.0);
        reset(r, old_tangent, left_w_.data(), left_.data(), set_anew_.data());
        apply(jump, rates, r, left_.data(), shift_.data(), set_anew_.data());
    }

    void tick(const ClosedLoop<D>& loop, const ControlCourse& course, const State& x, const Memory& memory) override {
        if (!begun_) set_states(x, memory);
        read_signals(loop, loop.ticks.time(course.next));
        ticks_.step(loop.ticks, loop.axes, course, form_, trains_, w_.data(), derivative_.data());
        if (!ticks_.error().empty() && output_.ends_by.empty()) {
            output_.ends_at = loop.ticks.time(course.next);
            output_.ends_by = ticks_.error();
        }
    }

 private:
    using ComponentsRow = ComponentsOf<D>;
    static constexpr const char* torque_at_rest = "a torque at rest that comes to lie where contacts let it";

    double* row(int k) { return derivative_.data() + k * parameters_; }
    void read(std::size_t sample) {
        const std::size_t channels = output_.channels.size();
        for (std::size_t c = 0; c < channels; ++c) {
            std::fill(value_.begin(), value_.end(), 0.0);
            samples_.add(c, *tangent_, w_.data(), derivative_.data(), value_.data());
            for (std::size_t p = 0; p < value_.size(); ++p)
                output_.out[(p * channels + c) * output_.times.count + sample] =
                    ended() ? std::numeric_limits<double>::quiet_NaN() : value_[p];
        }
    }
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
        w.before = w.after = s.entry.regime->key;
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
        for (int k = 0; k < n_.memory; ++k) w_[static_cast<std::size_t>(n_.first_memory + k)] = memory[k];
    }
    State state() const {
        State x{};
        for (int k = 0; k < n_.states; ++k) x[model::state_place<D>(n_, k)] = w_[static_cast<std::size_t>(k)];
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
        tangent_ = &regimes_(r.key);
        if (!tangent_->alike && !ended()) {
            output_.ends_at = time_;
            output_.ends_by = "a regime that has other conditions beside the value of a parameter";
        }
    }
    void advance(double to) {
        tangent_->propagator.advance(w_.data(), derivative_.data(), to - time_);
        time_ = to;
    }

    // What the search for the first regime has set: torques that the motion leaves open.
    void begin_motion(const Memory& memory) {
        see_inputs(0.0, false);
        const model::Regime& r = tangent_->regime;
        for (int c = 0; c < n_.contacts; ++c)
            if (r.at_rest[static_cast<std::size_t>(c)] && !ended() &&
                sets_in_motion(trains_, form_, c, w_.data(), derivative_.data())) {
                output_.ends_at = 0.0;
                output_.ends_by = "a contact at rest that a parameter sets in motion at the start: " +
                                  model::contact_name(trains_.base(), c);
            }
        hold_at_start(memory);
    }

    // Torques that rest leaves open are given with the start, where contacts can hold them; those of gears whose
    // contacts slip or are determined begin without hysteresis.
    void hold_at_start(const Memory& memory) {
        const model::Assembly& a = trains_.base();
        const model::Regime& r = tangent_->regime;
        if (r.locked.empty()) return;
        typename LockedTorques<D>::Torques torques;
        torques.reach(trains_.base().places().contacts.size());
        std::vector<double> derivatives(a.places().contacts.size() * static_cast<std::size_t>(parameters_));
        for (std::size_t c = 0; c < a.places().contacts.size(); ++c) {
            const model::ContactPlace& contact = a.places().contacts[c];
            double* to = derivatives.data() + c * static_cast<std::size_t>(parameters_);
            if (contact.locked != model::nowhere) {
                torques[c] = start_memory_[static_cast<std::size_t>(contact.locked)];
                std::copy_n(row(n_.first_memory + contact.locked), parameters_, to);
            } else if (contact.kind == model::ContactPlace::gear) {
                const model::Row P = a.spring_torque(contact.element, r.key);
                torques[c] = form_.value(P, w_.data());
                form_.add_motion(P, derivative_.data(), 1.0, to);
                for (const VariedTrain::Beside& b : trains_.beside())
                    to[b.parameter] +=
                        b.weight *
                        (form_.value(b.assembly().spring_torque(contact.element, r.key), w_.data()) - torques[c]);
            }
        }
        if (const auto hold = locked_.find(*regime_, torques, state(), memory, inputs()[0])) {
            set_held(*hold, torques.data(), derivatives.data(), derivative_.data());
        } else if (!ended()) {
            output_.ends_at = 0.0;
            output_.ends_by = torque_at_rest;
        }
    }
    // torques: those before, by contact, and their derivatives.
    void set_held(const typename LockedTorques<D>::Hold& hold, const double* torques, const double* derivatives,
                  double* to) {
        const RegimeTangent& rest = *tangent_;
        const RegimeTangent& in = hold.at_limit ? regimes_(hold.at_limit->key) : rest;
        const auto set_row = [&](int memory) { return to + (n_.first_memory + memory) * parameters_; };
        for (const auto& l : in.regime.locked)
            std::copy_n(derivatives + l.contact * parameters_, parameters_, set_row(l.memory));
        for (std::size_t k = 0; k < in.regime.locked.size(); ++k)
            if (hold.bounds[k] != model::Bound::none)
                resets_.at_bound(in, k, hold.bounds[k], w_.data(), derivative_.data(), torques, derivatives, to);
        locked_.each_given(hold, *regime_, [&](const auto& l) {
            resets_.given(torque_of(l.contact, in), w_.data(), derivative_.data(), l.memory, to);
        });
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
        std::vector<std::int8_t> modes(static_cast<std::size_t>(n_.contacts));
        for (int c = 0; c < n_.contacts; ++c) modes[static_cast<std::size_t>(c)] = r.before.at_rest[c] ? 0 : 1;
        if (w.guard >= 0 && w.kind == model::Guard::speed) modes[static_cast<std::size_t>(w.contact)] = 0;
        resets_.tied_speeds(modes, left_w, to);
        const model::Ties now = a.places().ties(modes);
        for (std::size_t g = 0; g < a.places().gears.size(); ++g) {
            const model::GearPlace& p = a.places().gears[g];
            if (p.hysteresis == model::nowhere || r.before.at_rest[p.contact]) continue;
            if (model::kept_at_rest(a.places().contacts[static_cast<std::size_t>(p.contact)], now))
                resets_.capacity(g, left_w[p.twist], r.before.key, to);
        }
        if (w.guard >= 0) resets_.turn(old, static_cast<std::size_t>(w.guard), to);
        enter(r.after);
        set_states(w.x, w.memory);
        hold(r, old, left_w, left, to);
    }
    // Torques that rest leaves open after a switching.
    void hold(const ResetOf<System>& r, const RegimeTangent& old, const double* left_w, const double* left,
              double* to) {
        if (tangent_->regime.locked.empty()) return;
        const auto hold = locked_.find(r);
        if (!hold) return;
        const auto& contacts = trains_.base().places().contacts;
        typename LockedTorques<D>::Torques torques;
        torques.reach(trains_.base().places().contacts.size());
        std::vector<double> derivatives(contacts.size() * static_cast<std::size_t>(parameters_));
        for (std::size_t c = 0; c < contacts.size(); ++c) {
            if (contacts[c].kind == model::ContactPlace::shaft) continue;
            const VariedForm was = torque_of(static_cast<int>(c), old);
            double* own = derivatives.data() + c * static_cast<std::size_t>(parameters_);
            torques[c] = form_.value(was.form, left_w);
            form_.add_own(was.varied, was.row, left_w, 1.0, own);
            form_.add_inputs(was.form, left, 1.0, own);
        }
        set_held(*hold, torques.data(), derivatives.data(), to);
    }
    // What a contact of a gear or of a coupling takes.
    VariedForm torque_of(int contact, const RegimeTangent& t) const {
        const model::ContactPlace& c = trains_.base().places().contacts[static_cast<std::size_t>(contact)];
        if (c.kind == model::ContactPlace::gear)
            return {t.regime.output_torque[static_cast<std::size_t>(c.element)], t.output_torque, c.element};
        return {t.regime.contact_torque[static_cast<std::size_t>(contact)], t.contact_torque, contact};
    }

    void apply(const JacobianOf<D>& jump, const ResetRatesOf<D>& rates, const ResetOf<System>& r, const double* left,
               const double* shift, const double* set_anew) {
        ComponentsRow before{}, after{};
        const CountsOf<D>& counts = system_.counts();
        each_rate<D>(r.before, [&](int c, const LinearForm& f) {
            if (place(c) >= 0) before[c] = evaluate<D>(f, r.x, r.memory, r.input[0]);
        });
        each_rate<D>(r.after, [&](int c, const LinearForm& f) {
            if (place(c) >= 0) after[c] = evaluate<D>(f, r.switching.x, r.switching.memory, r.input_after[0]);
        });
        each_component<D>(counts, [&](int c) {
            const int k = place(c);
            if (k < 0) return;
            double* to = row(k);
            std::copy_n(set_anew + k * parameters_, parameters_, to);
            double gap = rates.by_time[c] - after[c];
            each_component<D>(counts, [&](int j) {
                const double share = jump.row[c][j];
                if (share == 0.0 || place(j) < 0) return;
                add_scaled(to, share, left + place(j) * parameters_, parameters_);
                gap += share * before[j];
            });
            if (gap != 0.0) add_scaled(to, gap, shift, parameters_);
        });
    }

    // What the controllers have shown until a time.
    void read_signals(const ClosedLoop<D>& loop, double until) {
        if (output_.axes_out == nullptr) return;
        for (; next_signal_ < output_.times.count && output_.times[next_signal_] < until; ++next_signal_) {
            double* to = output_.axes_out + next_signal_;
            for (int p = 0; p < parameters_; ++p) {
                int first = 0;
                for (const control::Axis& a : loop.axes) {
                    for (int s = 0; s < control::n_axis_signals; ++s, to += output_.times.count)
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
    SampleTangent samples_;
    ResetTangent resets_;
    const System system_;
    const ComponentLaws<System> laws_;
    const LockedTorques<D> locked_;
    TickTangent ticks_;
    SensitivityOutput& output_;
    const model::Layout& n_;
    int parameters_;
    std::vector<double> w_, derivative_;  // w; its derivatives, those of one entry together
    std::vector<double> start_memory_, value_ = std::vector<double>(static_cast<std::size_t>(parameters_));
    std::vector<double> left_w_, left_, shift_, set_anew_;  // of a switching
    Memory memory_{};
    ExactSolver<System>* solver_ = nullptr;
    const typename System::Regime* regime_ = nullptr;
    RegimeTangent* tangent_ = nullptr;
    double time_ = 0.0;
    std::size_t next_ = 0, next_signal_ = 0;
    bool begun_ = false;
};

}  // namespace lostmotion
