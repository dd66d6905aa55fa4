// A gear between two shafts of a train: ratio, compliance and loss law of a gearbox, and what a train adds to it.
#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>
#include <string>

#include "gearbox.hpp"
#include "mesh_efficiency.hpp"
#include "periodic_curve.hpp"

namespace lostmotion::model {

// What a gear takes at its output [N m], and how that changes with the torque in its mesh.
struct MeshLoss {
    double torque = 0.0, per_torque = 0.0;
};

struct Gear {
    std::string name;
    int input = 0, output = 0;  // shafts
    // Shaft that the housing is on: w_in - w_h = i (w_out - w_h); -1: the frame. Of a planetary gear whose sun is the
    // input and whose carrier is the output it is the ring.
    int housing = -1;
    Gearbox law;
    std::optional<MeshEfficiency> efficiencies;  // of both directions of power flow, in place of the law's losses
    // Mesh damping [N m s/rad, at the output]: acts while the flanks touch. They part when P + c d' would pull.
    double mesh_damping = 0.0;
    // The torque of the damping is at most that of the spring, |c d'| <= |P|, so that none jumps where flanks meet.
    bool damping_limited = false;
    // Rigid flanks in place of a compliance: what the play is [rad, at the output], 0 of a gear without, and the speed
    // at which the flanks part over that at which they strike.
    double flank_backlash = 0.0, restitution = 0.0;
    PeriodicCurve transmission_error;  // e [rad, at the output] over the angle of the input shaft
    // Factor on the stiffness over the same angle, constant from each angle of the curve to the next, as more and fewer
    // pairs of teeth mesh.
    PeriodicCurve mesh_stiffness;

    // What a gear has beside the law of a gearbox.
    template <class Fields>
    void describe(Fields& f) {
        f.optional("efficiencies", efficiencies, MeshEfficiency(1.0, 1.0), [&](MeshEfficiency& e) {
            double driving = e.driving(), overrunning = e.overrunning();
            f.number("driving", driving, Range::positive);
            f.number("overrunning", overrunning);
            e = MeshEfficiency(driving, overrunning);
        });
        f.number({"mesh_damping", "", "N*m*s/rad", Range::not_negative, Given::has_default,
                  "at the output, while the flanks touch; they part when it would pull"},
                 mesh_damping);
        f.flag({"damping_limited", "", "", Range::any, Given::has_default,
                "whether the torque of the mesh damping is at most that of the spring, so that no torque jumps where "
                "flanks meet; needs backlash"},
               damping_limited);
        f.number({"flanks.backlash", "", "rad", Range::not_negative, Given::none}, flank_backlash);
        f.number({"flanks.restitution", "", "", Range::any, Given::none}, restitution);
        bool present = transmission_error.present();
        f.curve_if("transmission_error", present, transmission_error);
        bool varies = mesh_stiffness.present();
        f.curve_if("mesh_stiffness", varies, mesh_stiffness);
    }

    bool over_angle() const { return transmission_error.present() || mesh_stiffness.present(); }
    bool strikes() const { return flank_backlash > 0.0; }
    bool rigid() const { return law.compliance == Gearbox::rigid && !strikes(); }
    bool has_dry_losses() const { return efficiencies || law.losses == Gearbox::loss_map; }
    // May its friction stop it in motion, as the torque in its mesh grows without limit?
    bool may_lock() const {
        if (!rigid() || !has_dry_losses()) return false;
        if (efficiencies) return efficiencies->overrunning() < 0.0;
        for (int j = 0; j < load_intervals(); ++j)
            if (std::fabs(loss_at_standstill(j).per_load) > 1.0) return true;
        return false;
    }
    bool has_backlash() const { return law.compliance != Gearbox::rigid && law.curve.slope(0) == 0.0; }
    bool parts_flanks() const { return mesh_damping > 0.0 && has_backlash(); }
    enum Flanks { touching, parted, limited };
    // Of flanks on one side of the gap (way: +1 or -1), from P and c d'.
    Flanks flanks(double way, double P, double damping) const {
        if (way * (P + damping) < 0.0) return parted;
        return damping_limited && way * (damping - P) > 0.0 ? limited : touching;
    }
    // i < 0: the output turns against the input. Losses see the torque in the direction in which the input turns it.
    double sense() const { return law.ratio < 0.0 ? -1.0 : 1.0; }
    double reduction() const { return std::fabs(law.ratio); }
    double per_housing() const { return 1.0 - 1.0 / law.ratio; }                          // of the twist's rate
    double rated_torque() const { return efficiencies ? 1.0 : law.rated_output_torque; }  // scales mu

