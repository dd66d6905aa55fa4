// How what a record shows of a train depends on parameters, at one instant.
#pragma once

#include "reset_tangent.hpp"
#include "shared_torque.hpp"

namespace lostmotion {

class SampleTangent {
 public:
    SampleTangent(const VariedTrain& trains, const FormTangent& form, const RegimeTangents& regimes)
        : trains_(trains), form_(form), channels_(regimes.channels()) {}

    // Adds the derivatives of a channel, by its place among those of the regimes.
    void add(std::size_t c, const RegimeTangent& r, const double* w, const double* derivative, double* to) const;

 private:
    // Of an input shaft at rest. to: the derivatives of the torque on it.
    void add_shared(std::size_t g, const RegimeTangent& t, const double* w, const double* derivative, double* to) const;

    const VariedTrain& trains_;
    const FormTangent& form_;
    const std::vector<TrainChannel>& channels_;
};

}  // namespace lostmotion
