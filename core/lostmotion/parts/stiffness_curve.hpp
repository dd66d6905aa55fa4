// A stiffness as data sheets and scenario files give it, and the torsion curve that it makes.
#pragma once

#include <limits>
#include <string>
#include <vector>

#include "field.hpp"
#include "torsion_curve.hpp"

namespace lostmotion {

struct StiffnessCurve {
    static constexpr int number = 1;
    std::vector<double> slopes, breaks;
    double backlash = 0.0, preload = 0.0, backward = 1.0;

    template <class Fields>
    void describe(Fields& f) {
        f.list({"slopes", "", "N*m/rad", Range::not_negative, Given::needed,
                "slopes of the segments, from twist 0 outwards"},
               slopes);
        f.list({"breaks", "", "rad", Range::positive, Given::has_default,
                "breakpoints: twists at which the slope changes; one fewer than slopes"},
               breaks);
        f.number({"backlash", "", "rad", Range::not_negative, Given::has_default,
                  "total gap at the output, before the first segment"},
                 backlash);
        f.number({"preload", "", "N*m", Range::not_negative, Given::has_default,
                  "torque that presses two flanks together: segments below it are left out"},
                 preload);
        f.number({"backward", "", "", Range::positive, Given::has_default,
                  "stiffness at negative twists over that at positive ones"},
                 backward);
    }

    std::string wrong() const {
        if (slopes.size() != breaks.size() + 1) return "must have one slope more than breaks";
        double before = 0.0;
        for (const double b : breaks) {
            if (!(b > before)) return "must have breaks that rise";
            before = b;
        }
        if (!(slopes.back() > 0.0)) return "must end with a slope > 0";
        return backlash > 0.0 && preload > 0.0 ? "has backlash and preload, which removes it" : "";
    }
    TorsionCurve curve() const {
        std::vector<double> backwards = slopes;
        for (double& k : backwards) k *= backward;
        return {side(slopes), side(backwards)};
    }

 private:
    TorsionCurve::Side side(const std::vector<double>& of) const {
        TorsionCurve::Side out{breaks, of};
        if (backlash > 0.0) {
            const double gap = 0.5 * backlash;
            for (double& b : out.breaks) b = gap + b;
            out.breaks.insert(out.breaks.begin(), gap);
            out.slopes.insert(out.slopes.begin(), 0.0);
        } else if (preload > 0.0) {
            leave_out_below(preload, out);
        }
        return out;
    }
    static void leave_out_below(double torque, TorsionCurve::Side& side) {
        double reached = 0.0, begin = 0.0;
        std::size_t k = 0;
        for (; k < side.breaks.size(); ++k) {
            const double rise = side.slopes[k] * (side.breaks[k] - begin);
            if (reached + rise >= torque) break;
            reached += rise;
            begin = side.breaks[k];
        }
        const double end = k < side.breaks.size() ? side.breaks[k] : std::numeric_limits<double>::infinity();
        const double start = begin + (torque - reached) / side.slopes[k];
        if (start >= end) ++k;
        const auto kept = static_cast<std::ptrdiff_t>(k);
        side.slopes.erase(side.slopes.begin(), side.slopes.begin() + kept);
        side.breaks.erase(side.breaks.begin(), side.breaks.begin() + kept);
        for (double& b : side.breaks) b -= start;
    }
};

}  // namespace lostmotion
