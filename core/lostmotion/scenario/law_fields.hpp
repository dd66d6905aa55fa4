// Controllers as scenario files write them, where the core takes other numbers.
#pragma once

#include <numbers>

#include "control_fields.hpp"
#include "machine_fields.hpp"

namespace lostmotion::tables {

template <class Use>
void each_law(Use&& use) {
    use("LowPass", [](auto& f) { control::Filter().describe_low_pass(f); });
    use("Notch", [](auto& f) { control::Filter().describe_notch(f); });
    use("TransferFunction", [](auto& f) { control::Filter().describe_transfer_function(f); });
    use("DutyCurve", [](auto& f) {
        f.list({"errors", "", "rad", not_negative, needed, "position errors, rising from 0"}, {}, {0, Entries::any});
        f.list({"values", "", "", share, needed, "duty cycle at each of them, from 0 on"}, {}, {0, Entries::any});
    });
    use("FirstOrderCurrent",
        [](auto& f) { f.number({"time_constant", "", "s", positive, needed, "with which the torque follows"}); });
    use("SampledLoop",
        [](auto& f) { f.number(above_zero("sample_time", "s", "default: the value of the controller")); });
    use("CameraTiming", [](auto& f) {
        f.number({"sample_time", "", "s", positive, needed,
                  "time from frame to frame; a whole multiple of the controller's sample time"});
        f.number({"latency", "", "s", not_negative, has_default,
                  "from the exposure of a frame until the controller has what it shows; a whole multiple, too"});
    });
    use("EncoderDelay", [](auto& f) {
        f.integer({"delay", "", "", any, has_default, "sample times from the reading until the controller has it"}, 0,
                  0, 1000);
    });
    use("PID", [](auto& f) {
        f.number(
            {"proportional_weight", "b", "", share, has_default,
             "share of the reference that the proportional part sees: below 1 steps of the reference overshoot less"},
            1.0);
        f.number(
            {"derivative_weight", "c", "", share, has_default,
             "share of the reference that the derivative part sees: 0 takes the derivative of what is measured alone"});
        f.number({"filter_time", "tau", "s", not_negative, has_default,
                  "time constant of the first-order filter of the derivative"});
    });
    const auto pid = [&](const char* name, const char* gain, const char* integral, const char* derivative) {
        use(name, [=](auto& f) {
            f.number({"gain", "", gain, not_negative, has_default, "k_p"});
            f.number({"integral_gain", "", integral, not_negative, has_default, "k_i"});
            f.number({"derivative_gain", "", derivative, not_negative, has_default, "k_d"});
        });
    };
    pid("PositionPID", "N*m/rad", "N*m/rad/s", "N*m*s/rad");
    pid("SpeedPID", "N*m*s/rad", "N*m/rad", "kg*m^2");
    use("StateSpace", [](auto& f) {
        f.matrix({"A", "", "", any, has_default, "one row for each state"});
        f.matrix({"B", "", "", any, has_default, "one row for each state, a column for each input"});
        f.list({"C", "", "", any, has_default, "one entry for each state"}, {}, {0, Entries::any});
        f.list({"D", "", "", any, has_default, "one entry for each input"}, {0.0}, {0, Entries::any});
        f.list(
            {"back_calculation", "", "", any, may_be_left_out,
             "per state, what the excess over the limit adds to its rate: x' = A x + B e + back_calculation (u - v)"},
            {}, {0, Entries::any});
    });
    use("ContinuousController", [](auto& f) {
        f.number(above_zero(
            "limit", "N*m",
            "limit of the magnitude of the torque; torque_limit and the largest current of the motor act, too"));
        f.number(above_zero(
            "anti_windup_time", "s",
            "with which the integrator follows the limited output (back-calculation); left out, gain/integral_gain"));
    });
    use("Controller", [](auto& f) {
        f.number({"sample_time", "", "s", positive, needed,
                  "sample time of the innermost loop, and of loops without their own"});
        f.integer({"delay", "", "", any, has_default, "sample times from reading the encoders until the result acts"},
                  1, 0, 1);
        f.number(above_zero("blend_time", "s",
                            "time constant of the low pass through which the position encoder corrects the encoder of "
                            "the speed loop; left out, the position encoder counts alone"));
        f.flag({"law", "", "", any, has_default,
                "the loops are a function of your own, which `simulate(..., law=function)` gives"},
               false);
        f.number({"phase", "", "s", not_negative, has_default,
                  "by which the samples of the position loop come after those of the others"});
    });
    use("Satellite", [](auto& f) {
        f.texts({"elements", "", "", any, needed, "the two lines"}, 2);
        f.instant({"begin", "", "", any, needed, "UTC at t = 0, such as 2024-05-01T20:15:00Z"});
        f.number({"latitude", "", "rad", any, needed, "latitude of the station, geodetic"}, 0.0,
                 -0.5 * std::numbers::pi, 0.5 * std::numbers::pi);
        f.number({"longitude", "", "rad", any, needed, "east"});
        f.number({"altitude", "", "m", any, has_default, "above the ellipsoid"});
        f.number({"ut1", "", "s", any, has_default, "UT1 - UTC, as the IERS publishes it; a second is 15 arcsec"}, 0.0,
                 -1.0, 1.0);
    });
}

}  // namespace lostmotion::tables
