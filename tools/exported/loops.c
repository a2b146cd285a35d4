/* Many calls of an exported machine (prefix `machine`) at once, for tests and the benchmark. */
#define _POSIX_C_SOURCE 199309L
#include "machine.h"

#include <string.h>
#include <time.h>

/* What a cycle left in the tracker. */
typedef struct {
    machine_pose pose;
    machine_real residual;
    int event, status, steps, next_start;
} cycle_result;

static machine_tracker tracker_from(const machine_pose *start, const machine_real limits[2],
                                    int confirm)
{
    machine_tracker tracker;
    machine_init(&tracker, start, limits[0], limits[1], confirm);
    return tracker;
}

static double now(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return 1e9 * (double)t.tv_sec + (double)t.tv_nsec;
}

void track_all(int count, const machine_real *legs, const machine_pose *start,
               const machine_real limits[2], int confirm, cycle_result *results)
{
    machine_tracker tracker = tracker_from(start, limits, confirm);
    for (int n = 0; n < count; n++) {
        cycle_result *result = results + n;
        result->event = (int)machine_update(&tracker, legs + 6 * n);
        result->status = (int)tracker.status;
        result->pose = tracker.pose;
        result->residual = tracker.info.residual;
        result->steps = tracker.info.steps;
        result->next_start = tracker.next_start;
    }
}

void solve_all(int count, const machine_real *legs, const machine_pose *guesses, int guess_count,
               cycle_result *results)
{
    for (int n = 0; n < count; n++) {
        cycle_result *result = results + n;
        machine_info info;
        result->pose = guesses[n % guess_count];
        result->status = (int)machine_solve(legs + 6 * n, &result->pose, &info);
        result->event = result->next_start = 0;
        result->residual = info.residual;
        result->steps = info.steps;
    }
}

/* Shortest time of each cycle [ns] out of `repeats`, the clock's own time taken off. */
void time_cycles(int count, int repeats, const machine_real *legs, const machine_pose *start,
                 const machine_real limits[2], int confirm, double *nanoseconds)
{
    machine_tracker tracker = tracker_from(start, limits, confirm);
    double clock = 1e9;
    for (int k = 0; k < 1000; k++) {
        const double begin = now(), taken = now() - begin;
        if (taken < clock) clock = taken;
    }
    for (int n = 0; n < count; n++) {
        machine_tracker next = tracker;
        double best = 1e18;
        for (int k = 0; k < repeats; k++) {
            double begin, taken;
            next = tracker;
            begin = now();
            machine_update(&next, legs + 6 * n);
            taken = now() - begin - clock;
            if (taken < best) best = taken;
        }
        tracker = next;
        nanoseconds[n] = best;
    }
}
