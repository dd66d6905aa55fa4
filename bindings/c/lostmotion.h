/* lostmotion in C: drives and drive trains, exactly.
 *
 * A scenario is read from numbers that Python has written (lostmotion.portable.description), controllers and references
 * among them, its parameters are set by their keys, and it runs in one go or step by step. A train can also be built
 * here, element by element. Units are SI; angles in rad. All functions that can fail return 0 when they succeed and the
 * number of a status otherwise; lm_error() and the like give the sentence that Python would give. Names are those of
 * scenario files and result variables (docs/drive-trains.md). A text that a function returns lives as long as its
 * object.
 *
 * An object belongs to one thread at a time; different objects to as many threads as there are.
 */
#ifndef LOSTMOTION_H
#define LOSTMOTION_H

#include <stddef.h>

#ifdef __cplusplus
extern "C" {
#endif

/* Defined as nothing, where a library keeps the functions to itself. */
#ifndef LM_API
#if defined _WIN32
#define LM_API __declspec(dllexport)
#else
#define LM_API __attribute__((visibility("default")))
#endif
#endif

/* Rises with every change that a caller has to know of. */
#define LM_INTERFACE_VERSION 6
LM_API int lm_interface_version(void);

enum {
    LM_OK = 0,
    LM_INTERRUPTED = 1,  /* by the function of lm_scenario_set_interrupt or lm_set_interrupt */
    LM_JAMMED = 2,       /* no combination of contact modes is consistent */
    LM_OUTSIDE = 3,      /* the motion left the data of a law, or the range of the arithmetic */
    LM_ACCUMULATION = 4, /* switching instants accumulate */
    LM_CONTROLLER = 6,   /* the controller failed, or its command is no finite number */
    LM_INVALID = 100     /* a value, a name or a train that cannot be used */
};

/* --- a scenario --- */

typedef struct lm_scenario lm_scenario;

/* From the numbers of a description. NULL if they cannot be used; then `error`, of error_size bytes, says why. */
LM_API lm_scenario* lm_scenario_read(const double* numbers, size_t n, char* error, size_t error_size);
LM_API void lm_scenario_free(lm_scenario* scenario);
/* What the last call on this scenario that failed found wrong. */
LM_API const char* lm_scenario_error(const lm_scenario* scenario);
LM_API const char* lm_scenario_title(const lm_scenario* scenario);
LM_API double lm_scenario_duration(const lm_scenario* scenario); /* [s] */
LM_API double lm_scenario_interval(const lm_scenario* scenario); /* of the samples [s] */
LM_API int lm_scenario_set_times(lm_scenario* scenario, double duration, double interval);

/* The parameters that can be set, by their keys in scenario files, such as "load.inertia"; values in SI. A value that
 * cannot be used, or is outside its range in scenario files, leaves the scenario as it was. */
LM_API size_t lm_scenario_parameter_count(const lm_scenario* scenario);
LM_API const char* lm_scenario_parameter_key(const lm_scenario* scenario, size_t k);
LM_API const char* lm_scenario_parameter_unit(const lm_scenario* scenario, size_t k);
LM_API double lm_scenario_get(const lm_scenario* scenario, size_t k);
LM_API int lm_scenario_set(lm_scenario* scenario, size_t k, double value);
/* All parameters at once, values[lm_scenario_parameter_count]: what does not fit beside old values may fit beside new
 * ones. Nothing changes if one is wrong. */
LM_API int lm_scenario_set_all(lm_scenario* scenario, const double* values);

/* Straight lines, each from a time on, the first from 0 s: value and slope; and sines: amplitude, frequency [Hz],
 * phase [rad]. */
typedef struct {
    const double* breakpoints; /* n_breakpoints x (time, value, slope) */
    size_t n_breakpoints;
    const double* sines; /* n_sines x (amplitude, frequency, phase) */
    size_t n_sines;
} lm_signal;

/* In the place of an input of a run, counted as those of the scenario's drive or train: commands, then load torques,
 * then references of continuous controllers. The parameters of the signal that it replaces then change nothing. */
LM_API int lm_scenario_set_signal(lm_scenario* scenario, size_t input, const lm_signal* signal);

/* What a sampled controller is to follow, counted as those of the scenario: from a time on value + rate s +
 * second s^2/2 + third s^3/6, the first from t = 0 on, n x (time, value, rate, second, third); and sines. The
 * parameters of the reference that it replaces then change nothing. */
LM_API int lm_scenario_set_reference(lm_scenario* scenario, size_t controller, const double* pieces, size_t n,
                                     const double* sines, size_t n_sines);

/* The value of an input at t = 0. */
LM_API double lm_scenario_input_at_start(const lm_scenario* scenario, size_t input);

/* Whether sampled controllers follow inputs of a simulation, in the place of their references in the scenario. */
LM_API int lm_scenario_give_references(lm_scenario* scenario, int given);

/* Which inputs of a simulation follow the signals and references of the scenario in the place of what its calls give:
 * played[n], of the first n inputs. It acts on simulations that are made, or go on, afterwards. */
LM_API void lm_scenario_play(lm_scenario* scenario, const int* played, size_t n);

/* interrupted(context) is called often, from the thread that runs, in the time between switchings too; a value other
 * than 0 ends the run with LM_INTERRUPTED within milliseconds. NULL: nothing ends it. */
LM_API void lm_scenario_set_interrupt(lm_scenario* scenario, int (*interrupted)(void*), void* context);

/* A run in one go. energy: whether to keep the energies. Beyond max_switchings the switchings are only counted. NULL if
 * nothing could run (lm_scenario_error); a motion that has no continuation gives a result with a status and an error.
 */
typedef struct lm_result lm_result;
LM_API lm_result* lm_scenario_run(lm_scenario* scenario, int energy, size_t max_switchings);
LM_API void lm_result_free(lm_result* result);
LM_API int lm_result_status(const lm_result* result);
LM_API const char* lm_result_error(const lm_result* result);
LM_API double lm_result_time(const lm_result* result); /* reached [s] */
LM_API double lm_result_left_data_at(
    const lm_result* result); /* first use of a loss map outside its data [s], or inf */
LM_API size_t lm_result_samples(const lm_result* result);
LM_API size_t lm_result_switchings(const lm_result* result); /* how many are kept */
LM_API size_t lm_result_switching_count(const lm_result* result);

typedef enum {
    LM_SAMPLES,   /* of the variables: one variable after the other, lm_result_samples() values each, at the
                   multiples of the interval from t = 0 on and, where it is none of them, at the end */
    LM_ENERGIES,  /* [J], one value each */
    LM_END_STATE, /* one value each */
    LM_SWITCHINGS /* one switching after the other, with these columns: instant [s], number of the cause, contacts */
} lm_part;
LM_API size_t lm_result_count(const lm_result* result, lm_part part);
LM_API const char* lm_result_name(const lm_result* result, lm_part part, size_t k);
LM_API const char* lm_result_unit(const lm_result* result, size_t variable);
LM_API const double* lm_result_values(const lm_result* result, lm_part part);

/* Why it stands still: what holds each dry contact at an instant [s] of the run, and what would free it. NULL if the
 * motion does not reach that instant; lm_scenario_error says why. */
typedef struct lm_explanation lm_explanation;
LM_API lm_explanation* lm_scenario_explain(lm_scenario* scenario, double time);
LM_API void lm_explanation_free(lm_explanation* explanation);

typedef enum {
    LM_CONTACTS, /* mode (-1 slips backward, 0 stuck, +1 slips forward), speed [rad/s], torque that it holds or takes
                    [N m], and those up to which it holds forward and backward [N m] */
    LM_MOTORS    /* constant commands from which on its shaft turns (of a drive: its load) forward and backward */
} lm_explained;
LM_API size_t lm_explanation_count(const lm_explanation* explanation, lm_explained what);
LM_API const char* lm_explanation_name(const lm_explanation* explanation, lm_explained what, size_t k);
LM_API const double* lm_explanation_values(const lm_explanation* explanation, lm_explained what, size_t k);

/* --- a train --- */

typedef struct lm_train lm_train;

/* What an element has under a key of its table in scenario files: one number, as "inertia" or "torque", or a list, in
 * SI units. What is left out has its default. These parts of an element have keys of their own:
 *
 *   "kind" of a motor         0: a DC motor, 1: a torque source, 2: a stepper
 *   "domain" of a shaft       1: it is a slide. Its inertia is a mass [kg], its angle a position [m], torques on it are
 *                             forces [N], and results have the names "<name>_position" and "<name>_load_force". The
 *                             ratio of a screw of lead p that drives it is 2 pi/p.
 *   "loaded" of a shaft       1: a load torque acts on it, the input "<name>_load_torque"
 *   "given_motion" of a shaft 1: its motion is given. "<name>_given_speed" and "<name>_given_acceleration" are inputs,
 *                             and the torque that the motion takes is the variable "<name>_drive_torque".
 *   "friction" of a shaft     ".torque" [N m] while it slips, ".breakaway_torque" at rest; or as a curve ".speeds",
 *                             ".torques"
 *   "stiffness" of a gear, "drag" of a shaft or damper, "curve" of a spring
 *                             torque over a twist or a speed, odd and piecewise linear: ".slopes", the first from 0 on,
 *                             and between them ".breaks", one less
 *   "torque" of an angle torque, "transmission_error" of a gear
 *                             values over the angle of the shaft, in straight lines through points: ".period",
 *                             ".angles", ".values"
 *   "mesh_stiffness" of a gear the same, of factors of its stiffness, each from its angle on
 *   "efficiencies" of a gear  ".driving", ".overrunning"
 *   "losses" of a gear        1: of the grid "loss_map", m_2B over ".speeds" and ".loads": ".values", the speeds of
 * each load after the other "safety" of a clutch      1: it is closed without a command "matrix"                  of a
 * mass matrix of n shafts: n x n numbers, row by row, symmetric and positive definite, between two shafts [kg m2],
 * between two slides [kg], between one of each [kg m]
 */
typedef struct {
    const char* key;
    const double* values;
    size_t n;
} lm_value;

/* NULL if there is no memory. lm_train_free(NULL) does nothing. */
LM_API lm_train* lm_train_new(void);
LM_API void lm_train_free(lm_train* train);

/* What the last call on this train that failed found wrong. */
LM_API const char* lm_train_error(const lm_train* train);

/* Adds an element: its table in scenario files ("shafts", "mass_matrices", "motors", "gears", "clutches", "freewheels",
 * "dampers", "torque_limiters", "ratchets", "brakes", "angle_torques", "springs" or "end_stops"), and the shafts that
 * it is on: none of a shaft; input and output of a gear and, where its housing is not the frame, a third; one of a
 * brake.
 */
LM_API int lm_add(lm_train* train, const char* table, const char* name, const char* const* shafts, size_t n_shafts,
                  const lm_value* values, size_t n);

/* Whether the train can be run. */
LM_API int lm_train_check(lm_train* train);

/* --- step by step --- */

typedef struct lm_simulation lm_simulation;

/* step: the usual interval [s]; others are allowed, this one is fastest. NULL if the train cannot be run;
 * lm_train_error says why. The train may be freed or changed afterwards. */
LM_API lm_simulation* lm_simulation_new(lm_train* train, double step);
/* Of a scenario, from its start, with its controllers; lm_scenario_error says why not. Commands and load torques are
 * given step by step. */
LM_API lm_simulation* lm_simulation_from(lm_scenario* scenario, double step);
/* The simulation goes on at its time, in its state, with the scenario as it is now: with other values of parameters.
 * The contacts are found anew. LM_INVALID if the variables are others, as where a friction that was 0 gives a shaft a
 * dry contact. */
LM_API int lm_go_on_with(lm_simulation* simulation, lm_scenario* scenario, double step);
LM_API void lm_simulation_free(lm_simulation* simulation);
LM_API const char* lm_error(const lm_simulation* simulation);

/* What there is to name and count. */
typedef enum {
    LM_STATES,    /* speeds, twists, angles, torques of DC motors */
    LM_INPUTS,    /* commands that no sampled controller gives, load torques, references of continuous controllers, and
                     those of sampled ones if they are to be given */
    LM_VARIABLES, /* all result variables, and what the controllers show */
    LM_CAPACITIES /* hysteresis capacities of gears, by the name of the gear */
} lm_kind;
LM_API size_t lm_count(const lm_simulation* simulation, lm_kind kind);
LM_API const char* lm_name(const lm_simulation* simulation, lm_kind kind, size_t k);
LM_API const char* lm_unit(const lm_simulation* simulation, lm_kind kind, size_t k);
LM_API const char* lm_meaning(const lm_simulation* simulation, lm_kind kind, size_t k);

/* To t = 0 at these states and capacities, in the order of their names; NULL: zeros. */
LM_API int lm_reset(lm_simulation* simulation, const double* states, const double* capacities);
/* Advances by interval [s] with each input running in a straight line from its first to its second value. When it
 * fails, the state is left as it was. */
LM_API int lm_advance(lm_simulation* simulation, double interval, const double* begin, const double* end);
/* Of a shaft whose motion is given, at the end of a step; of a slide in m. NAN: position or acceleration is not given.
 */
typedef struct {
    const char* shaft;
    double position;     /* [rad] */
    double speed;        /* [rad/s] */
    double acceleration; /* [rad/s^2] */
} lm_motion;
/* The same as lm_advance, with the motions of all shafts whose motion is given, in the place of their inputs. From the
 * present values on the acceleration runs in up to three straight lines, so that all that is given is met at the end
 * and speeds do not jump. */
LM_API int lm_advance_motion(lm_simulation* simulation, double interval, const double* begin, const double* end,
                             const lm_motion* motions, size_t n);
/* The same as lm_advance, with the answer of a shaft to its load torque, such as "load" of a drive: what a multibody
 * engine asks of an actuator. The mean torque is exactly J a + M, with the shaft's inertia J and the mean load torque
 * M. Commands of controllers at sample instants within the interval count as constant in the derivative. LM_INVALID:
 * no load torque acts on the shaft, its angle follows from no state, a mass matrix joins it to others, or inputs follow
 * signals. */
typedef struct {
    double torque;       /* mean torque of the train on its inertia and load [N m] */
    double derivative;   /* of the torque by the acceleration [kg m2]; -INFINITY: dry friction holds the shaft */
    double acceleration; /* mean [rad/s^2] */
} lm_answer;
LM_API int lm_advance_answer(lm_simulation* simulation, double interval, const double* begin, const double* end,
                             const char* shaft, lm_answer* answer);
/* The same as lm_scenario_set_interrupt, for lm_advance, lm_advance_motion and lm_run. */
LM_API void lm_set_interrupt(lm_simulation* simulation, int (*interrupted)(void*), void* context);
LM_API double lm_time(const lm_simulation* simulation);
/* What acts at t = 0, for what is read before the first step; later it changes nothing. */
LM_API int lm_hold(lm_simulation* simulation, const double* inputs);
/* Of an input of the simulation its number among those of the scenario, which has those of controllers too. */
LM_API size_t lm_solver_input(const lm_simulation* simulation, size_t input);
/* The present value of an input that follows its signal (lm_scenario_play); NaN of one that is given. */
LM_API double lm_played_input(const lm_simulation* simulation, size_t input);
/* All variables at the present instant, with the inputs at their last values. */
LM_API int lm_read(lm_simulation* simulation, double* variables);

/* All that it takes to continue bit for bit, as lm_state_size() numbers, the same on all machines. Numbers that did not
 * come from such a simulation are refused. */
LM_API size_t lm_state_size(const lm_simulation* simulation);
LM_API int lm_get_state(const lm_simulation* simulation, double* state);
LM_API int lm_set_state(lm_simulation* simulation, const double* state);

/* The same as a copy in memory, which takes a small part of that time. lm_snapshot_restore refuses those of a
 * simulation of another kernel; it must be one of the same train and controllers. */
typedef struct lm_snapshot lm_snapshot;
LM_API lm_snapshot* lm_snapshot_new(const lm_simulation* simulation);
LM_API void lm_snapshot_save(lm_snapshot* snapshot, const lm_simulation* simulation);
LM_API int lm_snapshot_restore(lm_simulation* simulation, const lm_snapshot* snapshot);
LM_API void lm_snapshot_free(lm_snapshot* snapshot);

/* Derivatives in the present regime: of the rates of the states and of the variables, in the direction (states,
 * inputs). A direction or a result may be NULL. */
LM_API int lm_directional_derivative(lm_simulation* simulation, const double* states, const double* inputs,
                                     double* rates, double* variables);

/* --- as a hybrid system, which an integrator of the caller's own solves --- */

/* Between two events dx/dt is smooth. One happens where a guard falls below zero, where an input jumps, at each
 * breakpoint of a signal that is followed, and at each tick of sampled controllers: then lm_settle() finds the regime
 * that follows. Not with field-oriented control inside.
 *
 * At a time [s], with these states and inputs, in the regime that it is in. */
LM_API int lm_place(lm_simulation* simulation, double time, const double* states, const double* inputs);
LM_API int lm_states(const lm_simulation* simulation, double* states);
/* dx/dt of the states. */
LM_API int lm_rates(lm_simulation* simulation, double* rates);
/* In natural magnitudes, shifted by 1e-9, so that an integrator stops where the next regime is determinate; 1 if there
 * is none at this place in the present regime. */
LM_API size_t lm_guard_count(const lm_simulation* simulation);
LM_API int lm_guards(lm_simulation* simulation, double* guards);
/* Runs the ticks that are due and finds the regime that holds from here on; states may change by less than the shift,
 * to what they are at rest. */
LM_API int lm_settle(lm_simulation* simulation);
/* The next tick of sampled controllers, or breakpoint of a signal that is followed [s], or INFINITY. */
LM_API double lm_next_event(const lm_simulation* simulation);
/* After each step of the integrator. 1: lm_settle() has to be called, since inputs take a torque at rest along. */
LM_API int lm_accept(lm_simulation* simulation);

/* --- a train in one go --- */

/* Runs to `duration` from these states and capacities. inputs: one signal each. variables: at k * interval for
 * k < samples, the last of them no later than at `duration`, one variable after the other. The simulation itself is
 * then at t = 0, at these states. */
LM_API int lm_run(lm_simulation* simulation, const lm_signal* inputs, const double* states, const double* capacities,
                  double duration, double interval, size_t samples, double* variables);

#ifdef __cplusplus
}
#endif

#endif
