// An actuator plugin of MuJoCo: a drive train that moves a hinge or a slide. It loads into the stock library by
// mj_loadPluginLibrary.
//
// The joint needs the inertia A that the drive has at the joint through closed meshes as its armature, since a plugin
// cannot change the armature from step to step. The drives of a model are solved together: with the inertia matrix S of
// the robot at their joints, the other joints free, and all forces f there but contacts, both at the start of the step,
//     S a = f + tau(a),
// where tau is the mean torque of the drives over the step (joint_trains.hpp). With the forces F = tau + A a the
// engine, which solves (S + A) a = f + F, finds the same acceleration; it is of first order, since S and f are
// constant. After the step each train is advanced again, against the load torque for which its load has the speed that
// the engine has found: with a contact it is another one. Newton's method finds the load torque by its exact
// derivative.
//
// plugin_state: the whole state of the train, then its load torque, and speed and angle of the joint at the start of
// the step. The file: the description of a train with a load torque on the shaft of the joint alone, which starts with
// the speeds at which this shaft has 1 rad/s, then A.
#include <mujoco/mujoco.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <memory>
#include <string>
#include <vector>

#include "lostmotion/model/names.hpp"
#include "lostmotion/scenario/description.hpp"
#include "lostmotion/scenario/simulation.hpp"
#include "lostmotion/simulation/joint_trains.hpp"

namespace lm = lostmotion;

