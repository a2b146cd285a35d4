/* Readings that no machine gives: NaN, infinity, denormal, huge, zero, negative, and noise.
 *
 *     hostile COUNT
 *
 * Feeds them to the solver and the tracker of an exported machine (prefix `machine`), from good and
 * from hostile guesses, and counts poses called good that have not these readings by formulas of
 * its own. To be built with -fsanitize=address,undefined; exit code 1 if any pose was wrong. */
#include "machine.c"

#include <float.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>

static uint64_t state = 1;

static double uniform(void)
{
    state = state * 6364136223846793005u + 1442695040888963407u;
    return (double)(state >> 11) / 9007199254740992.0;
}

static real hostile(real usual)
{
    const double specials[] = {NAN, INFINITY, -INFINITY, 0.0, -0.0, DBL_MAX, -DBL_MAX, DBL_MIN,
                               4.9e-324, FLT_MAX, FLT_MIN, 1e-45, 1e300, 1e38, 1e19, 1e154};
    const double draw = uniform();
    if (draw < 0.05) return (real)specials[(int)(uniform() * 16)];
    if (draw < 0.10) return (real)((uniform() - 0.5) * pow(10, 640 * uniform() - 320));
    if (draw < 0.30) return usual * (real)(2 * uniform());
    return usual + (real)(0.1 * (uniform() - 0.5)) * (ROTARY ? 1 : SIZE);
}

/* Largest | |P_i - B_i| - l_i | / size at a pose, from the tables alone, in double. */
static double miss(const machine_pose *pose, const real legs[6])
{
    double worst = 0;
    const double w = pose->wxyz[0];
    for (int i = 0; i < 6; i++) {
        double square = 0, length, p[3], u[3], t[3];
        for (int k = 0; k < 3; k++) {
            u[k] = pose->wxyz[k + 1];
            p[k] = (double)PLATFORM_JOINTS[i][k] - PIVOT[k];
        }
        for (int k = 0; k < 3; k++) { /* v + 2 w (u x v) + 2 u x (u x v) */
            const int a = (k + 1) % 3, b = (k + 2) % 3;
            t[k] = 2 * (u[a] * p[b] - u[b] * p[a]);
        }
#if ROTARY
        length = ROD[i];
#else
        length = ((double)GAIN[i] * legs[LEG_ORDER[i]] + ZERO[i]) / SIZE;
#endif
        for (int k = 0; k < 3; k++) {
            const int a = (k + 1) % 3, b = (k + 2) % 3;
            double d = p[k] + w * t[k] + u[a] * t[b] - u[b] * t[a];
            d += ((double)pose->position[k] - ORIGIN[k]) / SIZE - BASE_JOINTS[i][k];
#if ROTARY
            const double q = (double)GAIN[i] * legs[LEG_ORDER[i]] + ZERO[i];
            d -= cos(q) * ARM_X[i][k] + sin(q) * ARM_Y[i][k];
#endif
            square += d * d;
        }
        if (!(fabs(sqrt(square) - length) <= worst)) worst = fabs(sqrt(square) - length);
    }
    return worst;
}

int main(int count, char **words)
{
    const long total = count > 1 ? atol(words[1]) : 1000000;
    long good = 0, wrong = 0, long_calls = 0;
    machine_pose home, guess;
    machine_tracker tracker;
    problem w;
    real usual[6], legs[6], rates[6], J[36];
    set_internal(&w, STARTS[0]);
    get_pose(&w, &home);
    reach(&w, usual, rates);
    machine_init(&tracker, &home, 0, 0, 0);
    for (long n = 0; n < total; n++) {
        const int mild = uniform() < 0.5;
        machine_info info;
        guess = home;
        for (int i = 0; i < 6; i++) {
            legs[i] = mild && uniform() < 0.9 ? usual[i] * (real)(1 + 0.01 * uniform())
                                              : hostile(usual[i]);
            if (!mild && uniform() < 0.2) guess.wxyz[i % 4] = hostile(guess.wxyz[i % 4]);
            if (!mild && uniform() < 0.2) guess.position[i % 3] = hostile(guess.position[i % 3]);
        }
        (void)machine_inverse(&guess, rates);
        machine_jacobian(&guess, J);
        (void)machine_twist(&guess, legs, rates);
        if (machine_usable(machine_solve(legs, &guess, &info))) {
            good++;
            wrong += !(miss(&guess, legs) <= 4 * TOLERANCE);
        }
        long_calls += info.steps > MACHINE_MAX_STEPS;
        if (uniform() < 0.001) machine_init(&tracker, uniform() < 0.5 ? &guess : 0, 0, 0, 0);
        (void)machine_update(&tracker, legs);
        if (tracker.event <= MACHINE_FOUND && machine_usable(tracker.status)) {
            good++;
            wrong += !(miss(&tracker.pose, legs) <= 4 * TOLERANCE);
        }
        long_calls += tracker.info.steps > MACHINE_MAX_STEPS;
    }
    printf("%ld readings, %ld poses called good, %ld of them wrong, %ld calls too long\n", total,
           good, wrong, long_calls);
    return wrong + long_calls > 0;
}
