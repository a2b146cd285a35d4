component hexapodkins "Kinematics of @platform@, written by gough @version@";

description """
Forward and inverse kinematics of one hexapod, with pins as genhexkins has them.

Platform @platform@, digest @digest@.
Joints are @joints@ in the order of the platform file's legs; positions are in @unit@, the tool's
rotation in LinuxCNC's roll, pitch and yaw [deg].

Needs [TRAJ]LINEAR_UNITS = @unit@, [KINS]KINEMATICS = hexapodkins and JOINTS = 6, coordinates XYZABC.
""";

pin out unsigned last_iterations "Steps of the last forward kinematics";
pin out unsigned max_iterations "Most steps that a call took so far; never above @max_steps@";
pin out float residual "Largest strut error of the last pose that was tried [@unit@]";
pin out unsigned status "Number of gough.Status of the last call; 0 to 3: the pose is good";
pin out bit fwd_kins_fail "The last call found no pose that may be used: the pose was left as it was";
pin in float tool_offset "Tool length, as motion.tooloffset.z gives it [@unit@]";
pin in float spindle_offset "Added to the z of all joints, as genhexkins has it [@unit@]";

option singleton yes;
license "MIT-0";
author "gough @version@";
;;

@license_comment@

#include <rtapi_math.h>
#include <kinematics.h>

/* halcompile makes macros of the pins' names; here they are reached by PIN(name). */
#undef last_iterations
#undef max_iterations
#undef residual
#undef status
#undef fwd_kins_fail
#undef tool_offset
#undef spindle_offset
#define PIN(name) (*__comp_first_inst->name)

@source@

/* ---- LinuxCNC ---------------------------------------------------------------------------------
 * Roll, pitch and yaw turn about the fixed x, y and z axes: R = Rz(c) Ry(b) Rx(a). */

#define DEGREE (PI / 180) /* [rad] */
#define JOINT_UNIT @joint_unit@

/* Quaternion of roll, pitch, yaw [deg]. */
static void from_rpy(const EmcPose *world, real q[4])
{
    const real a = world->a * DEGREE / 2, b = world->b * DEGREE / 2, c = world->c * DEGREE / 2;
    const real ca = COS(a), cb = COS(b), cc = COS(c), sa = SIN(a), sb = SIN(b), sc = SIN(c);
    q[0] = ca * cb * cc + sa * sb * sc;
    q[1] = sa * cb * cc - ca * sb * sc;
    q[2] = ca * sb * cc + sa * cb * sc;
    q[3] = ca * cb * sc - sa * sb * cc;
}

/* The one of angle + 360 k that is nearest to `last` [deg]. */
static real nearest_turn(real angle, real last)
{
    return angle + 360 * floor((last - angle) / 360 + R(0.5));
}

/* Roll, pitch, yaw [deg] of a quaternion, going on from those that `world` has. At a pitch of
 * +-90 deg only the sum or the difference of roll and yaw is determined; yaw stays there. */
static void to_rpy(const real q[4], EmcPose *world)
{
    real rot[9], a, b, c, flat;
    rotation(q, rot);
    flat = SQRT(rot[0] * rot[0] + rot[3] * rot[3]);
    b = atan2(-rot[6], flat);
    if (flat > R(1e-9)) {
        a = atan2(rot[7], rot[8]);
        c = atan2(rot[3], rot[0]);
    } else {
        c = world->c * DEGREE;
        a = atan2(SIN(c) * rot[2] - COS(c) * rot[5], COS(c) * rot[4] - SIN(c) * rot[1]);
    }
    world->a = nearest_turn(a / DEGREE, world->a);
    world->b = b / DEGREE;
    world->c = nearest_turn(c / DEGREE, world->c);
}

/* Where tool and spindle offset move the controlled point, o (z - R z), as in genhexkins: both
 * ends of every strut move by o along z, of the base and of the platform. */
static void offset(const real q[4], real out[3])
{
    const real o = PIN(tool_offset) + PIN(spindle_offset);
    real rot[9];
    rotation(q, rot);
    out[0] = -o * rot[2];
    out[1] = -o * rot[5];
    out[2] = o * (1 - rot[8]);
}

static void from_world(const EmcPose *world, hexapod_pose *pose)
{
    real moved[3];
    from_rpy(world, pose->wxyz);
    offset(pose->wxyz, moved);
    pose->position[0] = world->tran.x - moved[0];
    pose->position[1] = world->tran.y - moved[1];
    pose->position[2] = world->tran.z - moved[2];
}

static void to_world(const hexapod_pose *pose, EmcPose *world)
{
    real moved[3];
    to_rpy(pose->wxyz, world);
    offset(pose->wxyz, moved);
    world->tran.x = pose->position[0] + moved[0];
    world->tran.y = pose->position[1] + moved[1];
    world->tran.z = pose->position[2] + moved[2];
}

/* LinuxCNC calls this for feedback and for commands, in any order: nothing is remembered, and
 * `world` holds the guess. */
int kinematicsForward(const double *joints, EmcPose *world, const KINEMATICS_FORWARD_FLAGS *fflags,
                      KINEMATICS_INVERSE_FLAGS *iflags)
{
    real legs[6];
    hexapod_pose pose;
    hexapod_info info;
    hexapod_status found;
    (void)fflags;
    (void)iflags;
    for (int i = 0; i < 6; i++) legs[i] = joints[i] * JOINT_UNIT;
    from_world(world, &pose);
    found = hexapod_solve(legs, &pose, &info);
    PIN(status) = (unsigned)found;
    PIN(residual) = info.residual;
    PIN(last_iterations) = (unsigned)info.steps;
    PIN(fwd_kins_fail) = !hexapod_usable(found);
    if (PIN(fwd_kins_fail)) return -1;
    if (PIN(last_iterations) > PIN(max_iterations)) PIN(max_iterations) = PIN(last_iterations);
    to_world(&pose, world);
    return 0;
}

int kinematicsInverse(const EmcPose *world, double *joints, const KINEMATICS_INVERSE_FLAGS *iflags,
                      KINEMATICS_FORWARD_FLAGS *fflags)
{
    real legs[6];
    hexapod_pose pose;
    (void)iflags;
    (void)fflags;
    from_world(world, &pose);
    if (hexapod_inverse(&pose, legs)) return -1;
    for (int i = 0; i < 6; i++) joints[i] = legs[i] / JOINT_UNIT;
    return 0;
}

KINEMATICS_TYPE kinematicsType(void)
{
    return KINEMATICS_BOTH;
}

KINS_NOT_SWITCHABLE
EXPORT_SYMBOL(kinematicsType);
EXPORT_SYMBOL(kinematicsForward);
EXPORT_SYMBOL(kinematicsInverse);
