// Guards of a regime: what ends it, element by element.
#pragma once

#include <algorithm>
#include <cmath>

#include "equations.hpp"

namespace lostmotion::model {

class RegimeGuards {
 public:
    // Of a regime whose torques and rates are known.
    RegimeGuards(const Equations& equations, const ElementForms& forms, Regime& regime)
        : equations_(equations),
          forms_(forms),
          train_(forms.train()),
          places_(forms.places()),
          layout_(forms.layout()),
          terms_(forms.terms()),
          regime_(regime) {}

    void add_all();

 private:
    bool held_in_motion(int contact) const;
    void add_speed_guards();
    void add_given_speed(int contact);
    void add_gear_capacities();
    void add_gaps();
    void add_coupling_capacities();
    void add_shaft_guards(int shaft);
    void add_loss_cells(int gear, int s, Row& capacity);
    void add_loss_edges(int gear);
    void add_turning();
    void add_driver(int contact);
    double largest_share(const Row& torque) const;
    bool turns(int shaft, int housing) const {
        return !regime_.ties.at_rest[shaft] || (housing != nowhere && !regime_.ties.at_rest[housing]);
    }
    bool moves(int state) const;
    void add_twist_pieces(int gear);
    void add_speed_pieces(int shaft);
    void add_input_limits();
    void add_coupling_pieces();
    void add_output_limits();

    Guard& add(const Row& form, Guard::Kind kind, int contact, int branch, int neighbour);

    const Equations& equations_;
    const ElementForms& forms_;
    const Train& train_;
    const Places& places_;
    const Layout& layout_;
    const Terms& terms_;
    Regime& regime_;
};

// Is a contact that "slips" kept at rest while its shafts turn, as in a loop of gears? Its speed is rounding.
inline bool RegimeGuards::held_in_motion(int contact) const {
    return regime_.at_rest[contact] && !regime_.ties.at_rest[places_.contacts[contact].a];
}

}  // namespace lostmotion::model
