// Torsion curve P(d): continuous, piecewise linear, 0 at twist 0 (eq. 14). A piece 0 of slope 0 is backlash.
#pragma once

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "origin.hpp"

namespace lostmotion {

class TorsionCurve {
 public:
    // One side of twist 0, outwards. breaks: distances [rad] > 0 at which the slope changes, rising; slopes:
    // [N m/rad], one more than breaks.
    struct Side {
        std::vector<double> breaks, slopes;

        friend bool operator==(const Side&, const Side&) = default;
    };

    Origin origin;

    TorsionCurve() : TorsionCurve({}, {1.0}) {}
    TorsionCurve(std::vector<double> breaks, std::vector<double> slopes)
        : TorsionCurve(Side{breaks, slopes}, Side{breaks, slopes}) {}
    // If the slope changes at twist 0, piece 0 begins there.
    TorsionCurve(const Side& forward, const Side& backward) {
        const bool bends = forward.slopes[0] != backward.slopes[0];
        for (std::size_t k = backward.breaks.size(); k > 0; --k) edges_.push_back(-backward.breaks[k - 1]);
        for (std::size_t k = backward.slopes.size(); k > (bends ? 0 : 1); --k)
            slopes_.push_back(backward.slopes[k - 1]);
        zero_ = static_cast<int>(slopes_.size());
        if (bends) edges_.push_back(0.0);
        edges_.insert(edges_.end(), forward.breaks.begin(), forward.breaks.end());
        slopes_.insert(slopes_.end(), forward.slopes.begin(), forward.slopes.end());
        join();
    }

    // The same breaks, all slopes times `factor`.
    TorsionCurve scaled(double factor) const {
        TorsionCurve out = *this;
        out.origin = {};
        for (double& k : out.slopes_) k *= factor;
        out.join();
        return out;
    }

    // Pieces are numbered from first_piece() <= 0 to last_piece() >= 0; piece 0 contains d = 0.
    int first_piece() const { return -zero_; }
    int last_piece() const { return static_cast<int>(edges_.size()) - zero_; }
    int pieces() const { return static_cast<int>(slopes_.size()); }
    int locate(double d) const {
        int k = 0;
        while (d > 0.0 && k < last_piece() && d > upper(k)) ++k;
        while (d < 0.0 && k > first_piece() && d < lower(k)) --k;
        return k;
    }
    double slope(int piece) const { return slopes_[index(piece)]; }
    // Within a piece P = slope * d + offset.
    double offset(int piece) const { return offsets_[index(piece)]; }
    // The ends of a piece; the outermost ones have only one.
    double lower(int piece) const { return edges_[index(piece) - 1]; }
    double upper(int piece) const { return edges_[index(piece)]; }
    Side forward() const { return {{edges_.begin() + zero_, edges_.end()}, {slopes_.begin() + zero_, slopes_.end()}}; }
    Side backward() const {
        const bool bends = zero_ > 0 && lower(0) == 0.0;
        Side out;
        for (int k = bends ? -1 : 0; k >= first_piece(); --k) {
            out.slopes.push_back(slope(k));
            if (k > first_piece()) out.breaks.push_back(-lower(k));
        }
        return out;
    }
    bool odd() const { return forward() == backward(); }

    double torque(double d) const {
        const int p = locate(d);
        return slope(p) * d + offset(p);
    }
    // The piece with a torque [N m], outwards from twist 0, and the twist there [rad].
    int piece_at(double torque) const {
        int k = 0;
        while (torque > 0.0 && k < last_piece() && this->torque(upper(k)) < torque) ++k;
        while (torque < 0.0 && k > first_piece() && this->torque(lower(k)) > torque) --k;
        return k;
    }
    double twist(double torque) const {
        if (torque == 0.0) return 0.0;
        const int k = piece_at(torque);
        return (torque - offset(k)) / slope(k);
    }
    // Elastic energy [J] stored at twist d: the integral of P.
    double energy(double d) const {
        double sum = 0.0, from = 0.0;
        for (int p = 0; std::fabs(from) < std::fabs(d); p += d < 0.0 ? -1 : 1) {
            const double end = d < 0.0            ? p > first_piece() ? std::fmax(d, lower(p)) : d
                               : p < last_piece() ? std::fmin(d, upper(p))
                                                  : d;
            sum += work(p, from, end);
            from = end;
        }
        return sum;
    }
    // What it grows by from one twist to another. The difference of two energies would lose the digits of a small
    // change.
    double energy(double from, double to) const {
        if (from > to) return -energy(to, from);
        double sum = 0.0;
        for (int p = locate(from); from < to; ++p) {
            const double end = p < last_piece() ? std::fmin(to, upper(p)) : to;
            sum += work(p, from, end);
            from = end;
        }
        return sum;
    }
    double max_slope() const { return std::fmax(0.0, *std::max_element(slopes_.begin(), slopes_.end())); }
    double min_slope() const { return *std::min_element(slopes_.begin(), slopes_.end()); }

 private:
    std::size_t index(int piece) const { return static_cast<std::size_t>(zero_ + piece); }
    double work(int piece, double from, double to) const {
        return 0.5 * slope(piece) * (to - from) * (to + from) + offset(piece) * (to - from);
    }
    // The offsets that make it continuous.
    void join() {
        offsets_.assign(slopes_.size(), 0.0);
        const std::size_t zero = index(0);
        for (std::size_t k = zero; k + 1 < slopes_.size(); ++k)
            offsets_[k + 1] = offsets_[k] + (slopes_[k] - slopes_[k + 1]) * edges_[k];
        for (std::size_t k = zero; k > 0; --k)
            offsets_[k - 1] = offsets_[k] + (slopes_[k] - slopes_[k - 1]) * edges_[k - 1];
    }

    int zero_ = 0;  // index of piece 0
    std::vector<double> edges_, slopes_, offsets_;
};

}  // namespace lostmotion
