// A step of a drive from event to event, by Taylor series and without tables.
//
// The drive has two inertias, on the two sides of a gear of ratio i. Its states are
//
//   q    torque of the motor [N m], if that follows its command with a delay
//   a    speed of the motor over i [rad/s]
//   v    rate of the twist [rad/s], so that the load turns with a - v
//   d    twist [rad]
//
// and the angle of the load [rad]. They are local to the mesh, so that single precision keeps their digits. A drive
// whose ratio is below zero is its mirror image at the motor, and seen as that here.
//
// A regime is linear: fixed are the mode of each dry contact, the piece of the torsion curve and the cell of the loss
// law. It is made from the numbers of the drive where it begins, so that these may change at any step. From there the
// motion is its Taylor series over a short time. Guards are linear in the states; Bernstein coefficients of the cubic
// and the sum of what lies beyond prove that a guard stays positive, or that it falls through zero once; Newton's
// method then finds where. Across an edge of a continuous law the motion goes on in the next piece. Where a contact
// stops or is overcome, the regime that follows has to hold strictly: each of its guards is positive, or zero and
// rising. Whatever is not certain is said, and nothing of that step may be used.
//
// A tangent is carried along where it is asked for: the derivative of the state by the command, the load torque or a
// mix of both. Within a regime it obeys the same linear equations. At a switching it takes the shift of the instant
// along: from the rates before to the rates behind.
//
// The text of this file is plain: it includes nothing, allocates nothing and calls nothing but what it defines, so that
// it is also the body of a kernel for graphics processors. `real` is the type of its numbers, `ROUNDING` their
// rounding; `parts/loss_grid.hpp` and `drive_series.hpp` stand before it.

// What drives of a kind share.
struct DriveLaws {
    enum Losses { constant, by_direction, by_map };
    // Pieces of the torsion curve, from the most negative; `zero`: the one around twist 0. P = slope d + offset between
    // `lower` and `upper`; root: of the slope.
    const real *lower, *upper, *slope, *offset, *root;
    int pieces, zero;
    real half_gap;        // half of the backlash [rad]
    bool has_gap;         // piece `zero` has no stiffness
    bool rigid;           // no twist at all
    bool delays_torque;   // q is a state
    bool limits_damping;  // to the torque of the spring
    bool torque_source;   // no voltage behind the torque
    int losses;
    LossGrid map;
    real steepest;        // the most that losses of the map change per torque
    const real* reach;    // of a series of each degree: |A| t up to which what lies beyond is below rounding
    const real* inverse;  // 1/k
    int most_degree;
};

// The numbers of one drive, made of those in its data sheet.
struct DriveNumbers {
    real per_motor, per_load;       // i/(i^2 J_1), 1/J_2: accelerations a', w' per torque on the two shafts
    real motor_drag, load_drag;     // torques per a and w [N m s/rad]
    real motor_slips, motor_holds;  // dry friction [N m]
    real load_slips, load_holds;
    real stall_torque, back_torque;  // of the motor per command, per a
    real delay, command_limit;       // 1/tau_a, of the magnitude
    real per_ratio;                  // 1/|i|
    real driving, overrunning;       // T_1 |i|/T_2 of constant losses and of those by direction
    real rated_torque, per_rated;    // T_2R and its inverse
    real speed_share;                // |i|/n_1R
    real hysteresis;                 // (1 - eta_H)/2
    real mesh_damping;
    real gap;                             // by which flanks are further out than `laws` has them [rad]
    real stiff;                           // root of the largest twist acceleration per torque
    real torque_scale, per_torque_scale;  // of q over that of a, and its inverse
    int has;                              // contacts
    int turned;                           // -1: a ratio below zero
    enum Contact { of_motor = 1, of_twist = 2, of_load = 4, dry_losses = 8 };
};

// What data sheets and scenario files say of one drive [SI].
struct DriveSheet {
    real rotor_inertia, motor_friction, rated_torque, rated_speed, time_constant, voltage_constant, command_limit;
    real motor_inertia, motor_viscous, shaft_friction, shaft_breakaway;  // of the motor's shaft
    real ratio, gear_inertia, gear_viscous, hysteresis_efficiency, rated_input_speed, rated_output_torque;
    real drive_efficiency, backdrive_efficiency, mesh_damping;
    real backlash;
    real load_inertia, load_viscous, load_friction, load_breakaway;

    // The root of a number, or slightly more.
    static real root(real of) {
        real g = 1;
        while (g * g < of) g *= 2;
        while (g > 0 && g * g > 4 * of) g *= real(0.5);
        for (int k = 0; k < 6 && g > 0; ++k) g = real(0.5) * (g + of / g);
        return g;
    }
    DriveNumbers numbers(const DriveLaws& laws) const {
        DriveNumbers n;
        const real i = ratio < 0 ? -ratio : ratio;
        n.turned = ratio < 0 ? -1 : 1;
        n.per_ratio = 1 / i;
        n.per_motor = 1 / (i * (rotor_inertia + gear_inertia + motor_inertia));
        n.per_load = 1 / load_inertia;
        n.motor_drag = i * (motor_viscous + gear_viscous);
        n.load_drag = load_viscous;
        n.motor_slips = motor_friction + shaft_friction;
        n.motor_holds = motor_friction + (shaft_breakaway > shaft_friction ? shaft_breakaway : shaft_friction);
        n.load_slips = load_friction;
        n.load_holds = load_breakaway > load_friction ? load_breakaway : load_friction;
        n.stall_torque = rated_torque * (laws.torque_source ? real(1) : voltage_constant);
        n.back_torque = laws.torque_source ? 0 : i * rated_torque * (voltage_constant - 1) / rated_speed;
        n.command_limit = command_limit;
        n.driving = 1 / drive_efficiency;
        n.overrunning = backdrive_efficiency;
        n.rated_torque = rated_output_torque;
        n.per_rated = 1 / rated_output_torque;
        n.speed_share = i / rated_input_speed;
        n.hysteresis = real(0.5) * (1 - hysteresis_efficiency);
        n.mesh_damping = mesh_damping;
        n.gap = real(0.5) * backlash - laws.half_gap;
        n.has = laws.losses == DriveLaws::constant ? 0 : DriveNumbers::dry_losses | DriveNumbers::of_motor;
        if (n.motor_holds > 0) n.has |= DriveNumbers::of_motor;
        if (!laws.rigid && hysteresis_efficiency < 1) n.has |= DriveNumbers::of_twist;
        if (n.load_holds > 0) n.has |= DriveNumbers::of_load;
        const real back = backdrive_efficiency < 0 ? -backdrive_efficiency : backdrive_efficiency;
        const real share = laws.losses == DriveLaws::by_map ? 1 + laws.steepest : n.driving > back ? n.driving : back;
        n.stiff = root((laws.limits_damping ? 2 : 1) * (n.per_load + share * n.per_ratio * n.per_motor));
        n.delay = laws.delays_torque ? 1 / time_constant : 0;
        n.torque_scale = n.per_torque_scale = 1;
        if (laws.delays_torque) {
            const real pull = n.delay * n.back_torque;
            n.torque_scale = pull > 0 ? root(pull / n.per_motor) : n.delay / n.per_motor;
            n.per_torque_scale = 1 / n.torque_scale;
        }
        return n;
    }
};

