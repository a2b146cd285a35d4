/* hexapod.c - where one hexapod is: poses from leg readings, in bounded time. See hexapod.h.
 *
@facts@
 *
@license@
 */
#include "hexapod.h"

#include <math.h>
#include <string.h>

#if defined(__FINITE_MATH_ONLY__) && __FINITE_MATH_ONLY__ > 0
#error "hexapod.c finds bad readings by NaN and infinity: compile it without -ffast-math"
#endif

/* ---- the platform --------------------------------------------------------------------------
 * Lengths are divided by the platform's size. Legs are in solving order: in this order the
 * elimination in newton_step needs no pivoting at home. Platform joints are seen from their
 * centre, base joints from theirs. */

typedef hexapod_real real;

@constants@

/* ---- a pose in the making ------------------------------------------------------------------ */

typedef struct {
    real s[3], q[4];   /* centre of the platform joints from that of the base joints; w, x, y, z */
    real base[6][3];   /* where the struts of the reading start */
    real length[6];    /* and how long they are */
    real determinant;  /* of the matrix with rows (d_i, a_i x d_i), at the last step's start */
    real step;         /* squared size of the last Newton step */
    real residual;     /* largest strut error */
    int inside;        /* OUTSIDE or INSIDE the workspace, or MIRRORED: there with the other sign */
    int regular;       /* surely farther from a singularity than SINGULAR */
} problem;

enum { SOLVED, STATIONARY, UNFINISHED };
enum { OUTSIDE, MIRRORED, INSIDE };

static int is_finite(real x)
{
    return x - x == 0;
}

