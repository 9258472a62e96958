/* The shared loop of splinefeed.interpolation for one planar rational cubic, in C: the yardstick of benchmarks/ticks.py.

   Same table, same law, same order of every sum and product as the Numba kernels, so that all bits should agree; what
   the Numba loop learns when it is called (degree, axes, method) is fixed here when the file is compiled. A motion is
   run from its first tick to its last, so that no state is handed in or out. */

#include <math.h>
#include <stdint.h>

enum { DEGREE = 3, AXES = 2, TERMS = DEGREE + 1 };
enum { LOW, HIGH, MIDDLE, SCALE, START, ARC, ARC_TERMS = 11, ORIGIN = ARC + ARC_TERMS, BASE = ORIGIN + AXES };
enum { WEIGHT = BASE + AXES * TERMS, WIDTH = WEIGHT + TERMS };
enum { HISTORY = 4, LAW_TERMS = 6, STARTING_STEPS = 3, MAX_STEPS = 80 };

/* One for each function that this file exports. */
enum method { MILNE_SIMPSON, MILNE_SIMPSON_ANCHORED, ARC_LENGTH };

struct motion { /* what a call is given and does not change; benchmarks/ticks.py has the same fields */
    const double *breaks, *coefficients;
    int64_t pieces;
    const double *table;
    const int64_t *curve_rows;
    int64_t curves;
    double length, period;
    int64_t corrections;
    double tolerance;
};

struct cursor {
    int64_t row, first, last;
};

struct instant {
    double s, feed, acceleration;
};

struct result { /* what a call leaves beside the setpoints */
    int64_t replaced;
    double overrun, acceleration;
};

static inline double least(double a, double b) { return a < b ? a : b; }
static inline double most(double a, double b) { return a > b ? a : b; }

static inline const double *walk_to(const double *table, struct cursor *cursor, double u)
{
    int64_t row = cursor->row;
    while (row < cursor->last && u >= table[row * WIDTH + HIGH])
        row++;
    while (row > cursor->first && u < table[row * WIDTH + LOW])
        row--;
    cursor->row = row;
    return table + row * WIDTH;
}

static inline double speed(const double *row, double t)
{
    double weight = row[WEIGHT + DEGREE], slope = 0.0, total = 0.0;
    for (int k = DEGREE - 1; k >= 0; k--) {
        slope = slope * t + weight;
        weight = weight * t + row[WEIGHT + k];
    }
    const double inverse = 1.0 / weight, ratio = slope * inverse;
    for (int a = 0; a < AXES; a++) {
        const double *terms = row + BASE + a * TERMS;
        double value = terms[DEGREE], change = 0.0;
        for (int k = DEGREE - 1; k >= 0; k--) {
            change = change * t + value;
            value = value * t + terms[k];
        }
        change = (change - ratio * value) * inverse;
        total += change * change;
    }
    return sqrt(total) * row[SCALE];
}

static inline void point(const double *row, double t, double *restrict out)
{
    double weight = row[WEIGHT + DEGREE];
    for (int k = DEGREE - 1; k >= 0; k--)
        weight = weight * t + row[WEIGHT + k];
    const double inverse = 1.0 / weight;
    for (int a = 0; a < AXES; a++) {
        const double *terms = row + BASE + a * TERMS;
        double value = terms[DEGREE];
        for (int k = DEGREE - 1; k >= 0; k--)
            value = value * t + terms[k];
        out[a] = row[ORIGIN + a] + value * inverse;
    }
}

static inline double arc_length(const double *row, double t)
{
    const double x = t * t;
    double even = row[ARC + 10], odd = row[ARC + 9];
    for (int k = 0; k < 4; k++) {
        even = even * x + row[ARC + 8 - 2 * k];
        odd = odd * x + row[ARC + 7 - 2 * k];
    }
    return row[START] + ((even * x + row[ARC]) + t * odd);
}