struct DriveState : DrivePoint {
    real angle;
    real hysteresis;                 // capacity [N m]
    real held;                       // torque of the mesh where all contacts rest, which the motion leaves open [N m]
    signed char motor, twist, load;  // modes of the contacts: 0 at rest, +1 or -1
    signed char flanks;              // 0 touch, 1 parted, 2 damping at its limit
    short piece, cell, back;         // of the torsion curve; of the losses; of those in the other direction, at rest
    bool known;                      // the modes
};

struct DriveWalk : Magnitudes {
    enum Verdict { yes, no, unsure };
    enum Kind { speed, capacity, piece, cell, back, flanks };
    enum Contact { motor, twist, load };
    enum { most_guards = 16, most_switchings = 200, most_halvings = 60, longest_walk = 24 };

    typedef DriveForm Form;
    struct Guard {
        Form form;
        short kind, of, to;  // of: contact; to: what lies beyond
    };
    struct Regime : DriveRates {
        Form output;  // T_2
        Form pull;    // M
        int n;
        Guard guards[most_guards];
    };
    struct Crossing {
        int guard;
        real at;
        bool doubtful;  // another one is near
    };

    const DriveLaws& laws;
    const DriveNumbers& p;
    real command, load_torque;
    bool has_tangent;
    real by_command, by_load;        // its direction
    real tangent[5], by_hysteresis;  // of q, a, v, d and the angle; of the capacity of the hysteresis
    DriveState x;
    Regime r;
    DriveSeries series;
    int switchings;
    // What was not certain. `bold`: the walk goes on all the same, as if it were the likelier of both.
    enum Doubt { below_zero = 1, near_zero = 2, two_at_once = 4, too_long = 8, no_regime = 16 };
    bool bold;
    mutable int doubts;

    // False: there is a doubt that the walk does not go on with.
    bool goes_on_with(int doubt) const {
        doubts |= doubt;
        return bold;
    }
    static bool is_single() { return ROUNDING > real(1e-10); }
    // The rounding of a value over the sum of the magnitudes of its terms, and where a guard begins on zero; the
    // distance below which two zeros coincide, in the time of the series.
    static real doubt() { return is_single() ? real(1e-5) : real(1e-9); }
    static real on_zero() { return is_single() ? real(1e-6) : real(1e-12); }
    static real together() { return is_single() ? real(1e-5) : real(1e-9); }

    DriveWalk(const DriveLaws& the_laws, const DriveNumbers& numbers, const DriveState& from, real to_motor,
              real to_load)
        : laws(the_laws),
          p(numbers),
          load_torque(to_load),
          has_tangent(false),
          tangent(),
          by_hysteresis(0),
          x(from),
          switchings(0),
          bold(false),
          doubts(0) {
        set_command(to_motor);
        set_direction(0, 0);
    }
    void set_command(real to_motor) {
        const real asked = p.turned < 0 ? -to_motor : to_motor;
        command = asked > p.command_limit ? p.command_limit : asked < -p.command_limit ? -p.command_limit : asked;
    }
    // Of a torque source: a torque [N m] at the load's side of the gear, with its tangent.
    void ask_torque(real torque, real by) {
        const real per_torque = p.per_ratio / p.stall_torque;
        set_command(p.turned * torque * per_torque);
        set_direction(p.turned * by * per_torque, by_load);
    }
    // Begins a tangent: the derivative by a shift of the command and of the load torque.
    void differ(real to_motor, real to_load) {
        has_tangent = true;
        set_direction(to_motor, to_load);
    }
    // A command at its limit does not shift.
    void set_direction(real to_motor, real to_load) {
        by_command = command < p.command_limit && command > -p.command_limit ? p.turned * to_motor : 0;
        by_load = to_load;
    }

    bool has(int contact) const { return (p.has & contact) != 0; }
    bool motor_rests() const { return has(DriveNumbers::of_motor) && x.motor == 0; }
    bool load_rests() const { return has(DriveNumbers::of_load) && x.load == 0; }
    bool tied() const { return laws.rigid || (has(DriveNumbers::of_twist) && x.twist == 0); }
    static int contact_bit(int contact) { return 1 << contact; }
    signed char* mode(int contact) { return contact == motor ? &x.motor : contact == twist ? &x.twist : &x.load; }

