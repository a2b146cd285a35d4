/* hexapod_test.c - compares hexapod.c with what gough's Python tracker made of the same readings.
 *
@facts@
 *
@license@
 */
#include "hexapod.h"

#include <math.h>
#include <stdio.h>

#define NOT_A_NUMBER ((hexapod_real)NAN)
#define INFINITE ((hexapod_real)INFINITY)

enum { POSES = @pose_count@, CYCLES = @cycle_count@ };

static const double SIZE = @size_double@;       /* of the platform [@unit@] */
static const double ALLOWED = @allowed@; /* error of a pose: share of the size, and [rad] */

typedef struct {
    hexapod_real legs[6];
    int status;
    hexapod_pose guess, pose;
    hexapod_real rates[6], twist[6];
} pose_row;

typedef struct {
    hexapod_real legs[6];
    int event, status;
    hexapod_pose pose;
} cycle_row;

static const pose_row poses[POSES] = {
@pose_rows@
};

static const cycle_row cycles[CYCLES] = {
@cycle_rows@
};

static int failures = 0;

static void check(int good, const char *what, int row)
{
    if (!good) {
        printf("row %d: %s\n", row, what);
        failures++;
    }
}

/* Distance of the positions as a share of the size, or of the rotations [rad], if larger. */
static double pose_error(const hexapod_pose *a, const hexapod_pose *b)
{
    double shift = 0, plus = 0, minus = 0, turn;
    for (int k = 0; k < 3; k++) {
        const double d = ((double)a->position[k] - (double)b->position[k]) / SIZE;
        shift += d * d;
    }
    for (int k = 0; k < 4; k++) {
        const double p = (double)a->wxyz[k] + (double)b->wxyz[k];
        const double m = (double)a->wxyz[k] - (double)b->wxyz[k];
        plus += p * p;
        minus += m * m;
    }
    turn = 2 * sqrt(plus < minus ? plus : minus);
    shift = sqrt(shift);
    return shift > turn ? shift : turn;
}

static void check_pose(int row)
{
    const pose_row *expected = &poses[row];
    hexapod_pose pose = expected->guess;
    hexapod_real legs[6], twist[6], J[36];
    hexapod_info info;
    const hexapod_status status = hexapod_solve(expected->legs, &pose, &info);
    check((int)status == expected->status, "solve: another status", row);
    check(pose_error(&pose, &expected->pose) <= ALLOWED, "solve: another pose", row);
    check(info.steps <= HEXAPOD_MAX_STEPS, "solve: too many steps", row);

    check(hexapod_inverse(&expected->pose, legs) == 0, "inverse: out of reach", row);
    (void)hexapod_twist(&expected->pose, expected->rates, twist);
    hexapod_jacobian(&expected->pose, J);
    for (int i = 0; i < 6; i++) {
        double rate = 0, scale = 0;
        const double unit = i < 3 ? SIZE : 1;
        for (int k = 0; k < 6; k++) {
            const double part = (double)J[6 * i + k] * (double)expected->twist[k];
            rate += part;
            scale += fabs(part);
        }
        check(fabs((double)legs[i] - (double)expected->legs[i]) <= ALLOWED * @reading_unit@,
              "inverse: another reading", row);
        check(fabs(rate - (double)expected->rates[i]) <= 4 * ALLOWED * scale,
              "jacobian: another rate", row);
        check(fabs((double)twist[i] - (double)expected->twist[i]) <= 4 * ALLOWED * unit,
              "twist: another twist", row);
    }
}

static void check_cycles(void)
{
    hexapod_tracker tracker;
    hexapod_init(&tracker, 0, @max_shift@, @max_turn@, 0);
    for (int row = 0; row < CYCLES; row++) {
        const cycle_row *expected = &cycles[row];
        const hexapod_event event = hexapod_update(&tracker, expected->legs);
        check((int)event == expected->event, "update: another event", row);
        check((int)tracker.status == expected->status, "update: another status", row);
        check(pose_error(&tracker.pose, &expected->pose) <= ALLOWED, "update: another pose", row);
        check(tracker.info.steps <= HEXAPOD_MAX_STEPS, "update: too many steps", row);
    }
}

int main(void)
{
    for (int row = 0; row < POSES; row++) check_pose(row);
    check_cycles();
    printf("%s, gough %s: %d poses and %d cycles, %d failures\n", "@platform@", hexapod_version(),
           (int)POSES, (int)CYCLES, failures);
    return failures > 0;
}