static real dot(const real a[3], const real b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static void cross(const real a[3], const real b[3], real out[3])
{
    out[0] = a[1] * b[2] - a[2] * b[1];
    out[1] = a[2] * b[0] - a[0] * b[2];
    out[2] = a[0] * b[1] - a[1] * b[0];
}

/* Rotation matrix of a unit quaternion, row by row. */
static void rotation(const real q[4], real rot[9])
{
    const real w = q[0], x = q[1], y = q[2], z = q[3];
    rot[0] = 1 - 2 * (y * y + z * z);
    rot[1] = 2 * (x * y - w * z);
    rot[2] = 2 * (x * z + w * y);
    rot[3] = 2 * (x * y + w * z);
    rot[4] = 1 - 2 * (x * x + z * z);
    rot[5] = 2 * (y * z - w * x);
    rot[6] = 2 * (x * z - w * y);
    rot[7] = 2 * (y * z + w * x);
    rot[8] = 1 - 2 * (x * x + y * y);
}

static void rotated(const real rot[9], const real v[3], real out[3])
{
    out[0] = dot(rot, v);
    out[1] = dot(rot + 3, v);
    out[2] = dot(rot + 6, v);
}

/* From the platform joints' centre to the pivot, in base coordinates. */
static void lever(const real q[4], real out[3])
{
    real rot[9];
    rotation(q, rot);
    rotated(rot, PIVOT, out);
}

/* ---- readings and poses, in and out (gough: kernel/pose_io.py) ----------------------------- */

/* The struts that a reading stands for; 0 where it is not finite or a length not above zero. */
static int take_reading(problem *w, const real legs[6])
{
    int valid = 1;
    for (int i = 0; i < 6; i++) {
        const real value = GAIN[i] * legs[LEG_ORDER[i]] + ZERO[i]; /* a length, or an angle */
#if ROTARY
        const real c = COS(value), s = SIN(value);
        valid &= is_finite(value);
        w->length[i] = ROD[i];
        for (int k = 0; k < 3; k++)
            w->base[i][k] = BASE_JOINTS[i][k] + (c * ARM_X[i][k] + s * ARM_Y[i][k]);
#else
        w->length[i] = value * PER_SIZE;
        valid &= is_finite(w->length[i]) && w->length[i] > 0;
        for (int k = 0; k < 3; k++) w->base[i][k] = BASE_JOINTS[i][k];
#endif
    }
    return valid;
}

static int in_stroke(const real legs[6])
{
    int within = 1;
    for (int i = 0; i < 6; i++) within &= legs[i] >= STROKE[i][0] && legs[i] <= STROKE[i][1];
    return within;
}

static void set_internal(problem *w, const real at[7])
{
    memcpy(w->s, at, sizeof w->s);
    memcpy(w->q, at + 3, sizeof w->q);
}

static void get_internal(const problem *w, real at[7])
{
    memcpy(at, w->s, sizeof w->s);
    memcpy(at + 3, w->q, sizeof w->q);
}

static void put_quaternion(problem *w, real qw, real x, real y, real z)
{
    const real inverse = 1 / SQRT(qw * qw + x * x + y * y + z * z);
    w->q[0] = qw * inverse;
    w->q[1] = x * inverse;
    w->q[2] = y * inverse;
    w->q[3] = z * inverse;
}

/* A pose of the user's; 0 where it is none. */
static int set_pose(problem *w, const hexapod_pose *pose)
{
    real square = 0, arm[3];
    for (int k = 0; k < 4; k++) square += pose->wxyz[k] * pose->wxyz[k];
    if (!(square > R(1e-12) && square < R(1e12))) return 0;
    put_quaternion(w, pose->wxyz[0], pose->wxyz[1], pose->wxyz[2], pose->wxyz[3]);
    lever(w->q, arm);
    for (int k = 0; k < 3; k++) w->s[k] = (pose->position[k] - ORIGIN[k]) * PER_SIZE - arm[k];
    return is_finite(w->s[0] + w->s[1] + w->s[2]);
}

static void get_pose(const problem *w, hexapod_pose *pose)
{
    real arm[3];
    lever(w->q, arm);
    for (int k = 0; k < 3; k++) pose->position[k] = SIZE * (w->s[k] + arm[k]) + ORIGIN[k];
    memcpy(pose->wxyz, w->q, sizeof pose->wxyz);
}

/* ---- Newton's method (gough: kernel/equations.py) ------------------------------------------ */

/* Strut i: a = R q_i, the platform joint from the joints' centre, and d = a + s - b. */
static void strut(const problem *w, const real rot[9], int i, real a[3], real d[3])
{
    rotated(rot, PLATFORM_JOINTS[i], a);
    for (int k = 0; k < 3; k++) d[k] = a[k] + (w->s[k] - w->base[i][k]);
}

/* Step by a translation v[0..2] and a rotation v[3..5] in base coordinates. */
static void move(problem *w, const real v[6])
{
    const real a = R(0.5) * v[3], b = R(0.5) * v[4], c = R(0.5) * v[5];
    const real qw = w->q[0], x = w->q[1], y = w->q[2], z = w->q[3];
    const real nw = qw - a * x - b * y - c * z, nx = x + a * qw + b * z - c * y;
    const real ny = y + b * qw + c * x - a * z, nz = z + c * qw + a * y - b * x;
    for (int k = 0; k < 3; k++) w->s[k] += v[k];
    put_quaternion(w, nw, nx, ny, nz);
}

/* Solve d_i . v + (a_i x d_i) . w = (l_i^2 - d_i . d_i) / 2 without pivoting, and step. */
static void newton_step(problem *w)
{
    real rot[9], m[6][7], inverse[6], x[6], determinant = 1;
    rotation(w->q, rot);
    for (int i = 0; i < 6; i++) {
        real a[3];
        strut(w, rot, i, a, m[i]);
        cross(a, m[i], m[i] + 3);
        m[i][6] = R(0.5) * (w->length[i] * w->length[i] - dot(m[i], m[i]));
    }
    for (int p = 0; p < 6; p++) {
        inverse[p] = 1 / m[p][p];
        determinant *= m[p][p];
        for (int r = p + 1; r < 6; r++) {
            const real factor = m[r][p] * inverse[p];
            for (int c = p + 1; c < 7; c++) m[r][c] -= factor * m[p][c];
        }
    }
    for (int p = 5; p >= 0; p--) {
        x[p] = m[p][6];
        for (int c = p + 1; c < 6; c++) x[p] -= m[p][c] * x[c];
        x[p] *= inverse[p];
    }
    move(w, x);
    w->determinant = determinant;
    w->step = dot(x, x) + dot(x + 3, x + 3);
}

/* Whether the rotation from home, H' R, is in the workspace: for each Euler angle the cosine along
 * the middle of its range, and that of half its width (gough: R = Rx Ry Rz). */
static int turned_within(const real rot[9])
{
    const real x[3] = {rot[0], rot[3], rot[6]}, y[3] = {rot[1], rot[4], rot[7]};
    const real z[3] = {rot[2], rot[5], rot[8]};
    real turned[3], sine[3], cosine[3];
    int inside = 1;
    rotated(HOME_INVERSE, z, turned);
    sine[0] = -turned[1];
    cosine[0] = turned[2];
    sine[1] = turned[0];
    cosine[1] = SQRT(turned[1] * turned[1] + turned[2] * turned[2]);
    sine[2] = -dot(HOME_INVERSE, y);
    cosine[2] = dot(HOME_INVERSE, x);
    for (int k = 0; k < 3; k++) {
        const real along = cosine[k] * TURN_RANGE[k][0] + sine[k] * TURN_RANGE[k][1];
        const real all = SQRT(sine[k] * sine[k] + cosine[k] * cosine[k]);
        inside &= along >= TURN_RANGE[k][2] * all;
    }
    return inside;
}

/* Residual of the pose; whether it is in the workspace, and surely regular. */
static void assess(problem *w)
{
    real rot[9], arm[3], product = RADIUS * RADIUS * RADIUS;
    int bad = 0, within = 1;
    rotation(w->q, rot);
    w->residual = 0;
    for (int i = 0; i < 6; i++) {
        real a[3], d[3], miss;
        strut(w, rot, i, a, d);
        miss = FABS(SQRT(dot(d, d)) - w->length[i]);
        if (miss > w->residual) w->residual = miss;
        bad |= !is_finite(miss);
        product *= w->length[i];
    }
    if (bad) w->residual = INFINITE;
    w->regular = FABS(w->determinant) > ENOUGH * product;
    rotated(rot, PIVOT, arm);
    for (int k = 0; k < 3; k++) {
        const real shift = w->s[k] + arm[k] - HOME_SHIFT[k];
        within &= shift >= SHIFT_LOW[k] && shift <= SHIFT_HIGH[k];
    }
    w->inside = w->determinant * HOME_SIGN >= 0 ? INSIDE : MIRRORED;
    if (!(within & turned_within(rot))) w->inside = OUTSIDE;
}

/* Newton's method from where w is; whether it ends at a pose with these lengths.
 * `side` is the sign of the determinant at the start. */
static int follow(problem *w, int *steps, real *side)
{
    for (int n = 0; n < NEWTON_STEPS; n++) {
        newton_step(w);
        ++*steps;
        if (n == 0) *side = w->determinant;
        if (w->step > SMALL_STEP && n < NEWTON_STEPS - 1) continue;
        assess(w);
        if (w->residual <= TOLERANCE) return 1;
        if (!is_finite(w->step)) return 0;
    }
    return 0;
}

/* ---- damped least squares (gough: kernel/descent.py, kernel/linear.py) --------------------- */

/* J, rows (n_i, a_i x n_i / RADIUS), and the strut errors r; the sum of squares of r. */
static real strut_errors(const problem *w, real J[36], real r[6])
{
    real rot[9], cost = 0;
    rotation(w->q, rot);
    for (int i = 0; i < 6; i++) {
        real a[3], *row = J + 6 * i, length;
        strut(w, rot, i, a, row);
        length = SQRT(dot(row, row));
        for (int k = 0; k < 3; k++) row[k] /= length > TINY ? length : TINY;
        cross(a, row, row + 3);
        for (int k = 3; k < 6; k++) row[k] /= RADIUS;
        r[i] = length - w->length[i];
        cost += r[i] * r[i];
    }
    return cost;
}

static void swap(real *a, real *b)
{
    const real keep = *a;
    *a = *b;
    *b = keep;
}

/* Solve A x = r by elimination with complete pivoting, in place; the determinant of A, or 0 with x
 * not filled. */
static real eliminate(real A[36], const real r[6], real x[6])
{
    real right[6], determinant = 1;
    int columns[6] = {0, 1, 2, 3, 4, 5};
    memcpy(right, r, sizeof right);
    for (int p = 0; p < 6; p++) {
        real best = 0;
        int row = p, column = p;
        for (int i = p; i < 6; i++) {
            for (int j = p; j < 6; j++) {
                if (FABS(A[6 * i + j]) > best) {
                    best = FABS(A[6 * i + j]);
                    row = i;
                    column = j;
                }
            }
        }
        if (!(best > 0)) return 0;
        if (row != p) {
            for (int j = 0; j < 6; j++) swap(A + 6 * p + j, A + 6 * row + j);
            swap(right + p, right + row);
            determinant = -determinant;
        }
        if (column != p) {
            const int kept = columns[p];
            for (int i = 0; i < 6; i++) swap(A + 6 * i + p, A + 6 * i + column);
            columns[p] = columns[column];
            columns[column] = kept;
            determinant = -determinant;
        }
        determinant *= A[7 * p];
        for (int i = p + 1; i < 6; i++) {
            const real factor = A[6 * i + p] / A[7 * p];
            for (int j = p + 1; j < 6; j++) A[6 * i + j] -= factor * A[6 * p + j];
            right[i] -= factor * right[p];
        }
    }
    for (int p = 5; p >= 0; p--) {
        for (int j = p + 1; j < 6; j++) right[p] -= A[6 * p + j] * right[j];
        right[p] /= A[7 * p];
        x[columns[p]] = right[p];
    }
    return determinant;
}

/* J x = r. */
static real solve_plain(const real J[36], const real r[6], real A[36], real x[6])
{
    memcpy(A, J, 36 * sizeof *A);
    return eliminate(A, r, x);
}

static real largest(const real r[6])
{
    real most = 0;
    for (int i = 0; i < 6; i++) {
        if (FABS(r[i]) > most) most = FABS(r[i]);
    }
    return most;
}

/* (J' J + damping I) x = J' r; the largest entry of |J' r|. */
static real solve_damped(const real J[36], const real r[6], real damping, real A[36], real x[6])
{
    real right[6];
    for (int i = 0; i < 6; i++) {
        for (int j = 0; j < 6; j++) {
            real total = i == j ? damping : 0;
            for (int k = 0; k < 36; k += 6) total += J[k + i] * J[k + j];
            A[6 * i + j] = total;
        }
        right[i] = 0;
        for (int k = 0; k < 6; k++) right[i] += J[6 * k + i] * r[k];
    }
    (void)eliminate(A, right, x);
    return largest(right);
}

/* Rotations into radians, and the whole step, downhill, shortened if it goes too far. */
static void limit(real step[6])
{
    real excess = 1, shift, turn;
    for (int k = 3; k < 6; k++) step[k] /= RADIUS;
    shift = dot(step, step) / (LONGEST_SHIFT * LONGEST_SHIFT);
    turn = dot(step + 3, step + 3) / (LARGEST_TURN * LARGEST_TURN);
    if (shift > excess) excess = shift;
    if (turn > excess) excess = turn;
    excess = -SQRT(excess);
    for (int k = 0; k < 6; k++) step[k] /= excess;
}

/* Levenberg-Marquardt from where w is: SOLVED, STATIONARY or UNFINISHED. */
static int descend(problem *w, int *steps)
{
    real first[36], second[36], *J = first, *A = second, r[6], tried[6], step[6], at[7];
    real damping = R(1e-3), cost = strut_errors(w, J, r), trial;
    int outcome = UNFINISHED;
    for (int n = 0; n < DESCENT_STEPS; n++) {
        const real damped = damping > NEGLIGIBLE ? damping : NEGLIGIBLE;
        if (largest(r) <= R(0.1) * TOLERANCE) break;
        if (damping >= NEGLIGIBLE || solve_plain(J, r, A, step) == 0) {
            const real gradient = solve_damped(J, r, damped, A, step);
            /* near a singular pose error ~ x^2, gradient ~ x error: no miss, though flat */
            if (gradient * gradient <= FLAT * FLAT * cost * SQRT(cost)) {
                outcome = STATIONARY;
                break;
            }
        }
        limit(step);
        get_internal(w, at);
        move(w, step);
        ++*steps;
        trial = strut_errors(w, A, tried);
        if (trial < cost) {
            real *keep = J;
            J = A;
            A = keep;
            memcpy(r, tried, sizeof r);
            cost = trial;
            damping *= R(0.1);
            continue;
        }
        set_internal(w, at);
        damping = damped * 10;
        if (damping > HOPELESS || largest(r) <= TOLERANCE) {
            outcome = STATIONARY;
            break;
        }
    }
    w->determinant = solve_plain(J, r, A, step) * RADIUS * RADIUS * RADIUS;
    for (int i = 0; i < 6; i++) w->determinant *= w->length[i];
    assess(w);
    return w->residual <= TOLERANCE ? SOLVED : outcome;
}

/* Squared smallest singular value of the matrix with rows (n_i, a_i x n_i / RADIUS), by rotating its
 * columns until they are at right angles (Hestenes 1958). */
static real squared_singularity_distance(const problem *w)
{
    real J[36], r[6], smallest = INFINITE;
    strut_errors(w, J, r);
    for (int sweep = 0; sweep < SWEEPS; sweep++) {
        for (int p = 0; p < 6; p++) {
            for (int q = p + 1; q < 6; q++) {
                real pp = 0, qq = 0, pq = 0, zeta, t, c;
                for (int k = 0; k < 36; k += 6) {
                    pp += J[k + p] * J[k + p];
                    qq += J[k + q] * J[k + q];
                    pq += J[k + p] * J[k + q];
                }
                if (pq == 0) continue;
                zeta = (qq - pp) / (2 * pq);
                t = 1 / (FABS(zeta) + SQRT(1 + zeta * zeta));
                if (zeta < 0) t = -t;
                c = 1 / SQRT(1 + t * t);
                for (int k = 0; k < 36; k += 6) {
                    const real left = J[k + p], right = J[k + q];
                    J[k + p] = c * (left - t * right);
                    J[k + q] = c * (right + t * left);
                }
            }
        }
    }
    for (int p = 0; p < 6; p++) {
        real square = 0;
        for (int k = 0; k < 36; k += 6) square += J[k + p] * J[k + p];
        if (square < smallest) smallest = square;
    }
    return smallest;
}

static int near_singularity(const problem *w)
{
    return squared_singularity_distance(w) < SINGULAR * SINGULAR;
}

/* ---- inverse kinematics (gough: kinematics.py) --------------------------------------------- */

#if ROTARY
/* The angle of a unit vector, by Newton's method on sin(q - angle) = 0 from a straight line. */
static real angle_of(real cosine, real sine)
{
    real q = R(0.5) * PI * FABS(sine) / (FABS(sine) + FABS(cosine));
    if (cosine < 0) q = PI - q;
    if (sine < 0) q = -q;
    for (int n = 0; n < 3; n++) q += sine * COS(q) - cosine * SIN(q);
    return q;
}
#endif

/* The struts and readings at the pose in w; strut i lengthens, in the direction it has, by
 * rates[i] times the rate of its reading. Returns the first leg that cannot reach, or 0. */
static int reach(problem *w, real legs[6], real rates[6])
{
    real rot[9];
    int missing = 0;
    rotation(w->q, rot);
    for (int i = 0; i < 6; i++) {
        const int leg = LEG_ORDER[i];
        real a[3], d[3];
        int reached;
        memcpy(w->base[i], BASE_JOINTS[i], sizeof w->base[i]);
        strut(w, rot, i, a, d);
#if ROTARY
        const real x = dot(d, ARM_X[i]), y = dot(d, ARM_Y[i]), h = SQRT(x * x + y * y);
        const real c = (dot(d, d) + ARM_ROD[i]) / (2 * h);
        reached = c >= -1 && c <= 1;
        w->length[i] = ROD[i];
        rates[i] = 0;
        if (reached) {
            const real s = BRANCH[i] * SQRT((1 - c) * (1 + c));
            const real cosine = (x * c - y * s) / h, sine = (y * c + x * s) / h;
            legs[leg] = (angle_of(cosine, sine) - ZERO[i]) / GAIN[i];
            for (int k = 0; k < 3; k++) {
                const real tip = cosine * ARM_X[i][k] + sine * ARM_Y[i][k];
                const real slope = cosine * ARM_Y[i][k] - sine * ARM_X[i][k];
                w->base[i][k] += tip;
                rates[i] += (d[k] - tip) * slope * GAIN[i] / ROD[i];
            }
        }
#else
        w->length[i] = SQRT(dot(d, d));
        reached = is_finite(w->length[i]);
        if (reached) legs[leg] = (w->length[i] * SIZE - ZERO[i]) / GAIN[i];
        rates[i] = PER_SIZE * GAIN[i];
#endif
        if (!reached && !(missing && missing < leg + 1)) missing = leg + 1;
    }
    return missing;
}

/* ---- home's assembly mode (gough: home_mode.py) --------------------------------------------- */

/* Whether the determinant has home's sign all along the straight way from an internal pose to
 * that in `end`, and the motors reach all of it. */
static int reached_from(const problem *end, const real s[3], const real q[4])
{
    problem w;
    real from[7], at[7], step[7], J[36], r[6], x[6], along = 0, square = 1;
    int count;
    memcpy(from, s, 3 * sizeof *s);
    memcpy(from + 3, q, 4 * sizeof *q);
    get_internal(end, step);
    for (int k = 3; k < 7; k++) along += from[k] * step[k];
    for (int k = 0; k < 7; k++) {
        step[k] = (k > 2 && along < 0 ? -step[k] : step[k]) - from[k];
        at[k] = step[k] / (k > 2 ? R(0.5) * TURN_STEP : SHIFT_STEP);
        square += at[k] * at[k];
    }
    count = square < MOST_POINTS * MOST_POINTS ? (int)SQRT(square) : MOST_POINTS;
    for (int n = 1; n <= count; n++) {
        for (int k = 0; k < 7; k++) at[k] = from[k] + step[k] * (real)n / (real)count;
        set_internal(&w, at);
        put_quaternion(&w, at[3], at[4], at[5], at[6]);
        if (reach(&w, r, x)) return 0;
        (void)strut_errors(&w, J, r);
        if (!(eliminate(J, r, x) * HOME_SIGN >= 0)) return 0;
    }
#if ROTARY
    for (int i = 0; i < 6; i++) { /* motors on another branch have other tips */
        for (int k = 0; k < 3; k++) {
            if (FABS(w.base[i][k] - end->base[i][k]) > SAME_TIP) return 0;
        }
    }
#endif
    return 1;
}

/* Whether a pose is the machine's, as far as home and a pose given by the user show. */
static int is_ours(const problem *w, problem *scratch, const hexapod_pose *given)
{
    if (w->inside == INSIDE) return 1;
    if (reached_from(w, STARTS[0], STARTS[0] + 3)) return 1;
    return given && set_pose(scratch, given) && reached_from(w, scratch->s, scratch->q);
}

/* ---- solve (gough: fk/solve.py) ------------------------------------------------------------ */

/* `ours`: the pose is in the machine's assembly mode, as far as is known. */
static hexapod_status judge(const problem *w, int outcome, int ours, const real legs[6])
{
    for (int i = 0; i < 6; i++) {
        if (w->length[i] > FARTHEST) return HEXAPOD_UNREACHABLE;
    }
    if (outcome == STATIONARY) return HEXAPOD_UNREACHABLE;
    if (outcome != SOLVED) return HEXAPOD_NOT_CONVERGED;
    if (!ours) return HEXAPOD_OTHER_MODE;
    if (!w->regular && near_singularity(w)) return HEXAPOD_NEAR_SINGULARITY;
    if (!in_stroke(legs)) return HEXAPOD_OUTSIDE_STROKE;
    return STATED && w->inside == OUTSIDE ? HEXAPOD_OUTSIDE_WORKSPACE : HEXAPOD_CONVERGED;
}

static int has_pose(hexapod_status status)
{
    return status <= HEXAPOD_OUTSIDE_WORKSPACE || status == HEXAPOD_OTHER_MODE;
}

hexapod_status hexapod_solve(const real legs[6], hexapod_pose *inout, hexapod_info *info)
{
    hexapod_status status = HEXAPOD_INVALID_INPUT;
    problem w;
    int steps = 0;
    w.residual = INFINITE;
    if (take_reading(&w, legs)) {
        problem newton;
        real side = 0;
        int followed, stays, outcome = SOLVED;
        if (!set_pose(&w, inout)) set_internal(&w, STARTS[0]);
        newton = w;
        followed = follow(&newton, &steps, &side);
        stays = followed && (newton.inside == INSIDE || !(side * HOME_SIGN > 0));
        if (!stays) { /* Newton's method may have crossed a singularity: damped, it rarely does */
            if (!(side * HOME_SIGN > 0)) set_internal(&w, STARTS[0]);
            outcome = descend(&w, &steps);
        }
        if (stays || (followed && !(outcome == SOLVED && w.inside == INSIDE))) {
            w = newton;
            outcome = SOLVED;
        }
        status = judge(&w, outcome, is_ours(&w, &newton, inout), legs);
        if (has_pose(status)) get_pose(&w, inout);
    }
    if (info) {
        info->residual = w.residual * SIZE;
        info->steps = steps;
    }
    return status;
}

int hexapod_usable(hexapod_status status)
{
    return status <= HEXAPOD_OUTSIDE_WORKSPACE;
}

/* ---- inverse kinematics, for the user -------------------------------------------------------- */

int hexapod_inverse(const hexapod_pose *pose, real legs[6])
{
    problem w;
    real rates[6];
    return set_pose(&w, pose) ? reach(&w, legs, rates) : 1;
}

/* ---- velocities (gough: kinematics.py, velocities.py) -------------------------------------- */

/* Struts, readings and Jacobian at a pose; the first leg that cannot reach, 0, or -1 for no pose. */
static int differentiate(problem *w, const hexapod_pose *pose, real J[36])
{
    real legs[6], rates[6], rows[36], r[6], arm[3], moment[3];
    int missing;
    if (!set_pose(w, pose)) return -1;
    missing = reach(w, legs, rates);
    (void)strut_errors(w, rows, r);
    lever(w->q, arm);
    for (int i = 0; i < 6; i++) {
        const real *n = rows + 6 * i;
        real *row = J + 6 * LEG_ORDER[i];
        cross(arm, n, moment);
        for (int k = 0; k < 3; k++) {
            row[k] = n[k] / (SIZE * rates[i]);
            row[k + 3] = (n[k + 3] * RADIUS - moment[k]) / rates[i];
        }
    }
    return missing;
}

void hexapod_jacobian(const hexapod_pose *pose, real J[36])
{
    problem w;
    if (differentiate(&w, pose, J) < 0) {
        for (int k = 0; k < 36; k++) J[k] = (real)NAN;
    }
}

hexapod_status hexapod_twist(const hexapod_pose *pose, const real leg_rates[6], real twist[6])
{
    problem w;
    real J[36], x[6], sum = 0;
    const int missing = differentiate(&w, pose, J);
    for (int i = 0; i < 6; i++) sum += leg_rates[i];
    if (missing < 0 || !is_finite(sum)) return HEXAPOD_INVALID_INPUT;
    if (missing) return HEXAPOD_UNREACHABLE;
    if (eliminate(J, leg_rates, x) == 0) return HEXAPOD_NEAR_SINGULARITY;
    for (int i = 0; i < 6; i++) sum += x[i];
    if (!is_finite(sum)) return HEXAPOD_NEAR_SINGULARITY;
    memcpy(twist, x, sizeof x);
    return near_singularity(&w) ? HEXAPOD_NEAR_SINGULARITY : HEXAPOD_CONVERGED;
}

/* ---- follow (gough: kernel/cycle.py, fk/tracker.py) ---------------------------------------- */

/* Whether two poses are farther apart than a distance and an angle [rad]. Unit quaternions q and p
 * that turn by t from each other have |q - p|^2 = 4 sin^2(t / 4), or |q + p|^2. */
static int far_apart(const hexapod_pose *a, const hexapod_pose *b, real shift, real turn)
{
    const real sine = turn < PI ? 2 * SIN(R(0.25) * turn) : 2;
    real moved = 0, minus = 0, plus = 0;
    for (int k = 0; k < 3; k++) {
        const real step = a->position[k] - b->position[k];
        moved += step * step;
    }
    for (int k = 0; k < 4; k++) {
        const real less = a->wxyz[k] - b->wxyz[k], more = a->wxyz[k] + b->wxyz[k];
        minus += less * less;
        plus += more * more;
    }
    return moved > shift * shift || (minus > sine * sine && plus > sine * sine);
}

/* Look for the pose of a reading that cannot be followed, from one start. */
static hexapod_status search(hexapod_tracker *t, problem *w, const real legs[6])
{
    int outcome;
    if (t->next_start < START_COUNT) set_internal(w, STARTS[t->next_start]);
    else (void)set_pose(w, &t->candidate);
    outcome = descend(w, &t->info.steps);
    t->info.residual = w->residual * SIZE;
    return judge(w, outcome, is_ours(w, NULL, NULL), legs);
}

/* Whether enough readings agree on the pose in w, far from the present one. */
static int confirmed(hexapod_tracker *t, const problem *w)
{
    const int usable = hexapod_usable(t->status);
    hexapod_pose found;
    int agrees = 0;
    get_pose(w, &found);
    if (t->has_candidate) {
        agrees = !far_apart(&t->candidate, &found, t->max_shift, t->max_turn);
    }
    if (!(STATED ? w->inside == INSIDE : usable) && t->next_start < START_COUNT) { /* try all starts first */
        if (!t->has_candidate) t->candidate = found;
        t->has_candidate = 1;
        t->agreeing = 0;
        t->next_start++;
        return 0;
    }
    t->candidate = found;
    t->has_candidate = 1;
    t->agreeing = agrees ? t->agreeing + 1 : 1;
    return (t->lost && usable) || t->agreeing >= t->confirm;
}

/* Whether Newton's method from the present pose ends within the motion of `cycles` cycles; `crossed`:
 * it ends across a singularity. Where it ends inside the workspace, `found` is set. */
static int followed(hexapod_tracker *t, problem *w, int cycles, int *crossed, int *found)
{
    hexapod_pose pose;
    real side;
    set_internal(w, t->at);
    *found = follow(w, &t->info.steps, &side);
    t->info.residual = w->residual * SIZE;
    if (t->side == 0) t->side = side; /* the first reading from a given start */
    *crossed = *found && (w->determinant < 0) != (t->side < 0);
    get_pose(w, &pose);
    if (*found && !*crossed &&
        !far_apart(&t->pose, &pose, t->max_shift * (real)cycles, t->max_turn * (real)cycles)) {
        return 1;
    }
    *found = *found && w->inside == INSIDE;
    return 0;
}

hexapod_event hexapod_update(hexapod_tracker *t, const real legs[6])
{
    problem w;
    int crossed = 0, found = 0;
    const int cycles = 1 + t->missed;
    t->info.steps = 0;
    t->info.residual = INFINITE;
    t->event = HEXAPOD_HELD;
    if (t->missed < MOST_MISSED) t->missed++;
    if (!take_reading(&w, legs)) {
        t->status = HEXAPOD_INVALID_INPUT;
        return t->event;
    }
    if (!t->lost && followed(t, &w, cycles, &crossed, &found)) {
        if (w.inside == INSIDE) t->trusted = 1;
        t->status = judge(&w, SOLVED, t->trusted, legs);
        t->event = HEXAPOD_FOLLOWED;
    } else {
        t->status = found ? judge(&w, SOLVED, 1, legs) : search(t, &w, legs);
        if (!has_pose(t->status)) { /* next time from another start */
            t->next_start = t->next_start < START_COUNT - !t->has_candidate ? t->next_start + 1 : 0;
            if (t->next_start == 0) t->has_candidate = 0;
            return t->event;
        }
        if (!confirmed(t, &w)) {
            if (!t->lost) t->event = crossed ? HEXAPOD_MODE_CHANGED : HEXAPOD_JUMPED;
            return t->event;
        }
        t->lost = 0;
        t->trusted = hexapod_usable(t->status);
        t->event = HEXAPOD_FOUND;
    }
    get_internal(&w, t->at);
    get_pose(&w, &t->pose);
    t->side = w.determinant;
    t->missed = t->agreeing = t->has_candidate = t->next_start = 0;
    return t->event;
}

void hexapod_init(hexapod_tracker *t, const hexapod_pose *start, real max_shift, real max_turn,
                  int confirm)
{
    problem w;
    memset(t, 0, sizeof *t);
    t->lost = !start || !set_pose(&w, start);
    if (t->lost) set_internal(&w, STARTS[0]);
    get_internal(&w, t->at);
    get_pose(&w, &t->pose);
    t->max_shift = max_shift > 0 ? max_shift : R(0.02) * SIZE;
    t->max_turn = max_turn > 0 ? max_turn : R(0.1);
    t->confirm = confirm > 0 ? confirm : 3;
    t->trusted = 1;
    t->status = HEXAPOD_CONVERGED;
    t->event = HEXAPOD_FOUND;
}

/* ---- names --------------------------------------------------------------------------------- */

const char *hexapod_status_label(hexapod_status status)
{
    static const char *const labels[] = {@status_labels@};
    return (unsigned)status < sizeof labels / sizeof *labels ? labels[status] : "unknown";
}

const char *hexapod_event_label(hexapod_event event)
{
    static const char *const labels[] = {@event_labels@};
    return (unsigned)event < sizeof labels / sizeof *labels ? labels[event] : "unknown";
}

const char *hexapod_version(void)
{
    return "@version@";
}

const char *hexapod_digest(void)
{
    return "@digest@";
}