    // Bounds of a piece, and its torque as a form.
    real beyond(int k) const { return k > laws.zero ? p.gap : k < laws.zero ? -p.gap : 0; }
    real lower(int k) const { return laws.lower[k] + (k > laws.zero ? p.gap : -p.gap); }
    real upper(int k) const { return laws.upper[k] + (k < laws.zero ? -p.gap : p.gap); }
    real spring(int k) const { return laws.offset[k] - laws.slope[k] * beyond(k); }
    bool in_gap() const { return laws.has_gap && x.piece == laws.zero; }
    void locate_piece() {
        int k = laws.zero;
        while (x.d > 0 && k + 1 < laws.pieces && x.d > upper(k)) ++k;
        while (x.d < 0 && k > 0 && x.d < lower(k)) --k;
        x.piece = static_cast<short>(k);
    }
    Plane loss_plane(int of, bool at_rest) const {
        if (laws.losses == DriveLaws::by_map) return at_rest ? laws.map.line_at_standstill(of) : laws.map.plane(of);
        return {0, 0, of == 0 ? p.overrunning - 1 : p.driving - 1};
    }
    // The cells of the losses at a torque of the mesh.
    void locate_losses(real torque) {
        if (!has(DriveNumbers::dry_losses)) return;
        const real mu = torque * p.per_rated;
        const bool map = laws.losses == DriveLaws::by_map;
        const auto interval = [&](real at) { return map ? laws.map.load_interval(at) : at < 0 ? 0 : 1; };
        x.back = 0;
        if (x.motor == 0) {
            x.cell = static_cast<short>(interval(mu));
            x.back = static_cast<short>(interval(-mu));
        } else if (map) {
            x.cell = static_cast<short>(laws.map.triangle(x.motor * mu, magnitude(x.a) * p.speed_share));
        } else {
            x.cell = x.motor * mu < 0 ? 0 : 1;
        }
    }

    // Numbers in registers: a form in memory would be waited for.
    void guard(real one, real q, real a, real v, real d, int kind, int of, int to) {
        if (one == 0 && q == 0 && a == 0 && v == 0 && d == 0) return;  // as of a loss law whose load is zero in the gap
        Guard& g = r.guards[r.n++];
        g.form.one = one;
        g.form.q = q;
        g.form.a = a;
        g.form.v = v;
        g.form.d = d;
        g.kind = static_cast<short>(kind);
        g.of = static_cast<short>(of);
        g.to = static_cast<short>(to);
    }
    void guard(const Form& f, int kind, int of, int to) { guard(f.one, f.q, f.a, f.v, f.d, kind, of, to); }
    static Form over(const Form& f, real share, real one) {
        Form out = {one, 0, 0, 0, 0};
        out.add(share, f);
        return out;
    }

    // The torque of the motor, and its rate.
    void set_pull() {
        if (laws.delays_torque) {
            r.pull = {0, 1, 0, 0, 0};
            r.q = {p.delay * p.stall_torque * command, -p.delay, -p.delay * p.back_torque, 0, 0};
        } else {
            r.pull = {p.stall_torque * command, 0, -p.back_torque, 0, 0};
            r.q = {0, 0, 0, 0, 0};
        }
    }
    // The contact that slips and stops together with this one, as the third one rests; -1: there is none.
    int partner(int contact) const {
        if (laws.rigid) return -1;
        const int third = tied() ? twist : motor_rests() ? motor : load_rests() ? load : -1;
        if (third < 0 || third == contact) return -1;
        const int other = 3 - third - contact;
        return has(contact_bit(other)) ? other : -1;
    }
    // All contacts rest: the motion does not determine what the mesh passes on.
    bool rests() const {
        return !laws.rigid && has(DriveNumbers::of_twist) && x.twist == 0 && motor_rests() && load_rests();
    }
    // What the mesh may pass on there, by the hysteresis and the friction of the load [N m].
    real least_held() const { return most(spring_torque() - x.hysteresis, load_torque - p.load_holds); }
    real most_held() const { return least(spring_torque() + x.hysteresis, load_torque + p.load_holds); }
    real spring_torque() const { return spring(x.piece) + laws.slope[x.piece] * x.d; }
    // What the mesh passes on while its twist slips.
    real slipping_torque() const {
        return has(DriveNumbers::of_twist) ? spring_torque() + x.twist * x.hysteresis : spring_torque();
    }
    // What the motor holds ahead or back where the mesh passes on a torque [N m]; it grows with what the mesh takes.
    real motor_held(real torque, int way) const {
        real per_torque;
        return motor_held(torque, way, per_torque);
    }
    real motor_held(real torque, int way, real& per_torque) const {
        const real mu = way * torque * p.per_rated;
        real loss = (p.driving - 1) * way * torque;
        per_torque = p.driving * way * p.per_ratio;
        if (has(DriveNumbers::dry_losses)) {
            const bool map = laws.losses == DriveLaws::by_map;
            const Plane m = loss_plane(map ? laws.map.load_interval(mu) : mu < 0 ? 0 : 1, true);
            loss = p.rated_torque * (m.at_zero + m.per_load * mu);
            per_torque = (1 + m.per_load) * way * p.per_ratio;
        }
        return p.motor_holds + (way * torque + loss) * p.per_ratio;
    }
    // By how much less than they hold the contacts take under a torque of the motor [N m], with the torque of the mesh
    // as near to what it was as they allow; it becomes that.
    real spare_at_rest(real pull) {
        const real low = least_held(), high = most_held();
        if (low > high) return high - low;
        real torque = least(most(x.held, low), high);
        for (int way = 1; way >= -1; way -= 2) {
            const auto spare = [&](real at) { return motor_held(at, way) - way * pull; };
            if (spare(torque) >= 0) continue;
            real within = way > 0 ? high : low, beyond = torque;
            if (spare(within) < 0) return spare(within);
            for (int n = 0; n < 60; ++n) {
                const real middle = real(0.5) * (within + beyond);
                (spare(middle) >= 0 ? within : beyond) = middle;
            }
            torque = within;
        }
        x.held = torque;
        return least(motor_held(high, 1) - pull, motor_held(low, -1) + pull);
    }

