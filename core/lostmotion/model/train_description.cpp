#include "train_description.hpp"

namespace lostmotion::model {

void TrainDescription::add_mass_matrix(const std::string& name, const std::vector<std::string>& shafts,
                                       std::vector<std::vector<double>> matrix) {
    MassMatrix m{name, {}, std::move(matrix)};
    for (const std::string& shaft : shafts) m.shafts.push_back(place_of(shaft));
    train.mass_matrices.push_back(std::move(m));
}

void TrainDescription::set_housing(const std::string& gear, const std::string& shaft) {
    for (Gear& g : train.gears)
        if (g.name == gear) g.housing = place_of(shaft);
}

void TrainDescription::add_controller(LinearController c, const std::string& motor) {
    c.motor = -1;
    for (std::size_t k = 0; k < train.motors.size(); ++k)
        if (train.motors[k].name == motor) c.motor = static_cast<int>(k);
    c.name = motor;
    train.controllers.push_back(std::move(c));
}

int TrainDescription::place_of(const std::string& shaft) const {
    for (std::size_t k = 0; k < train.shafts.size(); ++k)
        if (train.shafts[k].name == shaft) return static_cast<int>(k);
    return -1;
}

}  // namespace lostmotion::model