    // The loss law, whichever it is.
    template <class Use>
    auto with_losses(Use&& use) const {
        return efficiencies ? use(*efficiencies) : use(law.map);
    }
    template <class F>
    LossTerms<F> loss_terms(int one, int speed, const F& T_2) const {
        return {rated_torque(), law.rated_input_speed, reduction(), one, speed, sense() * T_2};
    }
    Plane loss_plane(int cell) const {
        return with_losses([&](const auto& m) { return m.plane(cell); });
    }
    Plane loss_at_standstill(int j) const {
        return with_losses([&](const auto& m) { return m.line_at_standstill(j); });
    }
    int loss_edges(int cell, Edge out[3]) const {
        return with_losses([&](const auto& m) { return m.edges(cell, out); });
    }
    int loss_cell(double mu, double v) const {
        return with_losses([&](const auto& m) { return m.triangle(mu, v); });
    }
    // The cells of both directions at a relative torque and an input speed [rad/s], while the input shaft turns by s.
    std::array<std::int16_t, 2> loss_cells(int s, double mu, double speed, double rated_speed) const {
        if (s == 0)
            return {static_cast<std::int16_t>(load_interval(mu)), static_cast<std::int16_t>(load_interval(-mu))};
        return {static_cast<std::int16_t>(loss_cell(s * mu, std::fabs(speed) / rated_speed)), 0};
    }
    int load_interval(double mu) const {
        return with_losses([&](const auto& m) { return m.load_interval(mu); });
    }
    int load_intervals() const {
        return with_losses([&](const auto& m) { return m.load_intervals(); });
    }
    bool in_data(int cell) const {
        return with_losses([&](const auto& m) { return m.in_data(cell); });
    }
    bool load_interval_in_data(int j) const {
        return with_losses([&](const auto& m) { return m.load_interval_in_data(j); });
    }
    // M_2B of the mesh torque T_2 [N m] in the direction of the motion (> 0: the input drives) at a speed of the input
    // shaft; at rest, what the gear can hold.
    MeshLoss loss(double driven, double speed) const {
        if (!has_dry_losses()) {  // (5b): T_1 = T_2/(i eta), whichever side drives
            const double share = 1.0 / law.efficiency - 1.0;
            return {share * driven, share};
        }
        const double T_2R = rated_torque(), mu = driven / T_2R, v = std::fabs(speed) / law.rated_input_speed;
        const Plane m = v == 0.0 ? loss_at_standstill(load_interval(mu)) : loss_plane(loss_cell(mu, v));
        return {T_2R * (m.at_zero + m.per_speed * v + m.per_load * mu), m.per_load};
    }
    // The same torque at rest.
    double loss_at_rest(double driven) const {
        return efficiencies ? loss(driven, 0.0).torque : law.loss_at_rest(driven);
    }
    // Bounds of an interval of the load axis, infinite where there is none.
    double load_lower(int j) const {
        if (efficiencies) return j == 0 ? -std::numeric_limits<double>::infinity() : 0.0;
        return law.map.load_interval_lower(j);
    }
    double load_upper(int j) const {
        if (efficiencies) return j == 0 ? 0.0 : std::numeric_limits<double>::infinity();
        return law.map.load_interval_upper(j);
    }
};

}  // namespace lostmotion::model