    // Of three contacts two keep the third at rest, which therefore does not slip; one lets both others slip alike.
    bool possible() const {
        const bool of_motor = has(DriveNumbers::of_motor), of_twist = has(DriveNumbers::of_twist),
                   of_load = has(DriveNumbers::of_load);
        if (tied()) {
            if (of_motor && of_load && !laws.rigid && x.motor != x.load) return false;
            return !load_rests() || motor_rests();
        }
        if (motor_rests() && load_rests()) return !of_twist;
        if (motor_rests()) return !of_twist || !of_load || x.twist == -x.load;
        return !load_rests() || !of_twist || !of_motor || x.twist == x.motor;
    }
    // The regime of the modes, the piece and the cells. False: it is for the general solver.
    bool make() {
        r.n = 0;
        r.twists = 0;
        const bool motor_at_rest = motor_rests(), load_at_rest = load_rests(), together = tied();
        if (rests()) {
            set_pull();
            r.a = r.w = r.v = {0, 0, 0, 0, 0};
            r.output = {x.held, 0, 0, 0, 0};
            guard(over(r.pull, -1, motor_held(most_held(), 1)), capacity, motor, 1);
            guard(over(r.pull, 1, motor_held(least_held(), -1)), capacity, motor, -1);
            set_norm();
            return true;
        }
        if (motor_at_rest && load_at_rest && has(DriveNumbers::of_twist)) return false;
        if (together && (load_at_rest || (motor_at_rest && has(DriveNumbers::of_load)))) return false;
        set_pull();
        // The torque T_2 of the mesh, and the rates, which stay in registers until they are complete.
        const real at_zero = laws.rigid ? 0 : spring(x.piece), slope = laws.rigid ? 0 : laws.slope[x.piece];
        Form output = {0, 0, 0, 0, 0}, a = output, w = output;
        if (!together && x.flanks != 1) {
            output.one = at_zero;
            output.d = slope;
            if (x.flanks == 2) {
                output.one *= 2;
                output.d *= 2;
            } else {
                if (has(DriveNumbers::of_twist)) output.one += x.twist * x.hysteresis;
                if (p.mesh_damping > 0 && !in_gap() && !(motor_at_rest && load_at_rest)) output.v = p.mesh_damping;
            }
        }
        // T_1 |i| = loss + share T_2 where the motor turns.
        const bool dry = has(DriveNumbers::dry_losses);
        real share = p.driving;
        // Torques on the motor and on the load, less those of the mesh.
        Form to_motor = r.pull, to_load = {-load_torque, 0, -p.load_drag, together ? 0 : p.load_drag, 0};
        if (has(DriveNumbers::of_motor)) to_motor.one -= x.motor * p.motor_slips;
        if (has(DriveNumbers::of_load)) to_load.one -= x.load * p.load_slips;
        to_motor.a -= p.motor_drag;
        if (dry && !motor_at_rest) {
            const Plane m = loss_plane(x.cell, false);
            share = 1 + m.per_load;
            to_motor.one -= p.per_ratio * (x.motor * p.rated_torque * m.at_zero);
            to_motor.a -= p.per_ratio * (p.rated_torque * p.speed_share * m.per_speed);
        }
        if (together && motor_at_rest) {
            output.one = load_torque;
        } else if (together) {
            const real inertia = 1 / p.per_motor + share * p.per_ratio / p.per_load;
            if (!(inertia > 0)) return false;
            a.add(1 / inertia, to_motor);
            a.add(share * p.per_ratio / inertia, to_load);
            w = a;
            output.add(1 / p.per_load, a);
            output.add(-1, to_load);
        } else {
            if (!motor_at_rest) {
                a.add(p.per_motor, to_motor);
                a.add(-p.per_motor * share * p.per_ratio, output);
            }
            if (!load_at_rest) {
                w.add(p.per_load, to_load);
                w.add(p.per_load, output);
            }
            r.twists = motor_at_rest && load_at_rest ? 0 : 1;
        }
        r.output = output;
        r.a = a;
        r.w = w;
        a.add(-1, w);
        r.v = a;
        // Contacts that slip.
        if (has(DriveNumbers::of_motor) && x.motor != 0) guard(0, 0, x.motor, 0, 0, speed, motor, 0);
        if (has(DriveNumbers::of_twist) && x.twist != 0 && partner(twist) != motor)
            guard(0, 0, 0, x.twist, 0, speed, twist, 0);
        if (has(DriveNumbers::of_load) && x.load != 0 && partner(load) < 0) {
            const real s = x.load;
            guard(0, 0, s, -s, 0, speed, load, 0);
        }
        if (motor_at_rest) {  // T_1 |i| = share T_2 + standing where it begins to turn
            real forward = share, backward = share, standing = 0, standing_back = 0;
            if (dry) {
                const Plane up = loss_plane(x.cell, true), down = loss_plane(x.back, true);
                forward = 1 + up.per_load;
                backward = 1 + down.per_load;
                standing = p.rated_torque * up.at_zero;
                standing_back = p.rated_torque * down.at_zero;
            }
            Form most_ahead = over(r.output, forward * p.per_ratio, p.motor_holds + standing * p.per_ratio);
            most_ahead.add(-1, r.pull);
            Form most_back = over(r.output, -backward * p.per_ratio, p.motor_holds + standing_back * p.per_ratio);
            most_back.add(1, r.pull);
            guard(most_ahead, capacity, motor, 1);
            guard(most_back, capacity, motor, -1);
        }
        if (has(DriveNumbers::of_twist) && x.twist == 0) {
            Form held = r.output;
            held.one -= at_zero;
            held.d -= slope;
            guard(over(held, -1, x.hysteresis), capacity, twist, 1);
            guard(over(held, 1, x.hysteresis), capacity, twist, -1);
        }
        if (load_at_rest) {
            guard(over(r.output, -1, p.load_holds + load_torque), capacity, load, 1);
            guard(over(r.output, 1, p.load_holds - load_torque), capacity, load, -1);
        }
        if (r.twists != 0) add_pieces(at_zero, slope);
        if (dry) add_cells(motor_at_rest);
        set_norm();
        return true;
    }

    // at_zero, slope: of the torque of the piece.
    void add_pieces(real at_zero, real slope) {
        // An end that the twist slips away from is not reached.
        const int slip = has(DriveNumbers::of_twist) ? x.twist : 0;
        if (x.piece + 1 < laws.pieces && slip >= 0) guard(upper(x.piece), 0, 0, 0, -1, piece, 0, 1);
        if (x.piece > 0 && slip <= 0) guard(-lower(x.piece), 0, 0, 0, 1, piece, 0, -1);
        if (!laws.has_gap || !(p.mesh_damping > 0) || in_gap()) return;
        const real way = x.piece > laws.zero ? 1 : -1, damping = way * p.mesh_damping;
        at_zero *= way;
        slope *= way;
        if (x.flanks == 1) return guard(-at_zero, 0, 0, -damping, -slope, flanks, 0, 0);
        if (x.flanks == 2) return guard(-at_zero, 0, 0, damping, -slope, flanks, 0, 0);
        guard(at_zero, 0, 0, damping, slope, flanks, 0, 1);
        if (laws.limits_damping) guard(at_zero, 0, 0, -damping, slope, flanks, 0, 2);
    }

