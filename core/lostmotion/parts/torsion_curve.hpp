// Torsion curve P(d): odd, continuous, piecewise linear (eq. 14). A first piece of slope 0 is backlash.
#pragma once

#include <cmath>
#include <vector>

namespace lostmotion {

class TorsionCurve {
 public:
    TorsionCurve() : TorsionCurve({}, {1.0}) {}

    // breaks: twists [rad] > 0 at which the slope changes, rising; slopes: [N m/rad], one more than breaks.
    TorsionCurve(std::vector<double> breaks, std::vector<double> slopes)
        : breaks_(std::move(breaks)), slopes_(std::move(slopes)), offsets_(slopes_.size(), 0.0) {
        for (std::size_t k = 0; k < breaks_.size(); ++k)
            offsets_[k + 1] = offsets_[k] + (slopes_[k] - slopes_[k + 1]) * breaks_[k];
    }

    // The same breaks, all slopes times `factor`.
    TorsionCurve scaled(double factor) const {
        std::vector<double> slopes = slopes_;
        for (double& k : slopes) k *= factor;
        return TorsionCurve(breaks_, std::move(slopes));
    }

    // Pieces are numbered -n..n; piece 0 contains d = 0.
    int outermost_piece() const { return static_cast<int>(breaks_.size()); }
    int locate(double d) const {
        int k = 0;
        while (k < outermost_piece() && std::fabs(d) > breaks_[k]) ++k;
        return d < 0.0 ? -k : k;
    }
    double slope(int piece) const { return slopes_[std::abs(piece)]; }
    // Within a piece P = slope * d + offset.
    double offset(int piece) const { return piece < 0 ? -offsets_[-piece] : offsets_[piece]; }
    // The ends of a piece; the outermost ones have only one.
    double lower(int piece) const { return piece > 0 ? breaks_[piece - 1] : -breaks_[-piece]; }
    double upper(int piece) const { return piece >= 0 ? breaks_[piece] : -breaks_[-piece - 1]; }

    double torque(double d) const {
        const int p = locate(d);
        return slope(p) * d + offset(p);
    }
    // Elastic energy [J] stored at twist d: the integral of P.
    double energy(double d) const { return energy(0.0, std::fabs(d)); }
    // What it grows by from one twist to another. The difference of two energies would lose the digits of a small
    // change.
    double energy(double from, double to) const {
        if (from > to) return -energy(to, from);
        double sum = 0.0;
        for (int p = locate(from); from < to; ++p) {
            const double end = p < outermost_piece() ? std::fmin(to, upper(p)) : to;
            sum += 0.5 * slope(p) * (end - from) * (end + from) + offset(p) * (end - from);
            from = end;
        }
        return sum;
    }
    double max_slope() const {
        double k = 0.0;
        for (double s : slopes_) k = std::fmax(k, s);
        return k;
    }

 private:
    std::vector<double> breaks_, slopes_, offsets_;
};

}  // namespace lostmotion
