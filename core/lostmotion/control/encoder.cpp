#include "encoder.hpp"

namespace lostmotion::control {

double Encoder::reading(double angle) const {
    const double read = resolution > 0.0 ? resolution * std::floor(angle / resolution + 0.5) : angle;
    return error > 0.0 ? read + error * sine_cosine(periods * angle + phase).sin : read;
}

}  // namespace lostmotion::control