static inline double parameter_in_row(const double *row, double s, double guess)
{
    const double wanted = s - row[START];
    double low = -1.0, high = 1.0;
    double t = least(most(guess, low), high);
    for (int step = 0; step < MAX_STEPS; step++) {
        const double x = t * t;
        double even = row[ARC + 10], odd = row[ARC + 9], even_slope = 0.0, odd_slope = 0.0;
        for (int k = 0; k < 4; k++) {
            even_slope = even_slope * x + even;
            odd_slope = odd_slope * x + odd;
            even = even * x + row[ARC + 8 - 2 * k];
            odd = odd * x + row[ARC + 7 - 2 * k];
        }
        even_slope = even_slope * x + even;
        even = even * x + row[ARC];
        const double rest = (even - wanted) + t * odd;
        const double slope = 2.0 * t * even_slope + (odd + 2.0 * x * odd_slope);
        if (rest > 0.0)
            high = t;
        else if (rest < 0.0)
            low = t;
        else
            return t;
        double after = slope > 0.0 ? least(most(t - rest / slope, -1.0), 1.0) : 2.0;
        double moved;
        if (low <= after && after <= high) {
            moved = fabs(after - t);
        } else {
            after = 0.5 * (low + high);
            moved = high - low;
        }
        t = after;
        if (moved < 1e-9 || high - low < 4e-16)
            break;
    }
    return t;
}

static inline double anchored(double u, double s, const double *table, struct cursor *cursor)
{
    int64_t at = cursor->row;
    while (at < cursor->last && s >= table[(at + 1) * WIDTH + START])
        at++;
    while (at > cursor->first && s < table[at * WIDTH + START])
        at--;
    cursor->row = at;
    const double *row = table + at * WIDTH;
    return row[MIDDLE] + parameter_in_row(row, s, (u - row[MIDDLE]) * row[SCALE]) / row[SCALE];
}

static inline double rate_at(double u, double feed, const double *table, struct cursor *cursor)
{
    if (feed == 0.0)
        return 0.0;
    const double *row = walk_to(table, cursor, u);
    const double size = speed(row, (u - row[MIDDLE]) * row[SCALE]);
    return size > 0.0 ? feed / size : INFINITY;
}

static inline int64_t law_at(const struct motion *motion, int64_t piece, double time, struct instant *out)
{
    const int64_t last = motion->pieces - 1;
    while (piece < last && time >= motion->breaks[piece + 1])
        piece++;
    while (piece > 0 && time < motion->breaks[piece])
        piece--;
    const double tau = least(most(time, motion->breaks[0]), motion->breaks[last + 1]) - motion->breaks[piece];
    const double *terms = motion->coefficients + piece * LAW_TERMS;
    double s = terms[LAW_TERMS - 1], feed = 0.0, acceleration = 0.0;
    for (int k = LAW_TERMS - 2; k >= 0; k--) {
        acceleration = acceleration * tau + feed;
        feed = feed * tau + s;
        s = s * tau + terms[k];
    }
    *out = (struct instant){s, feed, 2.0 * acceleration};
    return piece;
}

static inline double milne_simpson(const struct motion *motion, const double *u, const double *rate, double next_feed,
                                   struct cursor *cursor)
{
    const double period = motion->period;
    double after = u[3] + 4.0 * period / 3.0 * (2.0 * rate[0] - rate[1] + 2.0 * rate[2]);
    for (int64_t pass = 0; pass < motion->corrections; pass++) {
        const double before = after;
        const double next_rate = rate_at(before, next_feed, motion->table, cursor);
        after = u[1] + period / 3.0 * (next_rate + 4.0 * rate[0] + rate[1]);
        if (fabs(after - before) <= motion->tolerance)
            break;
    }
    return after;
}

static inline double runge_kutta(const double *u, const double *rate, double half_feed, double next_feed,
                                 double period, const double *table, struct cursor *cursor)
{
    const double k1 = rate[0];
    const double k2 = rate_at(u[0] + 0.5 * period * k1, half_feed, table, cursor);
    const double k3 = rate_at(u[0] + 0.5 * period * k2, half_feed, table, cursor);
    const double k4 = rate_at(u[0] + period * k3, next_feed, table, cursor);
    return u[0] + period / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4);
}

