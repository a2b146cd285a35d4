/* LinuxCNC's own genhexkins, called outside LinuxCNC: the functions of HAL that its installed module
 * needs, and a loop over kinematicsForward. The module's name is MODULE. */
#include <dlfcn.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

typedef struct { double x, y, z, a, b, c, u, v, w; } world_pose;
typedef int (*forward_function)(const double *, world_pose *, const unsigned long *, unsigned long *);

static forward_function forward;

int hal_init(const char *name) { (void)name; return 1; }
int hal_ready(int id) { (void)id; return 0; }
int hal_exit(int id) { (void)id; return 0; }
void *hal_malloc(long size) { return calloc(1, (size_t)size); }
void rtapi_print(const char *text, ...) { (void)text; }
void rtapi_print_msg(int level, const char *text, ...) { (void)level; (void)text; }

static int pin(void **data) { *data = calloc(1, sizeof(double)); return *data == NULL; }
int hal_pin_bit_new(const char *n, int d, void **data, int id) { (void)n; (void)d; (void)id; return pin(data); }
int hal_pin_s32_new(const char *n, int d, void **data, int id) { (void)n; (void)d; (void)id; return pin(data); }
int hal_pin_bit_newf(int d, void **data, int id, const char *f, ...) { (void)d; (void)id; (void)f; return pin(data); }
int hal_pin_float_newf(int d, void **data, int id, const char *f, ...) { (void)d; (void)id; (void)f; return pin(data); }
int hal_pin_u32_newf(int d, void **data, int id, const char *f, ...) { (void)d; (void)id; (void)f; return pin(data); }

/* 0 where the module is loaded; its pins then hold LinuxCNC's default hexapod. */
int genhex_load(void)
{
    void *module = dlopen(MODULE, RTLD_NOW | RTLD_GLOBAL);
    int (*start)(void);
    if (!module) return fprintf(stderr, "%s\n", dlerror());
    *(void **)&start = dlsym(module, "rtapi_app_main");
    *(void **)&forward = dlsym(module, "kinematicsForward");
    return !start || !forward || start() < 0;
}

/* Poses `world` (count, 6), which hold the guesses, from joints (count, 6), and return codes. */
void genhex_all(int count, const double *joints, double *world, int *codes)
{
    for (int n = 0; n < count; n++) {
        world_pose pose = {0};
        unsigned long flags = 0;
        memcpy(&pose, world + 6 * n, 6 * sizeof(double));
        codes[n] = forward(joints + 6 * n, &pose, &flags, &flags);
        memcpy(world + 6 * n, &pose, 6 * sizeof(double));
    }
}
