#include "firmware.hpp"

namespace lostmotion::control {

double Firmware::duty(double error) const {
    const double e = std::fmax(std::fabs(error) - dead_band, 0.0);
    std::size_t k = 1;
    while (k < errors.size() && e > errors[k]) ++k;
    if (k == errors.size()) return std::copysign(duties.back(), error);
    const double share = (e - errors[k - 1]) / (errors[k] - errors[k - 1]);
    return std::copysign(1.0, error) * (duties[k - 1] + share * (duties[k] - duties[k - 1]));
}

}  // namespace lostmotion::control
