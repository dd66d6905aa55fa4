#include "explanation.hpp"

namespace lostmotion::explanation {

Explanation of_drive(const Scenario& s, double time) {
    Explanation out;
    RunRequest request;
    request.duration = time;
    request.sample_interval = s.sample_interval;
    request.control = s.control;
    StartOf<DriveDims> start;
    std::copy(s.start.begin(), s.start.end(), start.x.begin());
    start.memory.hysteresis_capacity = s.hysteresis_capacities[0];
    const DrivePoint p = reach(s.drive, {s.inputs[0], s.inputs[1]}, start, request);
    out.error = status_text(p.status, p.time, p.contact);
    if (!out.error.empty()) return out;
    for (const ContactName& c : contact_names) {
        const ContactReport report = explain_contact(s.drive, p.regime, c.value, p.x, p.memory, p.input);
        if (report.present) out.contacts.push_back({report, c.text});
    }
    const double T_2 = evaluate(p.regime.output_torque, p.x, p.memory, p.input), M_Z = p.input[1];
    out.motors.push_back({"motor", smallest_command(s.drive, T_2, M_Z, +1), smallest_command(s.drive, T_2, M_Z, -1)});
    return out;
}

Explanation of_train(const Scenario& s, double time) {
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
    for (const TrainContactReport& c : explain_contacts(a, point)) out.contacts.push_back({c, c.name});
    out.motors = explain_motors(a, point);
    return out;
}

}  // namespace lostmotion::explanation

namespace lostmotion {

Explanation explain(const Scenario& s, double time) {
    if constexpr (holds(Kernel::drive))
        if (s.is_of_drive()) return explanation::of_drive(s, time);
    if constexpr (holds_trains)
        if (!s.is_of_drive()) return explanation::of_train(s, time);
    return {};
}

}  // namespace lostmotion