namespace {

constexpr const char* attributes[] = {"scenario"};
constexpr int most_iterations = 8;

// One line that ends the compilation of the model, or the step.
[[noreturn]] void fail(const mjModel* m, int instance, const std::string& sentence) {
    const char* name = mj_id2name(m, mjOBJ_PLUGIN, instance);
    mju_error("lostmotion.drive %s: %s", name == nullptr ? "" : name, sentence.c_str());
    std::abort();  // not reached
}

std::vector<double> numbers_of(const std::string& path) {
    std::vector<double> numbers;
    if (std::FILE* file = std::fopen(path.c_str(), "rb"); file != nullptr) {
        double buffer[512];
        while (const std::size_t n = std::fread(buffer, sizeof buffer[0], 512, file))
            numbers.insert(numbers.end(), buffer, buffer + n);
        std::fclose(file);
    }
    return numbers;
}

struct DriveFile {
    lm::Scenario scenario;
    std::size_t joint;  // shaft
    double armature;
};

DriveFile file_of(const mjModel* m, int instance) {
    const char* path = mj_getPluginConfig(m, instance, "scenario");
    if (path == nullptr || path[0] == '\0')
        fail(m, instance, "the key scenario is missing; give the file that lostmotion.mujoco.write_drive has written");
    std::vector<double> numbers = numbers_of(path);
    const double armature = numbers.empty() ? 0.0 : numbers.back();
    if (!numbers.empty()) numbers.pop_back();
    const lm::ScenarioDescription description(std::move(numbers));
    lm::Scenario s = description.error().empty() ? description.scenario() : lm::Scenario{};
    const auto joint = std::ranges::find(s.train.shafts, true, &lm::model::Shaft::loaded);
    if (joint == s.train.shafts.end() || s.train.motors.size() != 1)
        fail(m, instance, "scenario " + std::string(path) + ": is no file of lostmotion.mujoco.write_drive");
    s.references_given = true;
    const auto shaft = static_cast<std::size_t>(joint - s.train.shafts.begin());
    return {std::move(s), shaft, armature};
}

// The drives of a model.
struct Drive;
struct Group {
    std::vector<int> instances;
    std::vector<Drive*> drives;
    std::unique_ptr<lm::JointTrains> trains;
    std::vector<double> whole, force, zero_matrix, zero, unit, column, free;
};

struct Drive {
    Drive(const DriveFile& file, double step) : simulation(file.scenario, step), at_one(file.scenario.start) {
        const lm::Scenario& scenario = file.scenario;
        inputs.resize(simulation.names().inputs.size());
        joint = lm::JointTrains::joint(simulation.train(), static_cast<int>(file.joint)).value();
        load = simulation.input_of(joint.shaft.load);
        const auto& motor = scenario.train.motors[0].law;
        controlled = !scenario.control.axes.empty();
        const bool commanded = !controlled && scenario.train.controllers.empty();
        scale = commanded && motor.kind == lm::Motor::torque_source ? 1.0 / motor.rated_torque : 1.0;
    }
    double speed() const { return simulation.motion().state(joint.shaft.speed_state); }
    lm::ScenarioSimulation simulation;
    std::vector<double> at_one;  // states at which the joint has 1 rad/s
    lm::JointTrains::Joint joint;
    std::vector<double> inputs;
    std::size_t load = 0;
    double scale = 1.0;                                      // from the control of MuJoCo to the command
    int control = -1, output = -1, dof = -1, position = -1;  // places in mjData
    bool controlled = false;
    double armature = 0.0;         // A
    std::unique_ptr<Group> group;  // of the first drive of a model
    std::size_t numbers = 0;
    lm::LoadAnswer answer;
};

// The control as the engine limits it, in the units of the drive.
double given(const mjModel* m, const mjData* d, const Drive& drive) {
    double control = d->ctrl[drive.control];
    const mjtNum* range = m->actuator_ctrlrange + 2 * drive.control;
    if (m->actuator_ctrllimited[drive.control] && !(m->opt.disableflags & mjDSBL_CLAMPCTRL))
        control = std::clamp(control, range[0], range[1]);
    return drive.scale * control;
}

Drive& drive_of(const mjData* d, int instance) { return *reinterpret_cast<Drive*>(d->plugin_data[instance]); }

int state_size(const mjModel* m, int instance) {
    const lm::ScenarioSimulation simulation(file_of(m, instance).scenario, m->opt.timestep);
    return static_cast<int>(simulation.state_size()) + 3;
}

// What the engine would do to the force of the actuator, and what joint and actuator have of a drive.
void refuse_limits(const mjModel* m, int instance, int actuator, int joint) {
    const int dof = m->jnt_dofadr[joint];
    const auto any = [](const mjtNum* values, int n) {
        return std::any_of(values, values + n, [](mjtNum x) { return x != 0.0; });
    };
    const auto refuse = [&](const char* what) {
        fail(m, instance, std::string("the ") + what + ", which would act beside the drive; take it off the model");
    };
    if (m->actuator_forcelimited[actuator]) refuse("actuator has a forcerange");
    if (m->jnt_actfrclimited[joint]) refuse("joint has an actuatorfrcrange");
    if (m->actuator_delay[actuator] != 0.0) refuse("actuator has a delay");
    if (m->actuator_armature[actuator] != 0.0) refuse("actuator has an armature");
    if (m->actuator_damping[actuator] != 0.0 || any(m->actuator_dampingpoly + mjNPOLY * actuator, mjNPOLY))
        refuse("actuator has damping");
    if (m->dof_damping[dof] != 0.0 || any(m->dof_dampingpoly + mjNPOLY * dof, mjNPOLY)) refuse("joint has damping");
    if (m->dof_frictionloss[dof] != 0.0) refuse("joint has a frictionloss");
}

int init(const mjModel* m, mjData* d, int instance) {
    int actuator = -1, count = 0;
    for (int k = 0; k < m->nactuator; ++k)
        if (m->actuator_plugin[k] == instance) {
            actuator = k;
            ++count;
        }
    if (count != 1) fail(m, instance, "must be the plugin of one actuator, and is that of " + std::to_string(count));
    const int joint = m->actuator_trnid[2 * actuator];
    const bool slide = m->jnt_type[joint] == mjJNT_SLIDE;
    if (m->actuator_trntype[actuator] != mjTRN_JOINT || (m->jnt_type[joint] != mjJNT_HINGE && !slide))
        fail(m, instance, "must move a hinge or a slide; give joint");
    const int control = m->actuator_ctrladr[actuator], output = m->actuator_outadr[actuator];
    if (m->actuator_gear[6 * output] != 1.0) fail(m, instance, "the actuator has a gear; the drive has its own");
    refuse_limits(m, instance, actuator, joint);
    if (m->opt.integrator == mjINT_RK4) fail(m, instance, "needs another integrator than RK4");
    DriveFile file = file_of(m, instance);
    if (lm::model::is_slide(file.scenario.train, static_cast<int>(file.joint)) != slide)
        fail(m, instance,
             slide ? "the joint is a slide, and the train ends at a shaft that turns; it needs a slide there"
                   : "the joint is a hinge, and the train ends at a slide; it needs a shaft that turns");
    const int dof = m->jnt_dofadr[joint];
    const double given = m->dof_armature[dof];
    if (!(std::fabs(given - file.armature) <= 1e-3 * file.armature)) {
        char line[160];
        std::snprintf(line, sizeof line, "the joint has the armature %.6g; give it %.6g, the inertia of the drive",
                      given, file.armature);
        fail(m, instance, line);
    }
    // The engine counts the armature in, but for a body that slides alone.
    const double whole = 1.0 / m->dof_invweight0[dof] + (m->body_simple[m->dof_bodyid[dof]] == 2 ? given : 0.0);
    file.scenario.train.shafts[file.joint].inertia = whole - given;
    auto made = std::make_unique<Drive>(file, m->opt.timestep);
    made->control = control;
    made->output = output;
    made->dof = dof;
    made->position = m->jnt_qposadr[joint];
    made->armature = given;
    made->numbers = made->simulation.state_size();
    d->plugin_data[instance] = reinterpret_cast<uintptr_t>(made.release());
    return 0;
}

void destroy(mjData* d, int instance) {
    delete reinterpret_cast<Drive*>(d->plugin_data[instance]);
    d->plugin_data[instance] = 0;
}

// All meshes closed, in the middle of their gaps.
void place(Drive& drive, double* state, double speed, double angle) {
    const auto& names = drive.simulation.names().states;
    std::vector<double> x(names.size());
    for (std::size_t k = 0; k < x.size(); ++k) {
        const std::size_t end = names[k].rfind('_');
        const std::string quantity = names[k].substr(end + 1);
        const auto turning = std::ranges::find(names, names[k].substr(0, end) + "_speed");
        if (turning == names.end() || (quantity != "speed" && quantity != "angle" && quantity != "position")) continue;
        const double ratio = drive.at_one[static_cast<std::size_t>(turning - names.begin())];
        x[k] = ratio * (quantity == "speed" ? speed : angle);
    }
    drive.simulation.reset(x, std::vector<double>(drive.simulation.names().capacities.size()));
    drive.simulation.get_state(state);
    state[drive.numbers] = 0.0;
    state[drive.numbers + 1] = speed;
    state[drive.numbers + 2] = angle;
}

void reset(const mjModel*, mjtNum* state, void* data, int) { place(*static_cast<Drive*>(data), state, 0.0, 0.0); }

// The inverse of a symmetric positive definite matrix, in its place.
void invert(std::vector<double>& a, std::size_t n) {
    for (std::size_t k = 0; k < n; ++k) {
        const double pivot = 1.0 / a[k * n + k];
        a[k * n + k] = 1.0;
        for (std::size_t c = 0; c < n; ++c) a[k * n + c] *= pivot;
        for (std::size_t r = 0; r < n; ++r) {
            if (r == k) continue;
            const double factor = a[r * n + k];
            a[r * n + k] = 0.0;
            for (std::size_t c = 0; c < n; ++c) a[r * n + c] -= factor * a[k * n + c];
        }
    }
}

// The drives of the model of an instance, if it is the first of them; made when they are first needed.
Group* group_of(const mjModel* m, const mjData* d, int instance) {
    for (int k = 0; k < instance; ++k)
        if (m->plugin[k] == m->plugin[instance]) return nullptr;
    Drive& first = drive_of(d, instance);
    if (first.group) return first.group.get();
    auto group = std::make_unique<Group>();
    std::vector<lm::JointTrains::Joint> joints;
    for (int k = instance; k < m->nplugin; ++k)
        if (m->plugin[k] == m->plugin[instance]) {
            group->instances.push_back(k);
            group->drives.push_back(&drive_of(d, k));
            joints.push_back(group->drives.back()->joint);
        }
    group->trains = std::make_unique<lm::JointTrains>(std::move(joints));
    const std::size_t n = group->drives.size();
    group->whole.resize(n * n);
    group->zero_matrix.resize(n * n);
    group->force.resize(n);
    group->zero.resize(n);
    group->unit.resize(static_cast<std::size_t>(m->nv));
    group->column = group->free = group->unit;
    first.group = std::move(group);
    return first.group.get();
}

void compute(const mjModel* m, mjData* d, int instance, int) {
    Group* group = group_of(m, d, instance);
    if (group == nullptr) return;
    const std::size_t n = group->drives.size();
    const auto at = [&](const std::vector<double>& v, std::size_t k) {
        return v[static_cast<std::size_t>(group->drives[k]->dof)];
    };
    for (std::size_t k = 0; k < n; ++k) {
        Drive& drive = *group->drives[k];
        double* state = d->plugin_state + m->plugin_stateadr[group->instances[k]];
        // The joint has been moved from outside.
        const double speed = d->qvel[drive.dof], angle = d->qpos[drive.position];
        if (speed != state[drive.numbers + 1] || angle != state[drive.numbers + 2]) place(drive, state, speed, angle);
        if (!drive.simulation.set_state(state)) fail(m, group->instances[k], "plugin_state is not that of this drive");
        const double control = given(m, d, drive);
        std::ranges::fill(group->trains->inputs(k), control);
        if (drive.controlled) drive.simulation.motion().set_reference(0, control, 0.0);
        group->trains->set_guess(k, {state[drive.numbers], 0.0});
        group->unit[static_cast<std::size_t>(drive.dof)] = 1.0;
        mj_solveM(m, d, group->column.data(), group->unit.data(), 1);
        group->unit[static_cast<std::size_t>(drive.dof)] = 0.0;
        for (std::size_t r = 0; r < n; ++r) group->whole[r * n + k] = at(group->column, r);
    }
    invert(group->whole, n);  // S + A
    std::vector<double>& free = group->free;
    std::ranges::fill(free, 0.0);
    for (int b = 1; b < m->nbody; ++b) {
        const double* applied = d->xfrc_applied + 6 * b;
        if (std::any_of(applied, applied + 6, [](double x) { return x != 0.0; }))
            mj_applyFT(m, d, applied, applied + 3, d->xipos + 3 * b, b, free.data());
    }
    for (std::size_t k = 0; k < free.size(); ++k) free[k] += d->qfrc_applied[k] + d->qfrc_passive[k] - d->qfrc_bias[k];
    mj_solveM(m, d, group->column.data(), free.data(), 1);
    for (std::size_t r = 0; r < n; ++r) {
        group->force[r] = 0.0;
        for (std::size_t c = 0; c < n; ++c) group->force[r] += group->whole[r * n + c] * at(group->column, c);
    }
    for (std::size_t k = 0; k < n; ++k) group->whole[k * n + k] -= group->drives[k]->armature;
    group->trains->read();
    const lm::Status status =
        group->trains->step(m->opt.timestep, 1, {group->whole, group->force, group->zero_matrix, group->zero});
    if (status != lm::Status::done) {
        const std::size_t k = group->trains->failed_joint();
        fail(m, group->instances[k], group->drives[k]->simulation.text(status));
    }
    for (std::size_t k = 0; k < n; ++k) {
        const Drive& drive = *group->drives[k];
        const auto& joint = group->trains->joints()[k];
        d->actuator_force[drive.output] = joint.torque + drive.armature * joint.acceleration;
        d->plugin_state[m->plugin_stateadr[group->instances[k]] + static_cast<int>(drive.numbers)] =
            group->trains->guess(k).torque;
    }
}

// Advances the drive from its state, against the load torque by which the joint has the speed that the engine gave it.
void advance(const mjModel* m, mjData* d, int instance) {
    Drive& drive = drive_of(d, instance);
    double* state = d->plugin_state + m->plugin_stateadr[instance];
    const double speed = d->qvel[drive.dof], scale = std::fabs(speed) + std::fabs(state[drive.numbers + 1]) + 1e-9;
    double load = state[drive.numbers];
    std::ranges::fill(drive.inputs, given(m, d, drive));
    for (int n = 0;; ++n) {
        if (!drive.simulation.set_state(state)) fail(m, instance, "plugin_state is not that of this drive");
        drive.inputs[drive.load] = load;
        const lm::Status status =
            drive.simulation.answer(m->opt.timestep, drive.inputs, drive.inputs, drive.joint.shaft, drive.answer);
        if (status != lm::Status::done) fail(m, instance, drive.simulation.text(status));
        const double off = drive.speed() - speed, compliance = drive.answer.compliance;
        if (std::fabs(off / scale) <= 1e-11 || !(compliance > 0.0) || n == most_iterations) break;
        load += off / (m->opt.timestep * compliance);
    }
    drive.simulation.get_state(state);
    state[drive.numbers] = load;
    state[drive.numbers + 1] = speed;
    state[drive.numbers + 2] = d->qpos[drive.position];
}

}  // namespace

mjPLUGIN_LIB_INIT(lostmotion) {
    mjpPlugin plugin;
    mjp_defaultPlugin(&plugin);
    plugin.name = "lostmotion.drive";
    plugin.capabilityflags = mjPLUGIN_ACTUATOR;
    plugin.nattribute = 1;
    plugin.attributes = attributes;
    plugin.nstate = state_size;
    plugin.init = init;
    plugin.destroy = destroy;
    plugin.reset = reset;
    plugin.compute = compute;
    plugin.advance = advance;
    mjp_registerPlugin(&plugin);
}