    void add_cells(bool at_rest) {
        const Form mu = over(r.output, p.per_rated, 0);
        const bool map = laws.losses == DriveLaws::by_map;
        if (!at_rest && map) {
            Edge edges[3];
            const int n = laws.map.edges(x.cell, edges);
            for (int e = 0; e < n; ++e) {
                const Plane& in = edges[e].inside;
                Form form = over(mu, x.motor * in.per_load, in.at_zero);
                form.a += x.motor * p.speed_share * in.per_speed;
                guard(form, cell, 0, edges[e].neighbour);
            }
            return;
        }
        const int n = map ? laws.map.load_intervals() : 2;
        for (int way = 1; way >= -1; way -= 2) {
            if (!at_rest && way < 0) return;
            const int k = way > 0 ? x.cell : x.back;
            const real s = at_rest ? way : x.motor;
            if (k > 0) guard(over(mu, s, map ? -laws.map.loads[k] : 0), way > 0 ? cell : back, 0, k - 1);
            if (k + 1 < n) guard(over(mu, -s, map ? laws.map.loads[k + 1] : 0), way > 0 ? cell : back, 0, k + 1);
        }
    }

    void set_norm() {
        const real w = laws.rigid ? 0 : laws.root[x.piece] * p.stiff, per_w = w > 0 ? 1 / w : 0, t = p.torque_scale;
        r.per_q = p.per_torque_scale;
        r.per_d = w;
        const auto row = [&](const Form& f) {
            return magnitude(f.q) * t + magnitude(f.a) + magnitude(f.v) + magnitude(f.d) * per_w;
        };
        r.norm = most(most(row(r.a), row(r.v)), w);
        if (laws.delays_torque) r.norm = most(r.norm, p.delay + p.delay * p.back_torque * p.per_torque_scale);
    }

    // Advances by a time h. False: something is not certain; nothing of this walk may be used.
    bool advance(real h) { return enter() && finish(h); }
    // The regime under the inputs of the step.
    bool enter() {
        if (!x.known) {
            if (!begin()) return false;
        } else {
            if (!make()) return goes_on_with(no_regime);
            if (rests() && spare_at_rest(r.pull.at(x)) < 0 && (!begin() || rests())) return false;
            int violated = -1;
            const Verdict v = verify(0, -1, true, violated);
            if (v == unsure || (v == no && !resolve(violated, true))) return false;
        }
        return true;
    }
    bool finish(real left) {
        while (left > 0) {
            int fired = -1;
            if (!go_on(left, fired)) return false;
            if (rests()) spare_at_rest(r.pull.at(x));
            if (fired < 0) return true;
            if (++switchings > most_switchings) return goes_on_with(too_long);
            const real shift = has_tangent ? shift_of(r.guards[fired]) : 0;
            follow(shift);
            if (!resolve(fired, false)) return goes_on_with(no_regime);
            follow(-shift);
        }
        return true;
    }
    // Finds the modes where only the states are known.
    bool begin() {
        x.flanks = 0;
        if (!laws.rigid) locate_piece();
        if (!x.known) x.held = spring_torque();
        x.known = true;
        const real speeds[3] = {x.a, x.v, x.a - x.v};
        unsigned slipping = 0;
        for (int c = 0; c < 3; ++c) {
            *mode(c) = static_cast<signed char>(speeds[c] > 0 ? 1 : speeds[c] < 0 ? -1 : 0);
            if (*mode(c) != 0 && has(contact_bit(c))) slipping |= 1u << c;
        }
        return find(slipping);
    }
    // The same where some contacts are known to slip on.
    bool find(unsigned slipping) {
        int open = 0, opened[3] = {0, 0, 0};
        for (int c = 0; c < 3; ++c)
            if (has(contact_bit(c)) && (slipping >> c & 1u) == 0) opened[open++] = c;
        int combinations = 1;
        for (int k = 0; k < open; ++k) combinations *= 3;
        const DriveState from = x;
        for (int n = 0; n < combinations; ++n) {
            x = from;
            for (int k = 0, rest = n; k < open; ++k, rest /= 3)
                *mode(opened[k]) = static_cast<signed char>(rest % 3 == 2 ? -1 : rest % 3);
            locate_losses(slipping_torque());
            const Verdict v = accept(slipping, -1);
            if (v != no) return v == yes;
        }
        return false;
    }

    // Within the regime, to the next guard that falls or to the end. False: not certain.
    bool go_on(real& left, int& fired) {
        int halvings = 0;
        for (bool fresh = true; left > 0; fresh = false) {
            const real longest = laws.reach[laws.most_degree];
            real s = r.norm * left > longest ? longest / r.norm : left;
            series.expand(r, x, s, laws.reach, laws.inverse, laws.most_degree);
            Crossing first;
            while (true) {
                bool halve = false;
                if (!see(s, fresh, first, halve)) return false;
                if (!halve) break;
                if (++halvings > most_halvings) {
                    if (!goes_on_with(too_long)) return false;
                    break;
                }
                series.shorten();
                s *= real(0.5);
            }
            if (first.doubtful && !goes_on_with(two_at_once)) return false;
            if (first.guard >= 0) {
                x.angle += series.move(s, first.at, laws.inverse, x);
                if (has_tangent) move_tangent(s * first.at);
                left -= first.at * s;
                fired = first.guard;
                return true;
            }
            x.angle += series.move(s, 1, laws.inverse, x);
            if (has_tangent) move_tangent(s);
            left = s == left ? 0 : left - s;
        }
        return true;
    }

