/* hexapod.h - where one hexapod is: poses from leg readings, in bounded time.
 *
@facts@
 *
 * C99, also C++. No allocation, no global state; needs sqrt, sin and cos, nothing else.
 *
@license@
 */
#ifndef HEXAPOD_H
#define HEXAPOD_H

#ifdef __cplusplus
extern "C" {
#endif

typedef @real@ hexapod_real;

/* No call takes more Newton and descent steps than this. */
#define HEXAPOD_MAX_STEPS @max_steps@

/* The numbers of gough.Status. A pose is good for use up to OUTSIDE_WORKSPACE. */
typedef enum {
@status@
} hexapod_status;

/* The numbers of gough.Event. */
typedef enum {
@event@
} hexapod_event;

/* Position of the pose [@unit@] and unit quaternion w, x, y, z. Platform coordinates p go to
 * R (p - c) + c + position in base coordinates; c is the platform's pivot, @pivot@. */
typedef struct {
    hexapod_real position[3];
    hexapod_real wxyz[4];
} hexapod_pose;

typedef struct {
    hexapod_real residual; /* largest strut error of the pose that was tried [@unit@] */
    int steps;             /* Newton and descent steps of the call */
} hexapod_info;

/* Readings of the six legs at a pose: @reading@.
 * Returns 0, or the number (1 to 6) of the first leg that cannot reach the pose; readings of such
 * a leg are left as they were. */
int hexapod_inverse(const hexapod_pose *pose, hexapod_real legs[6]);

/* The pose that has these readings, starting from the pose in `inout`; nothing is remembered.
 * On INVALID_INPUT, UNREACHABLE and NOT_CONVERGED the pose is left alone. `info` may be null.
 * As gough.solve(platform, legs, seed=pose, restarts=0), but a pose outside the workspace is
 * taken only if the damped search finds none inside, and a start that is no pose, or on the
 * other side of a singularity than home, is replaced by home where Newton's method fails. */
hexapod_status hexapod_solve(const hexapod_real legs[6], hexapod_pose *inout, hexapod_info *info);

/* All that a tracker remembers: plain data, to be copied and compared at will. */
typedef struct {
    hexapod_pose pose;     /* the present pose; held while no reading gives a new one */
    hexapod_status status; /* of the last reading */
    hexapod_event event;   /* of the last cycle */
    hexapod_info info;     /* of the last cycle */
    /* private from here on */
    hexapod_real at[7], side;
    hexapod_pose candidate;
    hexapod_real max_shift, max_turn;
    int confirm, lost, trusted, missed, agreeing, has_candidate, next_start;
} hexapod_tracker;

/* Prepare a tracker.
 * start:      where the machine is, or null: found from the first reading.
 * max_shift:  farthest motion in one cycle [@unit@]; 0: 2 % of the platform's size.
 * max_turn:   largest rotation in one cycle [rad]; 0: 0.1.
 * confirm:    readings in a row that must agree on a far place before it is taken; 0: 3. */
void hexapod_init(hexapod_tracker *tracker, const hexapod_pose *start, hexapod_real max_shift,
                  hexapod_real max_turn, int confirm);

/* Follow one reading: gough.Tracker.update in bounded time.
 * FOLLOWED: tracker->pose is new. FOUND: new, and far from the last one. HELD, JUMPED,
 * MODE_CHANGED: the last pose is held. One damped search a cycle: where it fails, the next cycle
 * goes on from another start, so that a lost machine is found within a few cycles. A pose outside
 * the workspace is taken only after all @starts@ starts were tried. */
hexapod_event hexapod_update(hexapod_tracker *tracker, const hexapod_real legs[6]);

/* d legs / d twist, row by row: J[6 * leg + column]. The twist is the velocity of the pose's
 * position, then the angular velocity, both in base coordinates. */
void hexapod_jacobian(const hexapod_pose *pose, hexapod_real J[36]);

/* The twist at a pose from the rates of the readings, [@unit@ / s] and [rad / s].
 * CONVERGED; NEAR_SINGULARITY, where the twist's last digits are uncertain; UNREACHABLE or
 * INVALID_INPUT, where the twist is left alone. */
hexapod_status hexapod_twist(const hexapod_pose *pose, const hexapod_real leg_rates[6],
                             hexapod_real twist[6]);

/* Whether a pose with this status may be used as the machine's. */
int hexapod_usable(hexapod_status status);

/* The words gough writes, such as "outside_stroke" and "followed". */
const char *hexapod_status_label(hexapod_status status);
const char *hexapod_event_label(hexapod_event event);

/* Version of gough that wrote this file; digest of the platform (gough: Platform.digest). */
const char *hexapod_version(void);
const char *hexapod_digest(void);

#ifdef __cplusplus
}
#endif
#endif
