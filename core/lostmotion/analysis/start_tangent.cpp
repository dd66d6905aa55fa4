#include "start_tangent.hpp"

namespace lostmotion {

std::vector<double> set_start(const VariedTrain& trains, const std::vector<Variation>& variations,
                              const TrainStart& start, double* derivative) {
    const model::Layout& n = trains.base().layout();
    const std::size_t parameters = variations.size();
    const auto [x, memory] = in_layout(trains.base(), start);
    for (std::size_t p = 0; p < parameters; ++p)
        for (const Neighbour& at : variations[p].neighbours) {
            if (!at.train && !at.start) continue;
            const auto [x_n, memory_n] =
                in_layout(at.train ? at.train->assembly() : trains.base(), at.start ? *at.start : start);
            for (std::size_t k = 0; k < x.size(); ++k) derivative[k * parameters + p] += at.weight * (x_n[k] - x[k]);
            for (std::size_t k = 0; k < memory.size(); ++k)
                derivative[(static_cast<std::size_t>(n.first_memory) + k) * parameters + p] +=
                    at.weight * (memory_n[k] - memory[k]);
        }
    return memory;
}

bool sets_in_motion(const VariedTrain& trains, const FormTangent& form, int contact, const double* w,
                    const double* derivative) {
    const model::Row speed = trains.base().contact_speed(contact);
    const auto parameters = static_cast<std::size_t>(form.parameters());
    std::vector<double> change(parameters), size(parameters);
    form.add_motion(speed, derivative, 1.0, change.data());
    for (const VariedTrain::Beside& b : trains.beside())
        change[static_cast<std::size_t>(b.parameter)] +=
            b.weight * (form.value(b.assembly().contact_speed(contact), w) - form.value(speed, w));
    for (std::size_t k = 0; k < static_cast<std::size_t>(trains.base().layout().states); ++k)
        for (std::size_t p = 0; p < parameters; ++p) size[p] += std::fabs(speed.c[k] * derivative[k * parameters + p]);
    for (std::size_t p = 0; p < parameters; ++p)
        if (std::fabs(change[p]) > 1e-6 * size[p]) return true;
    return false;
}

}  // namespace lostmotion