    // The rates of the state.
    void rates(real* to) const {
        const real twists = r.twists;
        to[0] = r.q.at(x);
        to[1] = r.a.at(x);
        to[2] = twists * r.v.at(x);
        to[3] = twists * x.v;
    }
    // Derivatives of torques and rates by the inputs, in the direction of the tangent.
    struct ByInputs {
        real pull, output, q, a, w;
    };
    ByInputs by_inputs() const {
        const real stall = p.stall_torque * by_command;
        ByInputs by = {laws.delays_torque ? 0 : stall, 0, laws.delays_torque ? p.delay * stall : 0, 0, 0};
        if (rests()) return by;
        const real share =
            has(DriveNumbers::dry_losses) && !motor_rests() ? 1 + loss_plane(x.cell, false).per_load : p.driving;
        if (tied()) {
            if (!motor_rests()) {
                const real inertia = 1 / p.per_motor + share * p.per_ratio / p.per_load;
                by.a = by.w = (by.pull - share * p.per_ratio * by_load) / inertia;
            }
            by.output = by.a / p.per_load + by_load;
        } else {
            if (has(DriveNumbers::of_twist) && x.flanks == 0) by.output = x.twist * by_hysteresis;
            if (!motor_rests()) by.a = p.per_motor * (by.pull - share * p.per_ratio * by.output);
            if (!load_rests()) by.w = p.per_load * (by.output - by_load);
        }
        return by;
    }
    // The same of a guard.
    real by_inputs(const Guard& g) const {
        const ByInputs by = by_inputs();
        const int way = g.to;
        if (g.kind == capacity && rests()) {
            const real held = way > 0 ? most_held() : least_held();
            real per_torque;
            motor_held(held, way, per_torque);
            return per_torque * (held == spring_torque() + way * x.hysteresis ? way * by_hysteresis : by_load);
        }
        if (g.kind == capacity && g.of == motor) {
            const bool dry = has(DriveNumbers::dry_losses);
            const real share = dry ? 1 + loss_plane(way > 0 ? x.cell : x.back, true).per_load : p.driving;
            return way * (share * p.per_ratio * by.output - by.pull);
        }
        if (g.kind == capacity && g.of == twist) return by_hysteresis - way * by.output;
        if (g.kind == capacity) return way * (by_load - by.output);
        if (g.kind != cell && g.kind != back) return 0;
        const bool map = laws.losses == DriveLaws::by_map;
        real per_torque = 0;
        if (motor_rests() || !map) {
            const real s = !motor_rests() ? x.motor : g.kind == cell ? 1 : -1;
            per_torque = g.to < (g.kind == cell ? x.cell : x.back) ? s : -s;
        } else {
            Edge edges[3];
            const int n = laws.map.edges(x.cell, edges);
            for (int e = 0; e < n; ++e)
                if (edges[e].neighbour == g.to) per_torque = x.motor * edges[e].inside.per_load;
        }
        return per_torque * p.per_rated * by.output;
    }
    // By how much later a guard falls, per shift of the inputs.
    real shift_of(const Guard& g) const {
        real rate[4];
        rates(rate);
        const real fall = g.form.along(rate);
        return fall < 0 ? -(by_inputs(g) + g.form.along(tangent)) / fall : 0;
    }
    // Takes the tangent along for a time.
    void follow(real time) {
        if (time == 0) return;
        real rate[4];
        rates(rate);
        for (int c = 0; c < 4; ++c) tangent[c] += time * rate[c];
    }
    void move_tangent(real s) {
        const real reached = r.norm * s, twists = r.twists;
        int longest = 4;
        while (longest < laws.most_degree && reached > laws.reach[longest]) ++longest;
        const ByInputs inputs = by_inputs();
        real z[4] = {tangent[0], tangent[1], tangent[2], tangent[3]}, f = s,
             by[3] = {inputs.q, inputs.a, inputs.a - inputs.w};
        tangent[4] += s * (z[1] - z[2]);
        for (int k = 1; k <= longest; ++k) {
            f = s * laws.inverse[k];
            const real q = f * (by[0] + r.q.along(z)), a = f * (by[1] + r.a.along(z)),
                       v = twists * f * (by[2] + r.v.along(z)), d = twists * f * z[2];
            by[0] = by[1] = by[2] = 0;
            z[0] = q;
            z[1] = a;
            z[2] = v;
            z[3] = d;
            for (int c = 0; c < 4; ++c) tangent[c] += z[c];
            tangent[4] += s * laws.inverse[k + 1] * (z[1] - z[2]);
        }
    }

    // Finds the first guard that falls within the series. False: it is not certain.
    bool see(real s, bool fresh, Crossing& first, bool& halve) const {
        first.guard = -1;
        first.at = 2;
        first.doubtful = false;
        for (int g = 0; g < r.n; ++g) {
            const Form& f = r.guards[g].form;
            const DriveSeries::Cubic cubic = series.cubic(f);
            if (DriveSeries::stays_positive(cubic)) continue;
            real at = 0;
            const Verdict v = judge(f, cubic.c, cubic.rest, s, first.at, fresh, at, halve);
            if (v == unsure) return false;
            if (halve) return true;
            if (v == yes) continue;
            if (magnitude(at - first.at) < together()) {
                // Where flanks part without a torque the losses have an edge, too: the regime in the gap has its own
                // cell.
                const bool parts = is_end_of_flank(g) && is_of_losses(first.guard);
                if (parts || (is_end_of_flank(first.guard) && is_of_losses(g))) {
                    if (parts) first.guard = g;
                    continue;
                }
                first.doubtful = true;
            }
            if (at < first.at) {
                if (first.at - at >= together()) first.doubtful = false;
                first.guard = g;
                first.at = at;
            }
        }
        return true;
    }

