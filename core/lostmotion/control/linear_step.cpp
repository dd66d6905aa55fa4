#include "linear_step.hpp"

namespace lostmotion::control {

namespace {

constexpr double unlimited = std::numeric_limits<double>::infinity();

// The axis without what is not affine, with this loop as its outermost.
Axis affine(Axis a, Loop outermost, double sample_time) {
    const Axis::Mode mode = outermost == Loop::position ? Axis::position_mode
                            : outermost == Loop::speed  ? Axis::speed_mode
                                                        : Axis::torque_mode;
    if (mode != a.mode) {
        a.feedforward = {};
        a.shaper = {};
        a.ratio = 1.0;
    }
    a.mode = mode;
    a.feedforward.friction_torque = a.feedforward.load_torque = a.feedforward.backlash = 0.0;
    a.reference.sines.clear();
    a.torque_limit = a.stall_torque = unlimited;
    for (Encoder* e : {&a.speed_sensor.encoder, &a.position_sensor.encoder}) {
        e->ideal = true;
        e->error = 0.0;
    }
    a.position_loop.speed_limit = a.speed_loop.torque_limit = unlimited;
    a.position_loop.dead_zone = {};
    a.position_loop.reference_delay = 0.0;
    if (a.current_loop) a.current_loop->command_limit = unlimited;
    a.field_orientation.reset();
    a.camera = {};
    a.inverse_model = {};
    a.load_observer = {};
    a.own_law = {};
    a.place(sample_time);
    return a;
}

// Derivatives of a function of a vector about a point, by differences of order 6: row by row.
template <class Function>
std::vector<double> derivatives(std::vector<double> x, const Function& f) {
    const std::size_t n = x.size();
    std::vector<double> rows;
    for (std::size_t j = 0; j < n; ++j) {
        const double at = x[j], step = std::ldexp(1.0, std::ilogb(std::fmax(1.0, std::fabs(at))) - 10);
        const auto difference = [&](int k) {
            x[j] = at + k * step;
            std::vector<double> high = f(x);
            x[j] = at - k * step;
            const std::vector<double> low = f(x);
            for (std::size_t i = 0; i < high.size(); ++i) high[i] -= low[i];
            return high;
        };
        const std::vector<double> one = difference(1), two = difference(2), three = difference(3);
        x[j] = at;
        rows.resize(one.size() * n);
        for (std::size_t i = 0; i < one.size(); ++i)
            rows[i * n + j] = (45.0 * one[i] - 9.0 * two[i] + three[i]) / (60.0 * step);
    }
    return rows;
}

}  // namespace

LinearStep linear_step(const Axis& axis, Loop outermost, bool cut, std::int64_t sample, double sample_time) {
    Axis a = affine(axis, outermost, sample_time);
    const std::size_t states = static_cast<std::size_t>(a.slots()), inputs = 8, n = states + inputs;
    const auto after = [&](const std::vector<double>& x) {
        std::vector<double> slot(x.begin(), x.begin() + static_cast<long>(states));
        const double* u = x.data() + states;
        const Sampled y{.position_angle = u[0], .speed_angle = u[1], .speed = u[2], .motor_torque = u[3]};
        a.reference.pieces = {{static_cast<double>(sample) * sample_time, {u[4], u[5], u[6]}}};
        a.cut = {cut ? outermost : Loop::none, u[7]};
        a.step(sample, sample_time, y, slot.data());
        return slot;
    };
    LinearStep out{n, std::vector<double>(states * n)};
    std::vector<double> x(n);
    const std::vector<double> from = after(x);
    for (std::size_t j = 0; j < n; ++j) {
        x[j] = 1.0;
        const std::vector<double> to = after(x);
        x[j] = 0.0;
        for (std::size_t i = 0; i < states; ++i) out.rows[i * n + j] = to[i] - from[i];
    }
    return out;
}

LinearStep linear_orientation(const FieldOrientation& given, const SteadyOrientation& m, CurrentAxis outermost,
                              bool cut, int every, int since, double sample_time) {
    FieldOrientation law = given;
    law.limited = false;
    if (m.weakening == 0.0 || outermost != CurrentAxis::none) law.field_weakening = 0.0;
    Slots slots;
    law.place(slots);
    const std::size_t states = static_cast<std::size_t>(slots.count());
    const double lag = m.lag / law.winding.pole_pairs;
    const int last = (law.delay.samples / every + 1) * every + since;  // all that is delayed is of the steady motion
    const auto reading = [&](int sample) {
        const double angle = m.speed * (sample - last) * sample_time;
        // The current in coordinates of the rotor is seen as m.current.
        return FieldOrientation::Reading{angle - lag, m.speed, angle, FieldOrientation::turned(m.current, -m.lag)};
    };
    std::vector<double> x(states);
    law.settle(m.torque, m.weakening, m.voltage, reading(0), x.data());
    for (int sample = 0; sample < last; ++sample) {
        const FieldOrientation::Reading y = reading(sample);
        if (sample % every == 0) law.command(m.voltage, y, x.data());
        law.act(x.data());
    }
    const bool direct = outermost == CurrentAxis::direct;
    const FieldOrientation::Reading y0 = reading(last);
    const double looked_at = direct ? m.current.d : m.current.q;
    for (const double value :
         {m.torque, m.speed, y0.angle, y0.true_angle, y0.current.d, y0.current.q, looked_at, looked_at})
        x.push_back(value);
    const auto after = [&](const std::vector<double>& at) {
        std::vector<double> out(at.begin(), at.begin() + static_cast<long>(states));
        const double* u = at.data() + states;
        const FieldOrientation::Reading y{u[2], u[1], u[3], {u[4], u[5]}};
        const DirectQuadrature seen = law.measured(y);
        if (since == 0) {
            DirectQuadrature wanted = m.current, measured = seen;
            if (outermost == CurrentAxis::none)
                wanted = law.wanted(u[0], y.speed, out.data());
            else {
                (direct ? wanted.d : wanted.q) = u[6];
                if (cut) (direct ? measured.d : measured.q) = u[7];
            }
            law.follow(wanted, measured, y, out.data());
        }
        law.act(out.data());
        const DirectQuadrature voltage = law.voltage(y.true_angle, out.data());
        for (const double value : {voltage.d, voltage.q, seen.d, seen.q}) out.push_back(value);
        return out;
    };
    return {states + 8, derivatives(std::move(x), after)};
}

}  // namespace lostmotion::control
