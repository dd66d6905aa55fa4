// The C interface: why a scenario stands still.
#include "lostmotion/scenario/explanation.hpp"

#include <array>
#include <cmath>
#include <string>
#include <vector>

#include "objects.hpp"

namespace lm = lostmotion;

struct lm_explanation {
    struct Row {
        std::string name;
        std::array<double, 5> values;
    };
    std::vector<Row> contacts, motors;
};

extern "C" {

lm_explanation* lm_scenario_explain(lm_scenario* scenario, double time) {
    lm_explanation* made = nullptr;
    scenario->changed(attempted([&]() -> std::string {
        if (!(std::isfinite(time) && time >= 0.0)) return "the time must not be negative, and finite";
        const lm::Explanation found = lm::explain(scenario->description.scenario(), time);
        if (!found.error.empty()) return found.error;
        made = new lm_explanation;
        for (const lm::ContactReport& c : found.contacts)
            made->contacts.push_back(
                {c.name, {static_cast<double>(c.mode), c.speed, c.torque, c.capacity_forward, c.capacity_backward}});
        for (const lm::MotorReport& m : found.motors)
            made->motors.push_back({m.name, {m.command_forward, m.command_backward}});
        return "";
    }));
    return made;
}
void lm_explanation_free(lm_explanation* explanation) { delete explanation; }

static const std::vector<lm_explanation::Row>& rows(const lm_explanation* explanation, lm_explained what) {
    return what == LM_CONTACTS ? explanation->contacts : explanation->motors;
}
size_t lm_explanation_count(const lm_explanation* explanation, lm_explained what) {
    return rows(explanation, what).size();
}
const char* lm_explanation_name(const lm_explanation* explanation, lm_explained what, size_t k) {
    return k < rows(explanation, what).size() ? rows(explanation, what)[k].name.c_str() : nullptr;
}
const double* lm_explanation_values(const lm_explanation* explanation, lm_explained what, size_t k) {
    return k < rows(explanation, what).size() ? rows(explanation, what)[k].values.data() : nullptr;
}

}  // extern "C"
