// A train at one instant of a motion, by the layout of its assembly, so that it can be explained and linearised
// whatever the kernel that has led to it.
#pragma once

#include <algorithm>
#include <vector>

#include "train_reader.hpp"

namespace lostmotion {

struct TrainPoint {
    model::Instant now;  // time, states, memory, inputs
    model::Key key;
    std::vector<double> values;  // of all channels
};

template <class D>
TrainPoint point_of(const typename TrainReader<D>::Model& model, const model::TrainRegime<D>& r, double time,
                    const StateOf<D>& x, const typename D::Memory& memory, const InputsOf<D>& u) {
    const model::Layout& n = model.assembly.layout();
    TrainPoint p;
    p.now.time = time;
    model::unpack_state<D>(x, n, p.now.x.begin());
    std::copy_n(memory.begin(), n.memory, p.now.memory.begin());
    std::copy_n(u.begin(), n.inputs, p.now.input[0].begin());
    p.key = r.key;
    p.values = TrainReader<D>(model, r, memory)(x, u);
    return p;
}

}  // namespace lostmotion
