/* A self-locking worm gear in C: the motor lowers a load of 20 N m, then stops, and the gear holds it.
 *
 *   cc -I<include> examples/worm.c -L<lib> -llostmotion -lm -o worm
 *
 * `make c-library` builds the library into build/c and prints this line with its places.
 */
#include <stdio.h>
#include <stdlib.h>

#include "lostmotion.h"

static void stop_if(int failed, const char* why) {
    if (!failed) return;
    fprintf(stderr, "%s\n", why);
    exit(1);
}

int main(void) {
    const char* const joined[] = {"worm", "drum"};
    const double one = 1.0, viscous = 1e-3, inertia = 0.5, rotor = 1e-4, ratio = 50.0, damping = 20.0;
    const double stiffness = 1e4, driving = 0.44, overrunning = -0.2;
    const lm_value worm[] = {{"viscous_friction", &viscous, 1}};
    const lm_value drum[] = {{"inertia", &inertia, 1}, {"loaded", &one, 1}};
    const lm_value motor[] = {{"kind", &one, 1}, {"rotor_inertia", &rotor, 1}, {"rated_torque", &one, 1}};
    const lm_value gear[] = {{"ratio", &ratio, 1},
                             {"stiffness.slopes", &stiffness, 1},
                             {"mesh_damping", &damping, 1},
                             {"efficiencies.driving", &driving, 1},
                             {"efficiencies.overrunning", &overrunning, 1}};
    double *state, *variables, *inputs;
    lm_simulation* s;
    size_t k, n;
    int step;

    lm_train* train = lm_train_new();
    stop_if(lm_add(train, "shafts", "worm", NULL, 0, worm, 1) || lm_add(train, "shafts", "drum", NULL, 0, drum, 2) ||
                lm_add(train, "motors", "motor", joined, 1, motor, 3) ||
                lm_add(train, "gears", "gear", joined, 2, gear, 5),
            lm_train_error(train));
    s = lm_simulation_new(train, 1e-3);
    stop_if(s == NULL, lm_train_error(train));
    lm_train_free(train);

    n = lm_count(s, LM_VARIABLES);
    variables = malloc(n * sizeof *variables);
    inputs = calloc(lm_count(s, LM_INPUTS), sizeof *inputs);
    state = malloc(lm_state_size(s) * sizeof *state);
    stop_if(variables == NULL || inputs == NULL || state == NULL, "no memory");
    for (step = 0; step < 2000; ++step) {
        for (k = 0; k < lm_count(s, LM_INPUTS); ++k)
            inputs[k] = lm_name(s, LM_INPUTS, k)[0] == 'm' ? (step < 1000 ? -0.15 : 0.0) : 20.0;
        stop_if(lm_advance(s, 1e-3, inputs, inputs), lm_error(s));
        if (step == 999) lm_get_state(s, state); /* to continue from here bit for bit: lm_set_state() */
    }
    stop_if(lm_read(s, variables), lm_error(s));
    printf("t = %g s\n", lm_time(s));
    for (k = 0; k < n; ++k)
        printf("%-24s %12.6g %s\n", lm_name(s, LM_VARIABLES, k), variables[k], lm_unit(s, LM_VARIABLES, k));
    free(variables);
    free(inputs);
    free(state);
    lm_simulation_free(s);
    return 0;
}
