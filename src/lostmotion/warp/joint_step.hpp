// The drive of a joint whose motion a multibody engine finds: how it answers the torque that the joint takes.
// `drive_walk.hpp` stands before this text.
struct JointStep {
    const DriveLaws& laws;
    const DriveNumbers& p;
    real step;
    int samples;  // of the law within a step
    bool has_law;
    // The law of the motor by its own encoder: torque at the joint = stiffness (command - angle) - damping speed.
    real command, stiffness, damping, angle;
    DriveState end;
    real speed, per_torque;  // of the load at the end, and its derivative by the load torque
    int doubts, switchings;

    void run(const DriveState& from, real load_torque) {
        DriveWalk walk(laws, p, from, has_law ? 0 : command, load_torque);
        walk.bold = true;
        walk.x.angle = 0;
        walk.differ(0, 1);
        for (int n = 0; n < samples; ++n) {
            if (has_law) {
                const real asked = stiffness * (command - (angle + walk.x.angle + walk.x.d)) - damping * walk.x.a;
                const real by = -stiffness * (walk.tangent[4] + walk.tangent[3]) - damping * walk.tangent[1];
                walk.ask_torque(asked, by);
            }
            if (!walk.advance(step / samples)) walk.doubts |= DriveWalk::no_regime;
        }
        end = walk.x;
        speed = end.a - end.v;
        per_torque = walk.tangent[1] - walk.tangent[2];
        doubts = walk.doubts;
        switchings = walk.switchings;
    }
};
