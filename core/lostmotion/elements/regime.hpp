// One regime of a train: its key, the rates of the states and the guards that end it.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "row.hpp"

namespace lostmotion::model {

inline constexpr long max_pieces = 30000;  // of a law: they are counted in 16 bits

// Which regime: the mode of each contact (slips forward +1, backward -1, stuck 0) and the branch of each piecewise law.
struct Key {
    Few<std::int8_t, 16> modes;
    Few<std::int16_t, 32> branch;

    friend bool operator==(const Key&, const Key&) = default;
    std::size_t hash() const;
};
struct KeyHash {
    std::size_t operator()(const Key& k) const { return k.hash(); }
};

struct GuardKinds {
    enum Kind : std::uint8_t {
        speed,        // a slipping contact comes to rest
        capacity,     // a stuck contact is overcome
        edge,         // a state leaves its piece or cell of a law
        input_limit,  // an input crosses a limit
        turning,      // the torque that drives a contact at its limit turns back
        outside,      // the extended data of a law end
        set_off,      // a contact at rest whose speed is given begins to move
        impact,       // rigid flanks strike, or have done so infinitely often
    };
};

// A regime holds while each of its guards is >= 0.
template <class Form>
struct GuardOf {
    using Kind = GuardKinds::Kind;
    static constexpr Kind speed = GuardKinds::speed, capacity = GuardKinds::capacity, edge = GuardKinds::edge,
                          input_limit = GuardKinds::input_limit, turning = GuardKinds::turning,
                          outside = GuardKinds::outside, set_off = GuardKinds::set_off, impact = GuardKinds::impact;

    Form form{};
    Kind kind = outside;
    int contact = -1;         // for speed and capacity; the contact that a law belongs to, if any
    int branch = -1;          // for edges and limits: the law
    int neighbour = 0;        // for edges and limits: the branch beyond; capacity: the sign of slip
    bool by_grazing = false;  // ends the regime also by touching zero without falling through it
    int memory = -1;          // set if crossing shifts a memory (the turn of an angle) by `shift`
    double shift = 0.0;
    bool behind = false;  // an edge that the twist slips away from, so that it does not reach it

    // The same guard with another form.
    template <class Other>
    GuardOf<Other> with(Other other) const {
        return {std::move(other), kind, contact, branch, neighbour, by_grazing, memory, shift, behind};
    }
    // Its value is known to a rounding of this, however small its terms: that of an angle where a turn ends.
    double size_at_least() const { return shift < 0.0 ? -2.0 * shift : 2.0 * shift; }
    // Edge of a law or limit of an input, with a neighbour beyond.
    bool is_edge() const { return kind == edge || kind == input_limit; }
    // Says whether a contact goes on in its mode.
    bool is_of_contact() const {
        return kind == speed || kind == capacity || kind == turning || kind == set_off || kind == impact;
    }
    // The contact; -2 - branch for a law that belongs to no contact.
    int subject() const { return contact < 0 && branch >= 0 ? -2 - branch : contact; }
    // The derivative of the form that is the acceleration of the contact.
    static int acceleration_order(Kind kind) { return kind == impact ? 2 : kind == speed ? 1 : 0; }
};
using Guard = GuardOf<Row>;

using Flags = Few<bool, 32>;  // of contacts or shafts
std::size_t hash_of(const Flags& flags);
std::size_t hash_of(const decltype(Key::modes)& modes);

// A share of the speed of a shaft in another.
struct Share {
    int shaft;
    double share;
};
// Shares of shafts, in their order.
class Shares {
 public:
    const Share* begin() const { return at_.begin(); }
    const Share* end() const { return at_.begin() + count_; }
    std::size_t size() const { return count_; }
    bool empty() const { return count_ == 0; }
    // The share of a shaft, or 0 where it has none.
    double of(int shaft) const {
        const Share* found = find(shaft);
        return found != end() && found->shaft == shaft ? found->share : 0.0;
    }
    bool has(int shaft) const {
        const Share* found = find(shaft);
        return found != end() && found->shaft == shaft;
    }
    // Sets the share of a shaft, which may have one already.
    void set(int shaft, double share);
    void erase(int shaft);

 private:
    const Share* find(int shaft) const {
        return std::find_if(begin(), end(), [shaft](const Share& s) { return s.shaft >= shaft; });
    }

