/* lostmotion in C: drive trains, exactly.
 *
 * A train is built from its elements, checked, then run in one go or step by step. Units are SI; angles in rad. All
 * functions that can fail return 0 when they succeed and the number of a status otherwise; lm_error() gives the
 * sentence that Python would give. Names are those of scenario files and result variables (docs/drive-trains.md).
 *
 * An object belongs to one thread at a time; different objects to as many threads as there are.
 */
#ifndef LOSTMOTION_H
#define LOSTMOTION_H

#include <stddef.h>

#ifdef __cplusplus
extern "C" {
#endif

#if defined _WIN32
#define LM_API __declspec(dllexport)
#else
#define LM_API __attribute__((visibility("default")))
#endif

/* Rises with every change that a caller has to know of. */
#define LM_INTERFACE_VERSION 1
LM_API int lm_interface_version(void);

enum {
    LM_OK = 0,
    LM_INTERRUPTED = 1,  /* not by this interface */
    LM_JAMMED = 2,       /* no combination of contact modes is consistent */
    LM_OUTSIDE = 3,      /* the motion left the data of a law, or the range of the arithmetic */
    LM_ACCUMULATION = 4, /* switching instants accumulate */
    LM_INVALID = 100     /* a value, a name or a train that cannot be used */
};

/* --- a train --- */

typedef struct lm_train lm_train;

/* A number by its key in a scenario file, such as "motor.rotor_inertia" or "gearbox.ratio". */
typedef struct {
    const char* key;
    double value;
} lm_parameter;

/* The keys that lm_parameter knows, their units, and how many there are. NULL beyond the last. */
LM_API size_t lm_parameter_count(void);
LM_API const char* lm_parameter_key(size_t k);
LM_API const char* lm_parameter_unit(size_t k);

/* Torque over a twist or a speed x, odd and piecewise linear: slopes[k] between breaks[k - 1] and breaks[k] > 0;
 * slopes[0] from 0 on, and one slope more than breaks. */
typedef struct {
    const double* breaks;
    const double* slopes;
    size_t n_breaks;
} lm_curve;

/* Values over the angle, by straight lines through the points, repeating with the period. */
typedef struct {
    double period;
    const double* angles;
    const double* values;
    size_t n;
} lm_periodic_curve;

/* Loss coefficient m_2B on a grid of relative speeds and relative loads: values[i * n_loads + j] at speeds[i],
 * loads[j]. */
typedef struct {
    const double* speeds;
    size_t n_speeds;
    const double* loads;
    size_t n_loads;
    const double* values;
} lm_loss_map;

/* NULL if there is no memory. lm_train_free(NULL) does nothing. */
LM_API lm_train* lm_train_new(void);
LM_API void lm_train_free(lm_train* train);

/* What the last call on this train that failed found wrong. */
LM_API const char* lm_train_error(const lm_train* train);

/* loaded: whether a load torque acts on the shaft; then "<name>_load_torque" is an input. breakaway_torque: 0, or above
 * the friction torque. drag: torque over speed, or NULL. */
LM_API int lm_add_shaft(lm_train* train, const char* name, double inertia, double viscous_friction,
                        double friction_torque, double breakaway_torque, const lm_curve* drag, int loaded);
/* torque_source: the command times the rated torque acts; else a DC motor (2). torque_limit: of a torque source, or
 * INFINITY. */
LM_API int lm_add_motor(lm_train* train, const char* name, const char* shaft, const lm_parameter* parameters, size_t n,
                        int torque_source, double torque_limit);
/* stiffness NULL: rigid. losses NULL: those of the parameters, if any. efficiencies NULL, or driving and overrunning.
 */
LM_API int lm_add_gear(lm_train* train, const char* name, const char* input, const char* output,
                       const lm_parameter* parameters, size_t n, const lm_curve* stiffness, const lm_loss_map* losses,
                       const double* efficiencies, double mesh_damping, const lm_periodic_curve* transmission_error);
/* Puts the housing of a gear, by default on the frame, on a shaft. LM_INVALID: there is none of that name. */
LM_API int lm_set_housing(lm_train* train, const char* gear, const char* shaft);
/* torque while it slips, breakaway_torque at rest (0: the same), at command 1. */
LM_API int lm_add_brake(lm_train* train, const char* name, const char* shaft, double torque, double breakaway_torque);
LM_API int lm_add_clutch(lm_train* train, const char* name, const char* input, const char* output, double torque,
                         double breakaway_torque);
LM_API int lm_add_safety_clutch(lm_train* train, const char* name, const char* input, const char* output, double torque,
                                double breakaway_torque);
LM_API int lm_add_freewheel(lm_train* train, const char* name, const char* input, const char* output);
LM_API int lm_add_angle_torque(lm_train* train, const char* name, const char* shaft, const lm_periodic_curve* torque);

/* Whether the train can be run. */
LM_API int lm_train_check(lm_train* train);

/* --- step by step --- */

typedef struct lm_simulation lm_simulation;

/* step: the usual interval [s]; others are allowed, this one is fastest. NULL if the train cannot be run;
 * lm_train_error says why. The train may be freed or changed afterwards. */
LM_API lm_simulation* lm_simulation_new(lm_train* train, double step);
LM_API void lm_simulation_free(lm_simulation* simulation);
LM_API const char* lm_error(const lm_simulation* simulation);

/* What there is to name and count. */
typedef enum {
    LM_STATES,    /* speeds, twists, angles, torques of DC motors */
    LM_INPUTS,    /* commands, then load torques */
    LM_VARIABLES, /* all result variables */
    LM_CAPACITIES /* hysteresis capacities of gears, by the name of the gear */
} lm_kind;
LM_API size_t lm_count(const lm_simulation* simulation, lm_kind kind);
LM_API const char* lm_name(const lm_simulation* simulation, lm_kind kind, size_t k);
LM_API const char* lm_unit(const lm_simulation* simulation, lm_kind kind, size_t k); /* of variables; else "" */

/* To t = 0 at these states and capacities, in the order of their names; NULL: zeros. */
LM_API int lm_reset(lm_simulation* simulation, const double* states, const double* capacities);
/* Advances by interval [s] with each input running in a straight line from its first to its second value. When it
 * fails, the state is left as it was. */
LM_API int lm_advance(lm_simulation* simulation, double interval, const double* begin, const double* end);
LM_API double lm_time(const lm_simulation* simulation);
/* All variables at the present instant, with the inputs at their last values. */
LM_API int lm_read(lm_simulation* simulation, double* variables);

/* All that it takes to continue bit for bit, as lm_state_size() numbers. */
LM_API size_t lm_state_size(const lm_simulation* simulation);
LM_API int lm_get_state(const lm_simulation* simulation, double* state);
LM_API int lm_set_state(lm_simulation* simulation, const double* state);

/* Derivatives in the present regime: of the rates of the states and of the variables, in the direction (states,
 * inputs). A direction or a result may be NULL. */
LM_API int lm_directional_derivative(lm_simulation* simulation, const double* states, const double* inputs,
                                     double* rates, double* variables);

/* --- in one go --- */

/* Straight lines, each from a time on: value and slope; and sines: amplitude, frequency [Hz], phase [rad]. */
typedef struct {
    const double* breakpoints; /* n_breakpoints x (time, value, slope) */
    size_t n_breakpoints;
    const double* sines; /* n_sines x (amplitude, frequency, phase) */
    size_t n_sines;
} lm_signal;

/* Runs to `duration` from these states and capacities. inputs: one signal each. variables: at k * interval for
 * k < samples, one variable after the other. The simulation itself is then at t = 0, at these states. */
LM_API int lm_run(lm_simulation* simulation, const lm_signal* inputs, const double* states, const double* capacities,
                  double duration, double interval, size_t samples, double* variables);

#ifdef __cplusplus
}
#endif

#endif
