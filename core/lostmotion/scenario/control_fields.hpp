// Sampled controllers, field by field, in the order of a description. A law of the user's own has none.
#pragma once

#include <cstdint>

#include "../simulation/controllers.hpp"
#include "part_fields.hpp"

namespace lostmotion {
namespace control {

template <class F>
void describe(F& f, Reference& r) {
    f.each("pieces", r.pieces, [&](ReferencePiece& p) {
        f.number("time", p.time, Range::not_negative);
        f.number("value", p.begin.value);
        f.number("rate", p.begin.rate);
        f.number("acceleration", p.begin.acceleration);
        f.number("jerk", p.begin.jerk);
    });
    f.each("sines", r.sines, [&](Sine& s) { lostmotion::describe(f, s); });
    if constexpr (F::reads) {
        if (!f.well()) return;
        if (r.pieces.empty() || r.pieces[0].time != 0.0) return f.wrong("pieces", "must begin at 0 s");
        for (std::size_t k = 1; k < r.pieces.size(); ++k)
            if (!(r.pieces[k].time > r.pieces[k - 1].time)) return f.wrong("pieces", "must rise in time");
    }
}

template <class F>
void describe(F& f, Schedule& s) {
    f.integer("every", s.every, 1, 1000000000);
    f.integer("phase", s.phase, 0, 1000000000);
}

template <class F>
void describe(F& f, Sensor& s) {
    s.encoder.describe(f);
    f.integer("delay", s.encoder.delay.samples, 0, max_delay);
    f.number("scale", s.scale);
}

template <class F>
void describe(F& f, GearLosses& l) {
    f.choice("kind", l.kind, {"none", "constant_efficiency", "loss_map"});
    f.number("ratio", l.ratio);
    if constexpr (F::reads)
        if (f.well() && l.ratio == 0.0) f.wrong("ratio", "must not be 0");
    if (l.kind == GearLosses::loss_map) f.curve("map", l.map);
    f.number("rated_torque", l.rated_torque, Range::positive);
    f.number("rated_speed", l.rated_speed, Range::positive);
}

template <class F>
void describe(F& f, InverseModel& m) {
    m.describe(f);
    f.part("losses", [&] { describe(f, m.losses); });
    bool losses = m.of_losses.rate > 0.0, friction = m.of_friction.rate > 0.0;
    f.present("loss_adaptation", losses, [&] { m.of_losses.describe_of_losses(f); });
    f.present("friction_adaptation", friction, [&] { m.of_friction.describe_of_friction(f); });
    f.present("twist", m.through_gear, [&] { f.curve("curve", m.curve); });
}

// A filter of a file, in a loop of this sample time.
struct FilterLaw {
    static constexpr int number = 1;
    Filter filter = {};
    double loop_time = 0.0;