    Few<Share, 4> at_;
    std::size_t count_ = 0;
};

// Speeds that the contacts at rest tie together: each a sum over those that stay free.
struct Ties {
    std::vector<Shares> of;  // of each shaft; none: at rest
    Flags at_rest;
    bool is_free(int s) const { return of[static_cast<std::size_t>(s)].has(s); }
    bool follows(int s) const { return !of[static_cast<std::size_t>(s)].empty() && !is_free(s); }
    // Calls use(k, share) for each free shaft that the speed of a shaft depends on.
    template <class Use>
    void each_share(int s, Use&& use) const {
        for (const Share& share : of[static_cast<std::size_t>(s)]) use(share.shaft, share.share);
    }
    // Stuck, but its speed is kept at zero by those before it, or given and zero.
    Flags redundant;
};

// What takes a torque that rest leaves open along with the limit of a contact: where the inputs have a part in it, it
// does so while `torque`, that torque in the direction that restores the hold, rises. `rate`: the part of the states in
// its derivative.
template <class Form>
struct Driver {
    int contact = -1;
    Form torque{}, rate{};
};

// Which bound a locked torque has come to: of its own contact, or of the friction of the shaft that it turns.
enum class Bound : std::uint8_t { none, low, high, friction_below, friction_above };

// A torque that rest leaves open, and the forms that bound it: its own contact holds it from `low` to `high`; where the
// shaft that it turns is held by friction, it also lies within `friction` of what that shaft `needs`.
template <class Form>
struct LockedTorque {
    int contact = -1, memory = -1;  // where it acts, and where it is remembered
    bool has_low = false, has_high = false, on_held_shaft = false;
    Form low{}, high{}, needs{}, friction{};
    // What the shaft needs beside `needs`: shares of T_2 of gears and of the torques of couplings that are stuck as
    // well, by contact.
    Few<double, 4> needs_torque;

    // The same torque with other forms: other(form) of each.
    template <class Other>
    auto with(Other&& other) const -> LockedTorque<decltype(other(low))> {
        return {contact,    memory,      has_low,      has_high,        on_held_shaft,
                other(low), other(high), other(needs), other(friction), needs_torque};
    }
    // The bound that is a sum of forms: calls use(form, factor) for each, and says whether other torques count as well.
    template <class Use>
    bool each_form(Bound bound, Use&& use) const {
        if (bound == Bound::low) use(low, 1.0);
        if (bound == Bound::high) use(high, 1.0);
        if (bound != Bound::friction_below && bound != Bound::friction_above) return false;
        use(needs, 1.0);
        use(friction, bound == Bound::friction_below ? -1.0 : 1.0);
        return true;
    }
};

// The speed of a shaft without inertia, which follows from the balance of its torques: w as a form of all else.
struct MasslessSpeed {
    int speed = -1;  // the state that the form takes the place of
    Row form;
};

struct Regime {
    Key key;
    std::vector<Row> rate;  // of each state
    std::vector<Guard> guards;
    std::vector<Row> motor_torque;     // of each motor [N m]
    std::vector<Row> output_torque;    // T_2 of each gear [N m]
    std::vector<Row> input_torque;     // T_1 of each gear [N m]; while its input shaft is stuck without dry losses
    std::vector<Row> gear_hysteresis;  // H of each gear [N m]
    std::vector<Row> contact_torque;   // what each contact takes [N m]
    std::vector<Row> drive_torque;     // of each given motion: what it turns its shaft with [N m]
    std::vector<Row> motion;           // of each shaft: the net torque, then its acceleration
    std::vector<Row> loss;             // of each gear: what acts on the contact of its input shaft [N m]
    std::vector<MasslessSpeed> massless;
    // By the modes alone:
    Ties ties;
    Flags kept_at_rest;   // contacts whose speeds the ties keep at zero
    Flags at_rest;        // contacts that are kept at rest or redundant, but no gap that is open
    Flags twist_rests;    // gears whose twist has no rate
    bool light_shafts{};  // whether inertias of tied shafts differ much
    std::vector<Driver<Row>> drivers;
    std::vector<LockedTorque<Row>> locked;  // in the order in which they are held: from the load to the motors
    // The only driver, if it is one input, and which way this has to go on.
    int driving_input = -1;  // -1: none, or more than that
    double driving_way = 0.0;
    bool solvable = true;  // false: the reactions have no unique solution (jamming)
    bool in_data = true;   // false: a loss map is used outside its data

    // Keeps its memory, and what the modes determine.
    void clear() {
        for (auto* rows : {&rate, &motor_torque, &output_torque, &input_torque, &gear_hysteresis, &contact_torque,
                           &drive_torque, &motion, &loss})
            rows->clear();
        guards.clear();
        massless.clear();
        drivers.clear();
        locked.clear();
        driving_input = -1;
        driving_way = 0.0;
        solvable = in_data = true;
    }
    // Puts the speeds of shafts without inertia into a form.
    void put_massless_speeds(Row& f) const {
        for (const MasslessSpeed& m : massless)
            if (const double share = f.c[m.speed]; share != 0.0) {
                f.c[m.speed] = 0.0;
                f += share * m.form;
            }
    }
};

}  // namespace lostmotion::model