    bool is_end_of_flank(int g) const {
        return r.guards[g].kind == piece && laws.has_gap && x.piece + r.guards[g].to == laws.zero;
    }
    bool is_of_losses(int g) const { return r.guards[g].kind == cell || r.guards[g].kind == back; }
    // Does a guard whose cubic is c stay positive, or does it fall later than another that falls `before`? No: it falls
    // through zero once, there.
    Verdict judge(const Form& f, const real* c, real rest, real s, real before, bool fresh, real& at,
                  bool& halve) const {
        const real size = f.size(x), zero = on_zero() * size;
        if (c[0] < -zero) {
            at = 0;
            return goes_on_with(below_zero) ? no : unsure;
        }
        if (c[0] <= zero) {  // it begins on zero: does it depart?
            if (c[1] == 0 && c[2] == 0 && c[3] == 0 && rest == 0) return yes;
            const real no_slope = 10 * on_zero() * (s * size_of_rate(f) + magnitude(c[2]) + magnitude(c[3]) + rest);
            if (c[1] < -no_slope) {
                at = 0;
                return !fresh || goes_on_with(near_zero) ? no : unsure;
            }
            if (c[1] > no_slope) {
                halve = !(least(c[1], least(c[1] + real(0.5) * c[2], c[1] + c[2] + c[3])) > rest);
                return yes;
            }
            if (c[2] > no_slope) {
                halve = !(least(c[2], c[2] + c[3]) > rest);
                return yes;
            }
            if (!(c[3] > no_slope && c[2] >= -no_slope)) return goes_on_with(near_zero) ? yes : unsure;
            halve = !(c[3] > rest);
            return yes;
        }
        const int degree = series.degree;
        real all[DriveSeries::longest + 1], end = 0, slope_rest = 0;
        for (int k = degree; k >= 4; --k) {
            end += all[k] = series.term(f, k);
            slope_rest += k * magnitude(all[k]);
        }
        const real d0 = c[1], d1 = c[1] + c[2], d2 = c[1] + 2 * c[2] + 3 * c[3];
        if (least(d0, least(d1, d2)) > slope_rest) return yes;
        if (!(most(d0, most(d1, d2)) < -slope_rest)) {
            halve = true;
            return yes;
        }
        for (int k = 0; k < 4; ++k) all[k] = c[k];
        end += c[3] + c[2] + c[1] + c[0];
        if (end >= 0) return yes;
        int pairs = degree / 2 + 1;
        all[2 * pairs - 1] = degree % 2 == 0 ? 0 : all[degree];
        while (pairs > 2 &&
               magnitude(all[2 * pairs - 2]) + magnitude(all[2 * pairs - 1]) < real(1e-3) * ROUNDING * size)
            --pairs;
        // Even and odd terms, as polynomials of t^2: four chains, which do not wait for each other.
        const auto value_at = [&](real t, int of, real& slope) {
            const real u = t * t;
            real even = 0, odd = 0, even_slope = 0, odd_slope = 0;
            for (int k = of - 1; k >= 0; --k) {
                even_slope = even_slope * u + even;
                odd_slope = odd_slope * u + odd;
                even = even * u + all[2 * k];
                odd = odd * u + all[2 * k + 1];
            }
            slope = odd + 2 * t * (even_slope + t * odd_slope);
            return even + t * odd;
        };
        real slope;
        if (before <= 1 && value_at(before + together(), pairs, slope) > zero) return yes;  // another one falls first
        // Newton's method within the bracket that the zero lies in, first of the terms that matter most. Steps shrink
        // quadratically: once short, the next one would be below rounding.
        real low = 0, high = 1, t = c[0] / (c[0] - end);
        for (int m = 0; m < 3; ++m) {
            const real value = value_at(t, pairs < 3 ? pairs : 3, slope), next = t - value / slope;
            if (next > 0 && next < 1) t = next;
        }
        for (int m = 0; m < 60; ++m) {
            const real value = value_at(t, pairs, slope);
            (value > 0 ? low : high) = t;
            const real next = t - value / slope;
            const bool close = magnitude(next - t) <= together(), inside = next > low && next < high;
            if (close && !inside) break;
            t = inside ? next : real(0.5) * (low + high);
            if (close) break;
        }
        at = t;
        return no;
    }
    // The sum of the magnitudes of the terms that the rate of a form consists of.
    real size_of_rate(const Form& f) const {
        return magnitude(f.q) * r.q.size(x) + magnitude(f.a) * r.a.size(x) + magnitude(f.v) * r.twists * r.v.size(x) +
               magnitude(f.d) * r.twists * magnitude(x.v);
    }
    // Does a guard that is zero rise from there, by the first of its derivatives that is not zero?
    Verdict departs(const Guard& g) const {
        const Form& f = g.form;
        const real on = r.twists;
        bool moves = false;
        real t[4] = {r.q.at(x), r.a.at(x), on * r.v.at(x), on * x.v};
        real m[4] = {r.q.size(x), r.a.size(x), on * r.v.size(x), on * magnitude(x.v)};
        for (int k = 1; k <= 4; ++k) {
            const real value = (f.q * t[0] + f.a * t[1]) + (f.v * t[2] + f.d * t[3]);
            const real size =
                (magnitude(f.q) * m[0] + magnitude(f.a) * m[1]) + (magnitude(f.v) * m[2] + magnitude(f.d) * m[3]);
            moves = moves || size > 0;
            if (magnitude(value) > doubt() * size) {
                if (value > 0) return yes;
                // A contact whose torque or speed only grazes its limit is another matter than an edge of a law.
                const bool of_contact = g.kind == speed || g.kind == capacity;
                return k == 1 || !of_contact || goes_on_with(near_zero) ? no : unsure;
            }
            const auto next = [&](const Form& of, real& magnitudes) {
                magnitudes = (magnitude(of.q) * m[0] + magnitude(of.a) * m[1]) +
                             (magnitude(of.v) * m[2] + magnitude(of.d) * m[3]);
                return (of.q * t[0] + of.a * t[1]) + (of.v * t[2] + of.d * t[3]);
            };
            real n[4];
            const real q = next(r.q, n[0]), a = next(r.a, n[1]), v = on * next(r.v, n[2]);
            n[3] = on * m[2];
            t[3] = on * t[2];
            t[0] = q;
            t[1] = a;
            t[2] = v;
            m[0] = n[0];
            m[1] = n[1];
            m[2] = on * n[2];
            m[3] = n[3];
        }
        return !moves || goes_on_with(near_zero) ? yes : unsure;
    }

