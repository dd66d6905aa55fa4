// Inertias that several shafts have together: their kinetic energy is 1/2 w^T M w.
#pragma once

#include <string>
#include <vector>

namespace lostmotion::model {

// M holds the inertias of these shafts in place of their own; rotors and gears on them are added to its diagonal. It is
// symmetric and positive definite. Between two shafts [kg m2], between two slides [kg], between one of each [kg m].
struct MassMatrix {
    std::string name;
    std::vector<int> shafts;
    std::vector<std::vector<double>> matrix;
};

}  // namespace lostmotion::model