static inline double next(enum method method, const struct motion *motion, const double *u, const double *rate,
                          double s, double feed, struct cursor *cursor)
{
    if (method == ARC_LENGTH)
        return anchored(u[0] + motion->period * rate[0], s, motion->table, cursor);
    const double guess = milne_simpson(motion, u, rate, feed, cursor);
    return method == MILNE_SIMPSON_ANCHORED ? anchored(guess, s, motion->table, cursor) : guess;
}

static inline __attribute__((always_inline)) void
run(enum method method, const struct motion *given, int64_t ticks, struct result *result, int64_t *restrict curve_out,
    double *restrict u_out, double *restrict s_out, double *restrict feed_out, double *restrict position)
{
    const struct motion motion = *given;
    const double *table = motion.table, length = motion.length, period = motion.period;
    const double end = motion.breaks[motion.pieces];
    const int64_t last_curve = motion.curves - 1, history = method == ARC_LENGTH ? 0 : STARTING_STEPS;
    const int anchor = method != MILNE_SIMPSON;
    struct cursor cursor = {0, 0, 0};
    int64_t curve = 0, piece = 0, steps = 0, replaced = 0;
    double u[HISTORY] = {0.0}, rate[HISTORY] = {0.0}, overrun = 0.0, now = 0.0;
    struct instant at = {0.0, 0.0, 0.0};

    for (int64_t tick = 0; tick < ticks; tick++) {
        const double time = least((double)tick * period, end), passed = time - now;
        const int starting = steps < history, uneven = fabs(passed - period) > 1e-6 * period;
        double half_feed = 0.0;
        if (starting || uneven) {
            piece = law_at(&motion, piece, now + 0.5 * passed, &at);
            half_feed = at.feed;
        }
        piece = law_at(&motion, piece, time, &at);
        const double s = least(most(at.s, 0.0), length), feed = most(at.feed, 0.0);
        now = time;

        int moved_on = tick == 0;
        while (curve < last_curve && s >= table[motion.curve_rows[2 * (curve + 1)] * WIDTH + START]) {
            curve++;
            moved_on = 1;
        }
        const int64_t first_row = motion.curve_rows[2 * curve], last_row = motion.curve_rows[2 * curve + 1];
        const double *last = table + last_row * WIDTH;
        double after;
        if (moved_on) {
            cursor = (struct cursor){first_row, first_row, last_row};
            steps = 0;
            after = anchored(table[first_row * WIDTH + LOW], s, table, &cursor);
        } else {
            if (starting || uneven) {
                after = runge_kutta(u, rate, half_feed, feed, passed, table, &cursor);
                if (anchor && isfinite(after))
                    after = anchored(after, s, table, &cursor);
            } else {
                after = next(method, &motion, u, rate, s, feed, &cursor);
            }
            steps++;
            if (!isfinite(after)) {
                after = anchored(u[0], s, table, &cursor);
                replaced++;
            }
        }
        if (anchor && s >= length)
            after = last[HIGH];
        const double beyond = after - last[HIGH];
        if (beyond > 0.0 && curve == last_curve)
            overrun += beyond * speed(last, 1.0);
        after = least(most(after, table[first_row * WIDTH + LOW]), last[HIGH]);

        for (int k = HISTORY - 1; k > 0; k--) {
            u[k] = u[k - 1];
            rate[k] = rate[k - 1];
        }
        u[0] = after;
        rate[0] = rate_at(after, feed, table, &cursor);
        const double *row = walk_to(table, &cursor, after);
        const double t = (after - row[MIDDLE]) * row[SCALE];
        point(row, t, position + AXES * tick);
        curve_out[tick] = curve;
        u_out[tick] = after;
        s_out[tick] = arc_length(row, t);
        feed_out[tick] = feed;
    }
    *result = (struct result){replaced, overrun, at.acceleration};
}

#define EXPORT(name, method)                                                                                           \
    void name(const struct motion *motion, int64_t ticks, struct result *result, int64_t *curve, double *u, double *s, \
              double *feed, double *position)                                                                          \
    {                                                                                                                  \
        run(method, motion, ticks, result, curve, u, s, feed, position);                                               \
    }

EXPORT(milne_simpson_ticks, MILNE_SIMPSON)
EXPORT(milne_simpson_anchored_ticks, MILNE_SIMPSON_ANCHORED)
EXPORT(arc_length_ticks, ARC_LENGTH)