    template <class F>
    void describe(F& f) {
        filter.describe(f);
        f.number("loop_time", loop_time, Range::positive);
    }
    std::string wrong() const {
        if (filter.kind != Filter::transfer_function)
            return filter.frequency * loop_time < 0.5 ? ""
                                                      : "has a frequency above half that of the samples of its loop";
        const bool fits = !filter.numerator.empty() && filter.numerator.size() <= filter.denominator.size() &&
                          filter.denominator.size() <= DiscreteSystem::max_order + 1 && filter.denominator[0] != 0.0;
        return fits ? "" : "has a numerator that does not fit its denominator";
    }
    Filter in_z() const {
        Filter f = filter;
        f.discretise(loop_time);
        return f;
    }
    DiscreteSystem curve() const { return in_z().system(); }
};

template <class F>
void describe_matrices(F& f, DiscreteSystem& s) {
    f.list("A", s.A);
    f.list("B", s.B);
    f.list("C", s.C);
    f.number("D", s.D);
    if constexpr (F::reads) {
        if (f.well() && (s.B.size() > DiscreteSystem::max_order || s.C.size() != s.B.size() ||
                         s.A.size() != s.B.size() * s.B.size()))
            f.wrong("A", "does not fit B and C, or the order is above " + std::to_string(DiscreteSystem::max_order));
    }
}

template <class F>
void describe(F& f, DiscreteSystem& s) {
    const auto matrices = [&] { describe_matrices(f, s); };
    describe_made<FilterLaw>(f, s, "filter", matrices);
}

template <class F>
void describe(F& f, Camera& c) {
    c.describe(f);
    f.integer("every", c.every, 1, max_delay);
    f.integer("late", c.late, 0, max_delay);
    f.integer("stream", c.stream, 0, 0xffffffffLL);
}

template <class F>
void describe(F& f, Firmware& w) {
    w.describe(f);
    f.list("errors", w.errors, Range::not_negative);
    f.list("duties", w.duties, Range::share);
    if constexpr (F::reads) {
        if (!f.well()) return;
        if (w.errors.size() < 2 || w.duties.size() != w.errors.size() || w.errors[0] != 0.0 || w.duties[0] != 0.0)
            return f.wrong("errors", "and duties must be of one length, two at least, and begin at 0");
        for (std::size_t k = 1; k < w.errors.size(); ++k)
            if (!(w.errors[k] > w.errors[k - 1])) return f.wrong("errors", "must rise");
    }
}

// By the keys of scenario files where these have it.
template <class F>
void describe(F& f, Axis& a) {
    f.choice("mode", a.mode, {"torque", "speed", "position"});
    f.part("reference", [&] { describe(f, a.reference); });
    f.present("camera", a.camera.present, [&] {
        describe(f, a.camera);
        f.part("tracker", [&] {
            a.tracker.describe(f);
            f.number("frame_time", a.tracker.frame_time, Range::positive);
        });
    });
    f.number("ratio", a.ratio);
    f.number("rated_torque", a.rated_torque, Range::positive);
    f.number("torque_limit", a.torque_limit, Range::limit);
    f.number("stall_torque", a.stall_torque, Range::limit);
    f.number("torque_droop", a.torque_droop, Range::not_negative);
    f.integer("delay", a.delay.samples, 0, max_delay);
    f.part("encoder", [&] { describe(f, a.speed_sensor); });
    f.present("position_encoder", a.two_encoders, [&] { describe(f, a.position_sensor); });
    f.number("blend_time", a.blend_time, Range::not_negative);
    f.part("position_schedule", [&] { describe(f, a.position_schedule); });
    f.part("speed_schedule", [&] { describe(f, a.speed_schedule); });
    f.part("current_schedule", [&] { describe(f, a.current_schedule); });
    bool position = a.position_loop.gain != 0.0, speed = a.speed_loop.gain != 0.0;
    f.present("position", position, [&] { a.position_loop.describe(f); });
    f.present("speed", speed, [&] { a.speed_loop.describe(f); });
    f.present("firmware", a.firmware.present, [&] { describe(f, a.firmware); });
    f.part("estimate", [&] { a.estimate.describe(f); });
    f.optional("current_loop", a.current_loop, CurrentLoop{}, [&](CurrentLoop& c) { c.describe(f); });
    f.optional("field_orientation", a.field_orientation, FieldOrientation{},
               [&](FieldOrientation& o) { o.describe(f); });
    f.flag("commutates_by_encoder", a.commutates_by_encoder);
    f.part("feedforward", [&] { a.feedforward.describe(f); });
    f.present("inverse_model", a.inverse_model.present, [&] {
        describe(f, a.inverse_model);
        f.present("load_observer", a.load_observer.present, [&] { a.load_observer.describe(f); });
    });
    f.each("reference_filters", a.speed_filters, [&](DiscreteSystem& s) { describe(f, s); });
    f.each("torque_filters", a.torque_filters, [&](DiscreteSystem& s) { describe(f, s); });
    a.shaper.each([&]<class Block>(std::optional<Block>& block) {
        f.optional(Block::key, block, Block{}, [&](Block& b) { b.describe(f); });
    });
    if constexpr (F::reads) {
        if (!f.well()) return;
        if (a.ratio == 0.0) f.wrong("ratio", "must not be 0");
        if (a.load_observer.present && a.speed_loop.gain == 0.0) f.wrong("load_observer", "needs a speed loop");
    }
}

// The tables of controllers in scenario files, by the names of their parts: use(name, describe).
template <class Use>
void each_table(Use&& use) {
    use("PositionLoop", [](auto& f) { PositionLoop().describe(f); });
    use("SpeedLoop", [](auto& f) { SpeedLoop().describe(f); });
    use("Firmware", [](auto& f) { Firmware().describe(f); });
    use("Difference", [](auto& f) { SpeedEstimate().describe_difference(f); });
    use("Observer", [](auto& f) { SpeedEstimate().describe_observer(f); });
    use("CurrentLoop", [](auto& f) { CurrentLoop().describe(f); });
    use("FieldOriented", [](auto& f) { FieldOrientation().describe(f); });
    use("Feedforward", [](auto& f) { Feedforward().describe(f); });
    use("InverseModel", [](auto& f) { InverseModel().describe(f); });
    use("LossAdaptationLaw", [](auto& f) { Adaptation().describe_of_losses(f); });
    use("FrictionAdaptationLaw", [](auto& f) { Adaptation().describe_of_friction(f); });
    use("LoadObserver", [](auto& f) { LoadObserver().describe(f); });
    use("Encoder", [](auto& f) { Encoder().describe(f); });
    use("Camera", [](auto& f) { Camera().describe(f); });
    use("Tracker", [](auto& f) { Tracker().describe(f); });
    each_reference_block([&](auto block) { use(block.part, [&](auto& f) { block.describe(f); }); });
}

}  // namespace control

template <class F>
void describe(F& f, ControlledAxis& a) {
    f.integer("motor", a.motor, 0, model::max_number);
    f.integer("position_shaft", a.position_shaft, 0, model::max_number);
    f.integer("speed_shaft", a.speed_shaft, 0, model::max_number);
    f.integer("reference_shaft", a.reference_shaft, 0, model::max_number);
    control::describe(f, a.law);
}

template <class F>
void describe(F& f, Control& c) {
    f.number("tick", c.tick, Range::positive);
    f.each("axes", c.axes, [&](ControlledAxis& a) { describe(f, a); });
}

}  // namespace lostmotion
