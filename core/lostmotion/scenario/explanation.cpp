#include "explanation.hpp"

namespace lostmotion {

Explanation explain(const Scenario& s, double time) {
    Explanation out;
    TrainOptions options;
    options.duration = time;
    options.sample_interval = s.sample_interval;
    options.control = s.control;
    const TrainRun run(s.train);
    const model::Assembly& a = run.assembly();
    TrainPoint point;
    out.error = error_text(run.reach(s.inputs, train_start(a, s.start, s.hysteresis_capacities), options, point), a);
    if (!out.error.empty()) return out;
    out.contacts = explain_contacts(a, point);
    out.motors = explain_motors(a, point);
    return out;
}

}  // namespace lostmotion
