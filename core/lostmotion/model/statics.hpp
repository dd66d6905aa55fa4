// Reactions of stuck contacts, from the condition that their speeds stay zero.
#pragma once

#include <array>
#include <initializer_list>
#include <span>
#include <vector>

#include "../base/elimination.hpp"
#include "places.hpp"

namespace lostmotion::model {

// For each shaft: the first shaft of those that contacts at rest and the mass matrix join to it.
std::vector<int> parts(const Places& places, const Key& key);
// A shaft of given motion that rigid gears tie to the output of a rigid gear, without that gear itself; or nowhere.
int given_behind(const Places& places, const Train& train, std::size_t gear);

// The mass matrix J of the shafts, most often diagonal, and J = L D L^T of those whose motion is not given.
struct Inertias {
    explicit Inertias(const Places& places);

    std::vector<double> of, pivot;            // of each shaft: the diagonals of J and of D
    std::vector<std::vector<double>> factor;  // L, where J is not diagonal
};

// What the reactions of stuck contacts are solved from, J being the mass matrix. Where the shafts
// of each rigidly tied part have inertias of like size, reactions come first: C J^-1 (F + B lambda) = 0, C being the
// speeds of the contacts by those of the shafts. A light shaft makes terms 1/J of that which cancel. Then all is solved
// at once, without a division by an inertia: the balances J S a = F + B lambda of all shafts, S being their speeds by
// those that stay free, the heaviest. Of a free shaft that moves no inertia the unknown is the speed itself, which F
// depends on by dampers.
class Statics {
 public:
    // The motion of the regime is, for each shaft, the net torque; it becomes the acceleration. That of a shaft whose
    // motion is given is an input: J is infinite there.
    Statics(const Places& places, const Inertias& inertias, Regime& regime)
        : places_(places),
          contacts_(places.contacts),
          layout_(places.layout),
          inertias_(inertias),
          regime_(regime),
          key_(regime.key),
          ties_(regime.ties),
          motion_(regime.motion) {}

    // Some lists of forms.
    using Forms = std::initializer_list<std::span<Row>>;
    // Eliminates the reactions from the motion and the forms, and finds the speeds of shafts without inertia. False if
    // they have no unique solution.
    bool solve(Forms forms);
    // Do the inertias of tied shafts, as one of these feels them, differ that much?
    bool has_light_shafts() const;

 private:
    std::vector<int> stuck() const;
    // motion = J^-1 motion.
    void divide_by_inertias();
    // Calls use(shaft, inertia) for each entry of a row of J; that of a shaft whose motion is given is 1 w' = w'_given.
    template <class Use>
    void each_inertia(std::size_t shaft, Use&& use) const {
        const int s = static_cast<int>(shaft);
        use(s, is_given(shaft) ? 1.0 : inertias_.of[shaft]);
        if (!is_given(shaft)) places_.each_coupled_inertia(s, use);
    }
    bool solve_reactions(const std::vector<int>& of, Forms forms);
    bool solve_balances(const std::vector<int>& of, Forms forms);
    // Does a torque that the gears of a rigidly tied part pass on turn it forward or, while a contact of it is at its
    // limit, wind it up? Without friction the matrix of accelerations over reactions, C J^-1 C^T, is positive definite.
    // Friction that changes the sign of its determinant jams: no motion or several (Painleve). That sign is also that
    // of det [J S, -B] over det [J S, C^T].
    bool moves_freely(const std::vector<int>& of, const std::vector<Row>& rows) const;
    bool balances_move_freely(const std::vector<int>& of, const Ties& heavy) const;
    std::size_t shafts() const { return places_.shafts.size(); }
    bool is_given(std::size_t shaft) const { return places_.shafts[shaft].given_acceleration != nowhere; }
    Row acceleration_of(std::size_t shaft) const {
        return Row::unit(layout_.first_input + places_.shafts[shaft].given_acceleration);
    }
    int unknown(int contact) const { return layout_.terms + contact; }
    // Puts the speeds of shafts without inertia that follow others into a form.
    void follow(Row& f, const Ties& heavy) const;

    const Places& places_;
    const std::vector<ContactPlace>& contacts_;
    const Layout& layout_;
    const Inertias& inertias_;
    Regime& regime_;
    const Key& key_;
    const Ties& ties_;
    std::vector<Row>& motion_;
};

}  // namespace lostmotion::model
