/* What programs that call an FMU of FMI 2.0 give it, and how they end where it fails. */
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>

typedef struct {
    void (*log)(void*, const char*, int, const char*, const char*, ...);
    void* (*allocate)(size_t, size_t);
    void (*release)(void*);
    void (*step_finished)(void*, int);
    void* environment;
} Callbacks;

static void say(void* environment, const char* name, int status, const char* category, const char* message, ...) {
    (void)environment, (void)name, (void)status, (void)category;
    fprintf(stderr, "%s\n", message);
}
static void check(int well, const char* what) {
    if (well) return;
    fprintf(stderr, "%s failed\n", what);
    exit(1);
}