    // Finds the regime that follows where a guard has fallen, or, after the inputs have jumped, is below zero.
    bool resolve(int fired, bool jump) {
        const Guard g = r.guards[fired];
        if (g.kind == cell || g.kind == back) {
            if (g.to < 0) return false;
            (g.kind == cell ? x.cell : x.back) = g.to;
            // A continuous law: across its edge the motion goes on, and what guards it has not changed.
            return jump ? accept(moving(), -1) == yes : make();
        }
        if (g.kind == piece) {
            x.d = g.to > 0 ? upper(x.piece) : lower(x.piece);
            // Where flanks meet, their damping is more than the torque of the spring.
            const bool met = in_gap();
            if (met) x.flanks = laws.limits_damping && p.mesh_damping > 0 ? 2 : 0;
            x.piece += g.to;
            if (!met && !in_gap() && !jump) return make();  // a continuous law
            if (in_gap()) x.flanks = 0;
            locate_losses(slipping_torque());
            return accept(moving(), -1) == yes;
        }
        if (g.kind == flanks) {
            x.flanks = static_cast<signed char>(g.to);
            locate_losses(slipping_torque());
            return accept(moving(), -1) == yes;
        }
        const real torque = r.output.at(x);
        if (g.kind == capacity) {
            // Others that it was held by may have to go along.
            const int before = g.of == motor ? twist : motor, after = g.of == load ? twist : load;
            const int along[2] = {before, after};
            const int way[2] = {g.to, g.of == motor ? g.to : -g.to};
            const unsigned go = moving();
            const DriveState from = x;
            for (int n = 0; n < 4; ++n) {
                x = from;
                *mode(g.of) = static_cast<signed char>(g.to);
                bool well = true;
                for (int k = 0; k < 2; ++k)
                    if ((n >> k & 1) != 0) {
                        well = well && *mode(along[k]) == 0 && has(contact_bit(along[k]));
                        *mode(along[k]) = static_cast<signed char>(way[k]);
                    }
                if (!well) continue;
                locate_losses(torque);
                const Verdict v = accept(jump ? go : go | 1u << g.of, -1);
                if (v != no) return v == yes;
            }
            return false;
        }
        if (jump) return false;
        const int also = partner(g.of);
        const unsigned go = moving() & ~(1u << g.of) & ~(also < 0 ? 0u : 1u << also);
        x.held = torque;
        stop(g.of);
        if (also >= 0) {
            if (also == twist) stop(twist);
            return find(go);
        }
        const signed char was = *mode(g.of);
        const DriveState from = x;
        for (int n = 0; n < 3; ++n) {
            x = from;
            *mode(g.of) = n == 0 ? static_cast<signed char>(0) : n == 1 ? static_cast<signed char>(-was) : was;
            locate_losses(torque);
            const Verdict v = accept(go, g.of);
            if (v != no) return v == yes;
        }
        x = from;
        return find(go);
    }
    // Contacts that slip: they go on in their direction, whatever their speed.
    unsigned moving() const {
        return (has(DriveNumbers::of_motor) && x.motor != 0 ? 1u : 0u) |
               (has(DriveNumbers::of_twist) && x.twist != 0 ? 2u : 0u) |
               (has(DriveNumbers::of_load) && x.load != 0 ? 4u : 0u);
    }
    // A contact has come to rest: its speed is zero to the last bit, and a turning point sets the hysteresis (16).
    void stop(int contact) {
        real &by_a = tangent[1], &by_v = tangent[2];
        if (contact == motor) {
            const bool alone = tied() || load_rests();
            x.v = alone ? 0 : x.v - x.a;
            by_v = alone ? 0 : by_v - by_a;
            x.a = by_a = 0;
        } else if (contact == load) {
            if (motor_rests()) {
                x.v = by_v = 0;
            } else if (tied()) {
                x.a = by_a = 0;
            } else {
                x.v = x.a;
                by_v = by_a;
            }
        } else {
            x.v = by_v = 0;
            const real held = spring_torque();
            x.hysteresis = p.hysteresis * magnitude(held);
            by_hysteresis = p.hysteresis * laws.slope[x.piece] * (held < 0 ? -tangent[3] : tangent[3]);
        }
    }

    // Takes the regime of these modes, its pieces and cells found by a walk across the edges that are violated, if it
    // holds. moving: contacts that go on in their direction. by_value: a contact that has just come to rest, of which
    // the torque alone decides.
    Verdict accept(unsigned moving, int by_value) {
        for (int n = 0; n < longest_walk; ++n) {
            if (!possible()) return no;
            if (!make()) return unsure;
            if (rests()) {
                const real spare = spare_at_rest(r.pull.at(x)), near = doubt() * (p.motor_holds + p.load_holds);
                return spare > near ? yes : spare < -near ? no : goes_on_with(near_zero) ? yes : unsure;
            }
            int violated = -1;
            const Verdict v = verify(moving, by_value, false, violated);
            if (v != no) return v;
            const Guard& g = r.guards[violated];
            if (g.kind == speed || g.kind == capacity) return no;
            if (g.to < 0 && g.kind != piece) return unsure;
            if (g.kind == piece)
                x.piece += g.to;
            else if (g.kind == flanks)
                x.flanks = static_cast<signed char>(g.to);
            else
                (g.kind == cell ? x.cell : x.back) = g.to;
        }
        return unsure;
    }

    // Whether the regime holds strictly just after now. lasting: the present one after a change of the inputs: what is
    // zero holds. violated: a guard that is not, edges first.
    Verdict verify(unsigned go_on, int by_value, bool lasting, int& violated) const {
        violated = -1;
        bool sure = true, by_contact = false;
        int contacts_violated = 0;
        const bool jumps = tied();
        if (lasting) go_on = moving();
        for (int g = 0; g < r.n; ++g) {
            const Guard& it = r.guards[g];
            if (it.kind == speed && (go_on >> it.of & 1u) != 0) continue;
            // A jump of the inputs changes torques at rest and, of tied shafts, what the mesh passes on.
            if (lasting && it.kind != capacity && !jumps) continue;
            const real value = it.form.at(x), near = doubt() * it.form.size(x);
            if (value > near) continue;
            if (!(value < -near)) {
                if (lasting) continue;
                if (it.kind == capacity && it.of == by_value && !goes_on_with(near_zero)) sure = false;
                const Verdict rises = departs(it);
                if (rises == unsure) sure = false;
                if (rises != no) continue;
            }
            const bool of_contact = it.kind == speed || it.kind == capacity;
            if (of_contact) ++contacts_violated;
            if (violated < 0 || (by_contact && !of_contact)) {
                violated = g;
                by_contact = of_contact;
            }
        }
        if (!sure || (lasting && contacts_violated > 1)) return unsure;
        return violated < 0 ? yes : no;
    }
};
