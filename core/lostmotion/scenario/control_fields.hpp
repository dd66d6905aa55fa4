// Sampled controllers, field by field, in the order of a description. A law of the user's own has none.
#pragma once

#include <cstdint>

#include "../simulation/closed_loop.hpp"
#include "part_fields.hpp"

namespace lostmotion {
namespace control {

inline constexpr long max_ticks = 100000;

template <class F>
void describe(F& f, Reference& r) {
    f.each("pieces", r.pieces, [&](ReferencePiece& p) {
        f.number("time", p.time, Range::not_negative);
        f.number("value", p.begin.value);
        f.number("rate", p.begin.rate);
        f.number("second", p.begin.second);
        f.number("third", p.begin.third);
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
void describe(F& f, TickDelay& d) {
    f.integer("ticks", d.ticks, 0, max_ticks);
}

template <class F>
void describe(F& f, Schedule& s) {
    f.integer("every", s.every, 1, 1000000000);
    f.integer("phase", s.phase, 0, 1000000000);
}

template <class F>
void describe(F& f, Sensor& s) {
    f.number("resolution", s.encoder.resolution, Range::not_negative);
    f.number("error", s.encoder.error, Range::not_negative);
    f.number("periods", s.encoder.periods);
    f.number("phase", s.encoder.phase);
    f.part("delay", [&] { describe(f, s.encoder.delay); });
    f.number("scale", s.scale);
}

template <class F>
void describe(F& f, SpeedEstimate& e) {
    f.choice("kind", e.kind, 3);
    f.integer("span", e.span, 1, max_ticks);
    f.number("smoothing", e.smoothing);
    f.number("bandwidth", e.bandwidth);
    f.number("damping", e.damping);
    f.number("inertia", e.inertia, Range::not_negative);
}

template <class F>
void describe(F& f, PositionLoop& p) {
    f.number("gain", p.gain);
    f.number("integral_gain", p.integral_gain);
    f.number("speed_feedforward", p.speed_feedforward);
    f.number("speed_limit", p.speed_limit, Range::limit);
    f.number("inner", p.inner, Range::not_negative);
    f.number("outer", p.outer, Range::not_negative);
}

template <class F>
void describe(F& f, SpeedLoop& s) {
    f.number("gain", s.gain);
    f.number("reference_gain", s.reference_gain);
    f.number("integral_gain", s.integral_gain);
    f.number("torque_limit", s.torque_limit, Range::limit);
}

template <class F>
void describe(F& f, CurrentLoop& c) {
    f.number("gain", c.gain);
    f.number("integral_gain", c.integral_gain);
    f.number("back_emf", c.back_emf);
    f.number("rated_torque", c.rated_torque, Range::positive);
    f.number("limit", c.limit, Range::limit);
}

template <class F>
void describe(F& f, FieldOrientation& o) {
    f.number("pole_pairs", o.winding.pole_pairs, Range::positive);
    f.number("resistance", o.winding.resistance, Range::positive);
    f.number("inductance_d", o.winding.inductance_d, Range::positive);
    f.number("inductance_q", o.winding.inductance_q, Range::positive);
    f.number("flux_linkage", o.winding.flux_linkage, Range::positive);
    f.number("gain_d", o.gain_d);
    f.number("gain_q", o.gain_q);
    f.number("integral_gain", o.integral_gain);
    f.number("back_emf", o.back_emf);
    f.number("decoupling", o.decoupling);
    f.number("field_weakening", o.field_weakening);
    f.number("weakening_voltage", o.weakening_voltage, Range::positive);
    f.number("voltage_limit", o.voltage_limit, Range::positive);
    f.number("current_limit", o.current_limit, Range::positive);
    f.number("sample_time", o.sample_time, Range::positive);
    f.number("delay_time", o.delay_time, Range::not_negative);
    f.part("delay", [&] { describe(f, o.delay); });
    f.integer("parts", o.parts, 1, 1000);
}

template <class F>
void describe(F& f, GearLosses& l) {
    f.choice("kind", l.kind, 3);
    f.number("ratio", l.ratio, Range::positive);
    f.number("efficiency", l.efficiency, Range::positive);
    if (l.kind == GearLosses::loss_map) f.part("map", [&] { lostmotion::describe(f, l.map); });
    f.number("rated_torque", l.rated_torque, Range::positive);
    f.number("rated_speed", l.rated_speed, Range::positive);
}

template <class F>
void describe(F& f, Adaptation& a) {
    f.number("rate", a.rate);
    f.number("min", a.min, Range::bound);
    f.number("max", a.max, Range::bound);
    if constexpr (F::reads) {
        if (f.well() && !(a.min <= a.max)) f.wrong("min", "must not lie above max");
    }
}

template <class F>
void describe(F& f, InverseModel& m) {
    f.flag("present", m.present);
    if (!m.present) return;
    f.number("motor_inertia", m.motor_inertia);
    f.number("motor_viscous_friction", m.motor_viscous_friction);
    f.number("load_inertia", m.load_inertia);
    f.number("load_viscous_friction", m.load_viscous_friction);
    f.number("load_torque", m.load_torque);
    f.part("losses", [&] { describe(f, m.losses); });
    f.number("loss_factor", m.loss_factor);
    f.number("friction_torque", m.friction_torque);
    f.part("of_losses", [&] { describe(f, m.of_losses); });
    f.part("of_friction", [&] { describe(f, m.of_friction); });
    f.number("min_speed", m.min_speed, Range::not_negative);
    f.flag("through_gear", m.through_gear);
    if (m.through_gear) f.part("curve", [&] { lostmotion::describe(f, m.curve); });
    f.number("twist_rate", m.twist_rate, Range::limit_or_zero);
}

template <class F>
void describe(F& f, LoadObserver& o) {
    f.flag("present", o.present);
    if (!o.present) return;
    f.number("input_time", o.input_time, Range::positive);
    f.number("load_time", o.load_time, Range::positive);
    f.number("input_share", o.input_share);
    f.number("load_share", o.load_share);
    f.number("bandwidth", o.bandwidth, Range::not_negative);
}

template <class F>
void describe(F& f, DiscreteSystem& s) {
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
void describe(F& f, Camera& c) {
    f.flag("present", c.present);
    if (!c.present) return;
    f.integer("every", c.every, 1, max_ticks);
    f.integer("latency", c.latency, 0, max_ticks);
    f.number("step", c.step, Range::not_negative);
    f.number("noise", c.noise, Range::not_negative);
    f.number("half_field", c.half_field, Range::limit);
    // More bits than a number has.
    constexpr long long word = 0xffffffff;
    std::uint64_t high = c.seed >> 32, low = c.seed & 0xffffffffu;
    f.integer("seed", high, 0, word);
    f.integer("seed", low, 0, word);
    c.seed = high << 32 | low;
    f.integer("stream", c.stream, 0, word);
}

template <class F>
void describe(F& f, Tracker& t) {
    f.number("alpha", t.alpha);
    f.number("beta", t.beta);
    f.number("gamma", t.gamma);
    f.number("frame_time", t.frame_time, Range::positive);
    f.flag("predicts", t.predicts);
}

template <class F>
void describe(F& f, Axis& a) {
    f.choice("mode", a.mode, 3);
    f.part("reference", [&] { describe(f, a.reference); });
    f.part("camera", [&] { describe(f, a.camera); });
    if (a.camera.present) f.part("tracker", [&] { describe(f, a.tracker); });
    f.number("reference_delay", a.reference_delay, Range::not_negative);
    f.number("ratio", a.ratio);
    f.number("rated_torque", a.rated_torque, Range::positive);
    f.number("torque_limit", a.torque_limit, Range::limit);
    f.number("stall_torque", a.stall_torque, Range::limit);
    f.number("torque_droop", a.torque_droop, Range::not_negative);
    f.part("delay", [&] { describe(f, a.delay); });
    f.part("speed_sensor", [&] { describe(f, a.speed_sensor); });
    f.part("position_sensor", [&] { describe(f, a.position_sensor); });
    f.flag("two_encoders", a.two_encoders);
    f.number("position_share", a.position_share);
    f.part("estimate", [&] { describe(f, a.estimate); });
    f.part("position_schedule", [&] { describe(f, a.position_schedule); });
    f.part("speed_schedule", [&] { describe(f, a.speed_schedule); });
    f.part("current_schedule", [&] { describe(f, a.current_schedule); });
    f.part("position_loop", [&] { describe(f, a.position_loop); });
    f.part("speed_loop", [&] { describe(f, a.speed_loop); });
    f.optional("current_loop", a.current_loop, CurrentLoop{}, [&](CurrentLoop& c) { describe(f, c); });
    f.optional("field_orientation", a.field_orientation, FieldOrientation{},
               [&](FieldOrientation& o) { describe(f, o); });
    f.flag("commutates_by_encoder", a.commutates_by_encoder);
    f.part("feedforward", [&] {
        f.number("inertia", a.feedforward.inertia);
        f.number("viscous_friction", a.feedforward.viscous_friction);
        f.number("friction_torque", a.feedforward.friction_torque);
        f.number("load_torque", a.feedforward.load_torque);
    });
    f.part("inverse_model", [&] { describe(f, a.inverse_model); });
    f.part("load_observer", [&] { describe(f, a.load_observer); });
    f.part("backlash", [&] {
        f.number("backlash", a.backlash.backlash, Range::not_negative);
        f.number("rate", a.backlash.rate, Range::limit_or_zero);
    });
    f.each("speed_filters", a.speed_filters, [&](DiscreteSystem& s) { describe(f, s); });
    f.each("torque_filters", a.torque_filters, [&](DiscreteSystem& s) { describe(f, s); });
    if constexpr (F::reads) {
        if (!f.well()) return;
        if (a.ratio == 0.0) f.wrong("ratio", "must not be 0");
        if (a.speed_loop.integral_gain != 0.0 && a.speed_loop.reference_gain == 0.0)
            f.wrong("speed_loop.reference_gain", "must not be 0 with an integral gain");
        if (a.current_loop && a.current_loop->integral_gain != 0.0 && a.current_loop->gain == 0.0)
            f.wrong("current_loop.gain", "must not be 0 with an integral gain");
        if (a.load_observer.present && (!a.inverse_model.present || a.speed_loop.gain == 0.0))
            f.wrong("load_observer", "needs an inverse model and a speed loop with a gain");
    }
}

}  // namespace control

template <class F>
void describe(F& f, Control& c) {
    f.number("tick", c.tick, Range::positive);
    f.each("axes", c.axes, [&](ControlledAxis& a) {
        f.integer("motor", a.motor, 0, model::max_number);
        f.integer("position_shaft", a.position_shaft, 0, model::max_number);
        f.integer("speed_shaft", a.speed_shaft, 0, model::max_number);
        f.integer("reference_shaft", a.reference_shaft, 0, model::max_number);
        control::describe(f, a.law);
    });
}

}  // namespace lostmotion
