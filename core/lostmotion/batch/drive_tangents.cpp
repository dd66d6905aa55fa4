#include "drive_tangents.hpp"

#include <array>
#include <bit>
#include <cmath>
#include <compare>

#include "../model/drive_train.hpp"

namespace lostmotion::batch {

namespace dual {

// A number and its derivative. Comparisons are those of the numbers.
struct real {
    double value, slope;

    real() = default;
    real(double v) : value(v), slope(0.0) {}  // NOLINT: as any number
    real(double v, double s) : value(v), slope(s) {}
    real operator-() const { return {-value, -slope}; }
    real& operator+=(real o) { return *this = *this + o; }
    real& operator-=(real o) { return *this = *this - o; }
    real& operator*=(real o) { return *this = *this * o; }
    friend real operator+(real a, real b) { return {a.value + b.value, a.slope + b.slope}; }
    friend real operator-(real a, real b) { return {a.value - b.value, a.slope - b.slope}; }
    friend real operator*(real a, real b) { return {a.value * b.value, a.slope * b.value + a.value * b.slope}; }
    friend real operator/(real a, real b) {
        const double value = a.value / b.value;
        return {value, (a.slope - value * b.slope) / b.value};
    }
    friend bool operator==(real a, real b) { return a.value == b.value; }
    friend auto operator<=>(real a, real b) { return a.value <=> b.value; }
};

#include "../parts/loss_grid.hpp"
#include "drive_lane.hpp"
#include "drive_series.hpp"
#include "drive_walk.hpp"

}  // namespace dual

namespace {

constexpr std::size_t sheet_size = sizeof(DriveSheet) / sizeof(double);
using SheetNumbers = std::array<double, sheet_size>;

// How far apart the states of two walks of one step may be, relative to what they are made of.
constexpr double alike = 1e-6;
bool near(dual::real a, double b, double scale) { return std::fabs(a.value - b) <= alike * (std::fabs(b) + scale); }

// Whether a derivative is with respect to a number that is at the value at which it leaves out a part of the drive.
bool about_an_absent_part(const DriveSheet& sheet, const DriveSheet& by) {
    for (const auto part : {&DriveSheet::motor_friction, &DriveSheet::shaft_friction, &DriveSheet::shaft_breakaway,
                            &DriveSheet::load_friction, &DriveSheet::load_breakaway, &DriveSheet::time_constant,
                            &DriveSheet::mesh_damping, &DriveSheet::backlash})
        if (sheet.*part == 0.0 && by.*part != 0.0) return true;
    return sheet.hysteresis_efficiency == 1.0 && by.hysteresis_efficiency != 0.0;
}

}  // namespace

struct TangentWalk::Laws {
    std::vector<dual::real> lower, upper, slope, offset, root, reach, inverse, speeds, loads, values;
    dual::DriveLaws laws;
};

TangentWalk::TangentWalk(const DriveKind& kind) {
    const DriveLaws& from = kind.laws();
    auto made = std::make_unique<Laws>();
    const auto list = [](std::vector<dual::real>& to, const double* first, int n) {
        to.assign(first, first + n);
        return to.data();
    };
    const LossGrid& map = from.map;
    made->laws = {list(made->lower, from.lower, from.pieces),
                  list(made->upper, from.upper, from.pieces),
                  list(made->slope, from.slope, from.pieces),
                  list(made->offset, from.offset, from.pieces),
                  list(made->root, from.root, from.pieces),
                  from.pieces,
                  from.zero,
                  from.half_gap,
                  from.has_gap,
                  from.rigid,
                  from.delays_torque,
                  from.limits_damping,
                  from.torque_source,
                  from.losses,
                  {list(made->speeds, map.speeds, map.n_speeds), list(made->loads, map.loads, map.n_loads),
                   list(made->values, map.values, map.n_speeds * map.n_loads), map.n_speeds, map.n_loads},
                  from.steepest,
                  list(made->reach, from.reach, from.most_degree + 1),
                  list(made->inverse, from.inverse, from.most_degree + 2),
                  from.most_degree};
    laws_ = std::move(made);
}

TangentWalk::~TangentWalk() = default;

bool TangentWalk::carry(const DriveSheet& sheet, const DriveSheet& by, const DriveState& from, double command,
                        double load_torque, double step, const DriveState& to, DriveTangent& tangent) const {
    if (about_an_absent_part(sheet, by)) return false;
    const auto values = std::bit_cast<SheetNumbers>(sheet), slopes = std::bit_cast<SheetNumbers>(by);
    std::array<dual::real, sheet_size> both;
    for (std::size_t k = 0; k < sheet_size; ++k) both[k] = {values[k], slopes[k]};
    const dual::DriveNumbers numbers = std::bit_cast<dual::DriveSheet>(both).numbers(laws_->laws);
    const double turned = numbers.turned;
    const auto referred = [&](double speed, double slope) {
        return dual::real(speed, (slope - by.ratio * speed) / sheet.ratio);
    };
    dual::DriveState x{};
    x.q = {from.q, turned * tangent.motor_torque};
    x.a = referred(from.a, tangent.motor_speed);
    x.v = {from.v, x.a.slope - tangent.load_speed};
    x.d = {from.d, tangent.twist};
    x.angle = {from.angle, tangent.load_angle};
    x.hysteresis = {from.hysteresis, tangent.hysteresis};
    x.held = from.held;
    x.motor = from.motor;
    x.twist = from.twist;
    x.load = from.load;
    x.flanks = from.flanks;
    x.piece = from.piece;
    x.cell = from.cell;
    x.back = from.back;
    x.known = from.known;
    dual::DriveWalk walk(laws_->laws, numbers, x, command, load_torque);
    walk.bold = true;
    if (!walk.advance(step)) return false;
    x = walk.x;
    const double speeds = std::fabs(from.a) + std::fabs(from.v);
    if (!near(x.a, to.a, speeds) || !near(x.v, to.v, speeds) || !near(x.d, to.d, std::fabs(from.d)) ||
        x.motor != to.motor || x.twist != to.twist || x.load != to.load)
        return false;
    tangent = {turned * x.q.slope,    by.ratio * x.a.value + sheet.ratio * x.a.slope,
               x.a.slope - x.v.slope, x.d.slope,
               x.angle.slope,         x.hysteresis.slope};
    return true;
}

DriveSheet sheet_slope(const model::Train& train, const std::string& key) {
    model::Train shifted = train;
    double& value = *model::find_parameter(shifted, key);
    // A power of two, so that sums and differences are exact.
    const double shift = value == 0.0 ? 1.0 : std::ldexp(1.0, std::ilogb(value) - 20);
    value += shift;
    const auto before = std::bit_cast<SheetNumbers>(sheet_of(train, 0.0));
    auto slopes = std::bit_cast<SheetNumbers>(sheet_of(shifted, 0.0));
    for (std::size_t k = 0; k < sheet_size; ++k)
        slopes[k] = slopes[k] == before[k] ? 0.0 : (slopes[k] - before[k]) / shift;
    return std::bit_cast<DriveSheet>(slopes);
}

}  // namespace lostmotion::batch
