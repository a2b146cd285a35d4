/* The few types and macros of LinuxCNC that an exported .comp uses, so that it can be called where
 * LinuxCNC is not installed. KINS names the file: what follows ";;" in the .comp. */
#include <math.h>

typedef struct { double x, y, z; } PmCartesian;
typedef struct EmcPose { PmCartesian tran; double a, b, c, u, v, w; } EmcPose;
typedef unsigned long KINEMATICS_FORWARD_FLAGS, KINEMATICS_INVERSE_FLAGS;
typedef enum { KINEMATICS_IDENTITY = 1, KINEMATICS_BOTH = 4 } KINEMATICS_TYPE;
#define EXPORT_SYMBOL(name) extern int exported_##name
#define KINS_NOT_SWITCHABLE extern int switchable;

static struct pins {
    unsigned *last_iterations, *max_iterations, *status;
    int *fwd_kins_fail;
    double *residual, *tool_offset, *spindle_offset;
} *__comp_first_inst;

#include KINS

static unsigned last, most, code;
static int failed;
static double missed, tool, spindle;
static struct pins pins = {&last, &most, &code, &failed, &missed, &tool, &spindle};

/* Forward from joints and guess `world`, in place; `pins_out`: last and most steps, status, fail. */
int stub_forward(const double joints[6], double world[6], double offset, double pins_out[5])
{
    EmcPose pose = {{world[0], world[1], world[2]}, world[3], world[4], world[5], 0, 0, 0};
    int found;
    __comp_first_inst = &pins;
    tool = offset;
    found = kinematicsForward(joints, &pose, 0, 0);
    world[0] = pose.tran.x, world[1] = pose.tran.y, world[2] = pose.tran.z;
    world[3] = pose.a, world[4] = pose.b, world[5] = pose.c;
    pins_out[0] = last, pins_out[1] = most, pins_out[2] = code, pins_out[3] = failed;
    pins_out[4] = missed;
    return found;
}

int stub_inverse(const double world[6], double joints[6], double offset)
{
    EmcPose pose = {{world[0], world[1], world[2]}, world[3], world[4], world[5], 0, 0, 0};
    __comp_first_inst = &pins;
    tool = offset;
    return kinematicsInverse(&pose, joints, 0, 0);
}
