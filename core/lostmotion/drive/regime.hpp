// One regime of the drive: dx/dt = A x + B u and the linear conditions that end it. All that a solver sees.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "variables.hpp"

namespace lostmotion {

// A contact slips forward (+1), slips backward (-1) or is stuck (0). A contact that the drive does not have is
// `absent` and acts as if it were not there.
inline constexpr std::int8_t absent = 2;
using Modes = std::array<std::int8_t, n_contacts>;

// Which regime: the mode of each contact, the amplifier's saturation, the piece of the torsion curve and the
// cell(s) of the loss map.
struct RegimeKey {
    Modes modes{absent, absent, absent};
    std::int8_t amplifier = 0;   // -1, +1: at the voltage limit
    std::int16_t piece = 0;      // of the torsion curve
    std::int16_t unused = 0;     // so that all bits are given
    std::int32_t cell = 0;       // slipping: triangle; stuck: load interval for starting forward ...
    std::int32_t cell_back = 0;  // ... and backward

    // Eight bytes of it. Loaded as one vector, a key that has just been written would wait for its stores.
    std::uint64_t half(std::size_t k) const {
        std::uint64_t bits;
        __builtin_memcpy(&bits, reinterpret_cast<const char*>(this) + k * sizeof bits, sizeof bits);
        return bits;
    }
    friend bool operator==(const RegimeKey& a, const RegimeKey& b) {
        return ((a.half(0) ^ b.half(0)) | (a.half(1) ^ b.half(1))) == 0;
    }

    std::size_t hash() const {
        const std::uint64_t mixed = (half(0) * 0x9e3779b97f4a7c15u) ^ (half(1) * 0xc2b2ae3d27d4eb4fu);
        return mixed ^ (mixed >> 32);
    }
};

// A regime holds while each of its guards is >= 0.
struct Guard {
    enum Kind : std::uint8_t {
        speed,          // a slipping contact comes to rest
        capacity,       // a stuck contact is overcome
        torsion_piece,  // the twist leaves its piece of the curve
        loss_cell,      // load and speed leave their cell of the loss map
        loss_cell_back,
        amplifier,  // the command crosses the voltage limit
        turning,    // the torque that drives a contact at its limit turns back
        outside,    // the extended loss map ends, or a state leaves the range of the arithmetic
    };
    LinearForm form;
    Kind kind = outside;
    Contact contact = input_contact;  // for speed and capacity
    int neighbour = 0;        // for pieces, cells and the amplifier: the index beyond; capacity: the sign of slip
    bool by_grazing = false;  // ends the regime also by touching zero without falling through it

    bool behind = false;  // an edge of the curve that the twist slips away from, so that it does not reach it

    // Edge of the curve, the map or the amplifier, with a neighbour beyond.
    bool is_edge() const { return kind >= torsion_piece && kind <= amplifier; }
    Contact subject() const { return contact; }
    // Says whether a contact goes on in its mode.
    bool is_of_contact() const { return kind == speed || kind == capacity || kind == turning; }
};

using GuardTable = FormTable<DriveDims, max_guards>;

struct Regime {
    RegimeKey key;
    std::array<LinearForm, n_states> rate{};  // dx/dt
    LinearForm output_torque;                 // T_2 [N m]
    LinearForm source_torque;                 // M_D [N m]
    LinearForm input_friction;                // F, all that the input contact takes [N m at the input]
    LinearForm input_torque;                  // T_1 [N m]; while the input contact is stuck, T_2/i only
    LinearForm loss_torque;                   // i T_1 - T_2 [N m]: the losses, signed as the input speed
    LinearForm hysteresis_torque;             // H [N m]
    LinearForm load_friction;                 // what the load contact takes [N m]
    std::array<Guard, max_guards> guards;
    int n_guards = 0;
    bool solvable = true;  // false: the reactions have no unique solution (jamming)
    bool in_data = true;   // false: the loss map is used outside its data

    std::array<bool, n_contacts> at_rest{};  // contacts whose speeds this regime keeps at exactly zero
    // Of the coupled states: speeds that are kept at zero, and those that follow another as the twist at rest has it.
    std::array<bool, n_coupled> resting{}, following{};
    // While all is at rest with one contact at its limit, an input by which it is driven there has to go on this way.
    int driving_input = -1;  // -1: none
    double driving_way = 0.0;
};

}  // namespace lostmotion
