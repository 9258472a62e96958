/* SPDX-License-Identifier: MIT
   The player: motion that a planner process has computed, checked piece by piece and played at each servo tick.

   It computes no motion. Every batch ends at rest; the next one branches off behind one of its pieces. Where none comes
   in time the player runs into the stop. A newer batch replaces all before it from its branch on. Pause, feed hold,
   abort and lower overrides slow the time along the motion: the rate of time goes to another one by a cubic, over the
   shortest of some spans in which acceleration and jerk keep their limits along the pieces that lie ahead. In step with
   a spindle, time goes as far as its angle says, back too where a tap comes out. Told to run back, time goes back along
   the pieces that were played, as far as they are kept; what is reported to the planner stays where it was.
   Nothing here needs LinuxCNC: tests compile this file alone. */
#ifndef SPLINEFEED_PLAYER_H
#define SPLINEFEED_PLAYER_H
#include <math.h>
#include <stdio.h>
#include <string.h>
#include "splinefeed_wire.h"
#ifndef PLAYER_API
#define PLAYER_API static
#endif

#define PLAYER_COPIES 4        /* pieces that are checked at one tick; twice as many of motion that is waited for */
#define PLAYER_CLOSE 1e-6      /* units at a joint, and share of the limits of velocity and acceleration */
#define PLAYER_OVER 1.001      /* times a limit */
#define PLAYER_JUMP 1.5        /* steps of acceleration, times jerk limit and period: what third differences allow */
#define PLAYER_HALVINGS 3      /* times that a piece is halved before it counts as over a limit */
#define PLAYER_SILENT 1.0      /* s without a beat of the planner */
#define PLAYER_TURNS 3         /* spans of a change of rate that are looked at at one tick */
#define PLAYER_LOOKS 128       /* places along the motion that are looked at for one of them */
#define PLAYER_LONGER 1.12     /* each span is so many times the one before; so many there are */
#define PLAYER_SPANS 48
#define PLAYER_EARLY 3.0       /* a step slows down over at most so many times the shortest span */
#define PLAYER_NEAR 1e-7       /* s in a piece: so near to its end is at its end */
#define PLAYER_SPIN 0.3        /* share of what a spindle's angle is off by that is taken for its own at a tick */
#define PLAYER_ANEW 0.25       /* turns off by which an encoder counts anew */
#define PLAYER_FOLLOW 100.0    /* 1/s: how fast motion makes good what it is behind a spindle */
#define PLAYER_BEHIND 0.020    /* s that it may be behind */
#define PLAYER_ROOM 1.0        /* s of kept pieces before those where a run back comes to rest on the path */
#define PLAYER_KEPT 0.99       /* share of a limit that a change of rate may use: it is looked at at places */

#define PUBLISH(field, value) __atomic_store_n(&(field), value, __ATOMIC_RELEASE)
#define LOOK(field) __atomic_load_n(&(field), __ATOMIC_ACQUIRE)

/* what it is told: go on, come to rest on the path, come to rest where the next move begins */
enum { PLAYER_GO, PLAYER_HOLD, PLAYER_STEP };

typedef struct {
    wire *w;
    double period;
    /* limits that LinuxCNC has, for each axis */
    double vmax[WIRE_COLUMNS], amax[WIRE_COLUMNS], pmin[WIRE_AXES], pmax[WIRE_AXES];
    int there[WIRE_COLUMNS];       /* whether the machine has it */
    int columns;                   /* axes, and joints that are none, whose limits the planner tells */
    /* what is played */
    double at[WIRE_AXES], speed;   /* where it is, and how fast x y z (else the others) go */
    int moving, stopping;
    unsigned long long piece, segment;
    unsigned int piece_i;
    double t, rate, rate_v;        /* time in the piece, rate of time and its derivative */
    double since;                  /* time in the piece as this tick began, or as the piece did in this tick */
    /* what is known */
    unsigned long long next;       /* batch that is looked at next: those before are played or dropped */
    unsigned long long seen;       /* batches that are copied whole */
    unsigned int part;             /* pieces of batch `seen` that are copied */
    unsigned long long playing, session, beat, fault;
    double silent;                 /* s since the planner's last beat */
    int faulty, told;              /* 1 the planner is silent, 2 it cannot go on, 3 a spindle is too fast; 3 was told */
    /* a change of the rate of time under way: a cubic of time from its start */
    int turning;
    double turn[4], turn_t, turn_span, turn_to;
    unsigned int turn_try;         /* spans that were looked at in vain */
    int exact, stepped;            /* the change ends where the next move begins; it stands there, and was told to */
    /* motion in step with a spindle: how (WIRE_THREAD, WIRE_TAP); its angle, turns, and speed, turns/s; s of motion that
       a turn is; where the motion should be and is, s from its start; how much earlier it has to be there, s; whether a
       tap comes out */
    int sync, out;
    double spin, spin_v, turn_s, due, gone, lead;
    /* the way that it has come: whether the batch that is played follows on others; for each batch that was left, the one
       before (itself where that is not kept), the one after, and where it was left: a time in a piece, s */
    int chain;
    struct { unsigned long long from, to, piece; double at; } way[WIRE_BATCHES];
    unsigned long long copied;     /* piece behind the newest one in the ring */
    int back, behind;              /* it is told to run back; it is behind the place where that began */
    unsigned long long front, front_piece; /* the newest batch that it has played, and that place */
    double front_t;
    wire_batch batch[WIRE_BATCHES];
    wire_piece ring[WIRE_PIECES];
    wire_joints joints_of[WIRE_PIECES];
} player;

static wire_piece *player_piece(player *p, unsigned long long k) { return &p->ring[k % WIRE_PIECES]; }
/* The quintic of an axis, or of a joint that is none. */
static double const *player_column(player *p, wire_piece const *g, int i)
{
    return i < WIRE_AXES ? g->c[i] : p->joints_of[g - p->ring].c[i - WIRE_AXES];
}
static wire_batch *player_batch(player *p, unsigned long long k) { return &p->batch[k % WIRE_BATCHES]; }

PLAYER_API void player_begin(player *p, wire *w, double period)
{
    memset(p, 0, sizeof(*p));
    p->w = w, p->period = period, p->rate = 1, p->columns = WIRE_AXES;
    memset(w, 0, sizeof(*w));
    w->protocol = WIRE_PROTOCOL, w->size = sizeof(wire), w->epoch = 1, w->period = period;
    PUBLISH(w->magic, WIRE_MAGIC);
}
PLAYER_API unsigned long player_size(void) { return sizeof(player); }
PLAYER_API unsigned long player_wire_size(void) { return sizeof(wire); }

static void player_epoch(player *p, unsigned int why)
{
    p->w->why = why;
    p->next = p->seen = LOOK(p->w->batch_head), p->part = 0;
    p->w->batch_seen = p->seen;
    if (p->seen) p->w->piece_seen = p->w->batch[(p->seen - 1) % WIRE_BATCHES].piece + p->w->batch[(p->seen - 1) % WIRE_BATCHES].n;
    PUBLISH(p->w->epoch, p->w->epoch + 1);
}

static int player_refuse(player *p, char const *why, int axis)
{
    if (axis >= WIRE_AXES) snprintf(p->w->said, WIRE_TEXT, "%s: joint %u", why, p->w->joint[axis - WIRE_AXES]);
    else snprintf(p->w->said, WIRE_TEXT, "%s%s%s", why, axis < 0 ? "" : ": axis ", axis < 0 ? "" : &"X\0Y\0Z\0A\0B\0C\0U\0V\0W"[2 * axis]);
    p->w->refused++;
    player_epoch(p, WIRE_WHY_REFUSED);
    return -1;
}

static void player_state(double const c[6], double t, double x[3])
{
    x[0] = c[0] + t * (c[1] + t * (c[2] + t * (c[3] + t * (c[4] + t * c[5]))));
    x[1] = c[1] + t * (2 * c[2] + t * (3 * c[3] + t * (4 * c[4] + t * 5 * c[5])));
    x[2] = 2 * c[2] + t * (6 * c[3] + t * (12 * c[4] + t * 20 * c[5]));
}

/* The largest |value| that a polynomial of degree n, 3 or 4, can have on [0, 1]: that of its Bernstein coefficients. */
static double player_most(double const a[], int n)
{
    static double const share[2][5][5] = { /* binomial(i, k) / binomial(n, k) */
        {{1}, {1, 1 / 3.0}, {1, 2 / 3.0, 1 / 3.0}, {1, 1, 1, 1}},
        {{1}, {1, 1 / 4.0}, {1, 1 / 2.0, 1 / 6.0}, {1, 3 / 4.0, 1 / 2.0, 1 / 4.0}, {1, 1, 1, 1, 1}}};
    double most = 0;
    int i, k;
    for (i = 0; i <= n; i++) {
        double b = 0;
        for (k = 0; k <= i; k++) b += share[n - 3][i][k] * a[k];
        most = fmax(most, fabs(b));
    }
    return most;
}

/* Whether a polynomial of degree n stays within a limit on [0, 1]: halves are looked at where the bound is not enough. */
static int player_within(double const a[], int n, double limit, int halvings)
{
    double left[5], right[5];
    int i, k;
    if (player_most(a, n) <= limit) return 1;
    if (!halvings) return 0;
    for (k = 0; k <= n; k++) left[k] = a[k] * ldexp(1, -k);
    for (k = 0; k <= n; k++) { /* left(1 + t) */
        double ways = 1; /* binomial(i, k) */
        for (right[k] = 0, i = k; i <= n; i++) right[k] += ways * left[i], ways = ways * (i + 1) / (i + 1 - k);
    }
    return player_within(left, n, limit, halvings - 1) && player_within(right, n, limit, halvings - 1);
}

/* Whether a piece may be played behind `before`, left at a time in it and at a rate, or from rest where that is none; the
   end of a stop: `last`. */
static int player_check(player *p, wire_piece const *g, wire_piece const *before, double at, double rate, int last)
{
    double h = g->span, T = p->period;
    int i, k;
    if (!(h > 1e-9 && h < 10) || !(g->scale > 0 && g->scale < 1e3)) return player_refuse(p, "a piece without a time", -1);
    if (g->segment < p->w->seg_clear || g->segment >= p->w->seg_head) return player_refuse(p, "a piece on no move", -1);
    for (i = 0; i < p->columns; i++) {
        double const *c = player_column(p, g, i);
        double x[3], y[3] = {0}, J = p->w->jerk[i];
        for (k = 0; k < 6; k++)
            if (!(fabs(c[k]) < 1e15)) return player_refuse(p, "a piece that is not finite", i);
        if (!p->there[i]) {
            for (k = 1; k < 6; k++)
                if (c[k] != 0) return player_refuse(p, "a piece moves an axis that the machine lacks", i);
            continue;
        }
        if (!(J > 0)) return player_refuse(p, "the planner gives no limit of jerk", i);
        double dv = PLAYER_CLOSE * p->vmax[i] + J * T * T, da = PLAYER_CLOSE * p->amax[i] + PLAYER_JUMP * J * T;
        player_state(c, 0, x);
        if (before) {
            player_state(player_column(p, before, i), fmin(at, before->span), y);
            y[1] *= rate, y[2] *= rate * rate;
            if (fabs(x[0] - y[0]) > PLAYER_CLOSE) return player_refuse(p, "a jump of the position", i);
        }
        if (fabs(x[1] - y[1]) > dv) return player_refuse(p, "a jump of the velocity", i);
        if (fabs(x[2] - y[2]) > da) return player_refuse(p, "a jump of the acceleration", i);
        double vs[5] = {c[1], 2 * c[2] * h, 3 * c[3] * h * h, 4 * c[4] * h * h * h, 5 * c[5] * h * h * h * h};
        double as[4] = {2 * c[2], 6 * c[3] * h, 12 * c[4] * h * h, 20 * c[5] * h * h * h};
        if (!player_within(vs, 4, PLAYER_OVER * p->vmax[i] + 1e-9, PLAYER_HALVINGS))
            return player_refuse(p, "faster than the limit of velocity", i);
        if (!player_within(as, 3, PLAYER_OVER * p->amax[i] + 1e-9, PLAYER_HALVINGS))
            return player_refuse(p, "more than the limit of acceleration", i);
        player_state(c, h, x);
        if (i < WIRE_AXES && fmax(fabs(x[0] - p->pmax[i]), fabs(x[0] - p->pmin[i])) > p->pmax[i] - p->pmin[i] + PLAYER_CLOSE)
            return player_refuse(p, "beyond the travel", i);
        if (last && (fabs(x[1]) > dv || fabs(x[2]) > da)) return player_refuse(p, "a batch that does not end at rest", i);
    }
    return 0;
}

/* Copy and check what the planner sent, some pieces a tick: nobody changes it any more behind our back. */
static void player_take(player *p)
{
    wire *w = p->w;
    unsigned long long head = LOOK(w->batch_head);
    int room = p->moving ? PLAYER_COPIES : 2 * PLAYER_COPIES;
    if (p->behind && p->seen - p->playing > WIRE_BATCHES / 2) return; /* it stands on what would be overwritten */
    if (head < p->seen || head - p->seen > WIRE_BATCHES) { player_refuse(p, "a count of batches that is not one", -1); return; }
    while (p->seen < head && room > 0) {
        wire_batch *b = player_batch(p, p->seen);
        if (!p->part) {
            *b = w->batch[p->seen % WIRE_BATCHES];
            if (b->epoch == w->epoch
                && (b->n < 1 || b->sure < 1 || b->sure > b->n || b->n > WIRE_PIECES / 2 || !(b->rate >= 0 && b->rate <= 1)
                    || !(b->vlimit > 0) || !(b->at >= 0) || b->done > w->seg_head
                    || b->piece + b->n - (p->behind ? p->front_piece : p->piece) > WIRE_PIECES)) {
                player_refuse(p, "a batch that cannot be one", -1);
                return;
            }
        }
        if (p->behind && b->piece + b->n - p->piece > WIRE_PIECES / 2) { p->part = 0; return; }
        if (b->rate > 0 && room == PLAYER_COPIES) room *= 2; /* another override */
        if (b->epoch == w->epoch) {
            for (; p->part < b->n && room > 0; p->part++, room--) {
                unsigned long long k = b->piece + p->part;
                wire_piece *g = player_piece(p, k);
                wire_piece *before = p->part ? player_piece(p, k - 1) : b->from_rest ? NULL : player_piece(p, b->after);
                *g = w->piece[k % WIRE_PIECES];
                if (p->columns > WIRE_AXES) p->joints_of[k % WIRE_PIECES] = w->joints_of[k % WIRE_PIECES];
                if (k >= p->copied) p->copied = k + 1;
                double rate = !p->part && b->rate > 0 ? b->rate : 1, at = p->part ? INFINITY : b->at;
                if (player_check(p, g, before, at, rate, p->part + 1 == b->n)) return;
            }
            if (p->part < b->n) break;
            w->piece_seen = b->piece + b->n;
        }
        p->part = 0;
        PUBLISH(w->batch_seen, ++p->seen);
    }
}

/* --- changes of the rate of time ---------------------------------------------------------------------------------- */

/* A place along the motion ahead; it leaves its piece at `end`, for batch `to` - 1 if that is not 0. */
typedef struct { unsigned long long playing, next, piece; unsigned int piece_i; double t, end; unsigned long long to; } player_spot;

static double player_turned(double const c[4], double t) { return c[0] + t * (c[1] + t * (c[2] + t * c[3])); }
static double player_turned_way(double const c[4], double t)
{
    return t * (c[0] + t * (c[1] / 2 + t * (c[2] / 3 + t * c[3] / 4)));
}

/* Where it leaves its piece: at the end, or for the newest batch that is known to follow from there at any rate; on the
   way that it has come, where it did. */
static void player_leave(player *p, player_spot *s)
{
    unsigned long long k = p->seen;
    s->end = player_piece(p, s->piece)->span, s->to = 0;
    if (s->playing < p->front) {
        if (s->piece != p->way[s->playing % WIRE_BATCHES].piece) return;
        s->end = fmin(s->end, p->way[s->playing % WIRE_BATCHES].at), s->to = p->way[s->playing % WIRE_BATCHES].to + 1;
        return;
    }
    while (k-- > s->next) {
        wire_batch *b = player_batch(p, k);
        if (b->epoch != p->w->epoch || b->from_rest || b->after != s->piece || b->rate > 0 || b->at < s->t) continue;
        s->end = fmin(s->end, b->at), s->to = k + 1;
        return;
    }
}

static player_spot player_here(player *p)
{
    player_spot s = {p->playing, p->next, p->piece, p->piece_i, p->t, 0, 0};
    player_leave(p, &s);
    return s;
}

/* On to the start of the next piece, by what is known now; 0 where it ends. */
static int player_ahead(player *p, player_spot *s)
{
    s->t = 0;
    if (s->to) s->playing = s->to - 1, s->next = s->to, s->piece = player_batch(p, s->playing)->piece, s->piece_i = 0;
    else if (s->piece_i + 1 >= player_batch(p, s->playing)->n) return 0;
    else s->piece++, s->piece_i++;
    player_leave(p, s);
    return 1;
}

/* Back to the end of the piece before, if that is kept, whose time is added to t; 0 where it is not. */
static int player_before(player *p, player_spot *s)
{
    player_spot to = *s;
    wire *w = p->w;
    if (s->piece_i) to.piece--, to.piece_i--;
    else {
        to.playing = p->way[s->playing % WIRE_BATCHES].from;
        if (to.playing == s->playing || to.playing + WIRE_BATCHES <= p->seen + 1) return 0;
        to.piece = p->way[to.playing % WIRE_BATCHES].piece;
        to.piece_i = to.piece - player_batch(p, to.playing)->piece;
    }
    if (to.piece + WIRE_PIECES <= p->copied) return 0;
    unsigned long long segment = player_piece(p, to.piece)->segment;
    if (segment + WIRE_SEGMENTS / 2 < w->seg_done || w->segment[segment % WIRE_SEGMENTS].indexer >= 0) return 0;
    player_leave(p, &to);
    to.t += to.end;
    *s = to;
    return 1;
}

/* Whether a run back has room before what is kept ends in mid-motion; motion that began at rest ends there by itself. */
static int player_room(player *p)
{
    player_spot s = player_here(p);
    for (s.t = p->t; s.t < PLAYER_ROOM;)
        if (!player_before(p, &s))
            return !s.piece_i && player_batch(p, s.playing)->from_rest && p->way[s.playing % WIRE_BATCHES].from == s.playing;
    return 1;
}

/* Whether acceleration and jerk keep their limits at a place of a piece and a rate of time, r, with its derivatives:
   x''r^2 + x'r' and x'''r^3 + 3x''rr' + x'r''. */
static int player_may_at(player *p, unsigned long long piece, double at, double r, double rv, double ra)
{
    int i;
    for (i = 0; i < p->columns; i++) {
        double x[3], x3;
        double const *g = player_column(p, player_piece(p, piece), i);
        if (!p->there[i]) continue;
        player_state(g, at, x);
        x3 = 6 * g[3] + at * (24 * g[4] + at * 60 * g[5]);
        if (fabs(x[2] * r * r + x[1] * rv) > PLAYER_KEPT * p->amax[i]) return 0;
        if (fabs(x3 * r * r * r + 3 * x[2] * r * rv + x[1] * ra) > PLAYER_KEPT * p->w->jerk[i]) return 0;
    }
    return 1;
}

/* The least rate of time: below 0 a tap comes out, or it runs back. */
static double player_least_rate(player *p) { return p->sync == WIRE_TAP || p->back ? -1 : 0; }

/* Whether a change of rate, from its time `from` on, keeps them along the motion ahead of a place: at about each tick,
   and at both sides of the end of each piece, where jerk has its peaks. */
static int player_may(player *p, player_spot s, double const c[4], double from, double span)
{
    int n = (int)fmin(ceil((span - from) / p->period), PLAYER_LOOKS), k;
    double step = (span - from) / (n < 1 ? 1 : n), way = player_turned_way(c, from);
    for (k = 0; k <= n; k++) {
        double t = from + k * step, r = player_turned(c, t), now = player_turned_way(c, t);
        double rv = c[1] + t * (2 * c[2] + t * 3 * c[3]), ra = 2 * c[2] + 6 * c[3] * t;
        if (r < player_least_rate(p) - 1e-9 || r > 1 + 1e-9) return 0;
        s.t += now - way, way = now;
        while (s.t < 0) {
            if (!player_may_at(p, s.piece, 0, r, rv, ra)) return 0;
            if (!player_before(p, &s)) return 1; /* it comes to rest before */
            if (!player_may_at(p, s.piece, s.end, r, rv, ra)) return 0;
        }
        while (s.t >= s.end) {
            double over = s.t - s.end;
            if (!player_may_at(p, s.piece, s.end, r, rv, ra)) return 0;
            if (!player_ahead(p, &s)) return 1; /* it comes to rest before */
            if (!player_may_at(p, s.piece, 0, r, rv, ra)) return 0;
            s.t = over;
        }
        if (!player_may_at(p, s.piece, s.t, r, rv, ra)) return 0;
    }
    return 1;
}

/* The same along the batches that are known to come, and along the stop of this one, should none of them be taken. */
static int player_may_both(player *p, player_spot s, double const c[4], double from, double span)
{
    player_spot stop = s;
    stop.next = p->seen, player_leave(p, &stop);
    return player_may(p, s, c, from, span) && (s.next >= p->seen || player_may(p, stop, c, from, span));
}

/* The shortest span in which the rate may change by a gap where the motion goes straight on. */
static double player_shortest(player *p, double gap)
{
    double least = 4 * p->period;
    int i;
    for (i = 0; i < p->columns; i++) {
        double x[3];
        if (!p->there[i] || !(p->w->jerk[i] > 0)) continue;
        player_state(player_column(p, player_piece(p, p->piece), i), p->t, x);
        least = fmax(least, fmax(1.5 * gap * fabs(x[1]) / p->amax[i], sqrt(6 * gap * fabs(x[1]) / p->w->jerk[i])));
    }
    return least;
}

/* Look for a change of the rate to `want`, and for a shorter one while one goes on; that stays until one is found. */
static void player_seek(player *p, double want)
{
    double most = p->turning && p->turn_to == want ? p->turn_span - p->turn_t - p->period : INFINITY;
    player_spot s = player_here(p);
    double d = want - p->rate, least = player_shortest(p, fabs(d));
    int k;
    for (k = 0; k < PLAYER_TURNS; k++) {
        double T = least * pow(PLAYER_LONGER, p->turn_try);
        double c[4] = {p->rate, p->rate_v, 3 * d / (T * T) - 2 * p->rate_v / T, -2 * d / (T * T * T) + p->rate_v / (T * T)};
        p->turn_try = T < most ? (p->turn_try + 1) % PLAYER_SPANS : 0;
        if (T >= most) return;
        if (!player_may_both(p, s, c, 0, T)) continue;
        memcpy(p->turn, c, sizeof(c));
        p->turning = 1, p->turn_t = 0, p->turn_span = T, p->turn_to = want, p->turn_try = 0;
        return;
    }
}

/* Time from here to where a move of another number begins, along the pieces that are known; INFINITY where it is far. */
static double player_to_next(player *p)
{
    player_spot s = player_here(p);
    int id = p->w->segment[player_piece(p, s.piece)->segment % WIRE_SEGMENTS].id, k;
    double way = -p->t;
    for (k = 0; k < PLAYER_LOOKS; k++) {
        way += s.end;
        if (!player_ahead(p, &s)) return INFINITY; /* it comes to rest before */
        if (p->w->segment[player_piece(p, s.piece)->segment % WIRE_SEGMENTS].id != id) return way;
    }
    return INFINITY;
}

/* Begin to slow down so that it stands where the next move begins, once that is near. */
static void player_seek_next(player *p)
{
    player_spot s = player_here(p);
    double way = player_to_next(p), r = p->rate, rv = p->rate_v, root = r * r / 4 + rv * way / 3, T;
    if (!(way < INFINITY && root > 0)) return;
    T = 2 * way / (r / 2 + sqrt(root)); /* rT/2 + rv T^2/12 = way */
    if (!(T >= 4 * p->period && T <= PLAYER_EARLY * player_shortest(p, r))) return;
    double c[4] = {r, rv, -3 * r / (T * T) - 2 * rv / T, 2 * r / (T * T * T) + rv / (T * T)};
    if (!player_may_both(p, s, c, 0, T)) return;
    memcpy(p->turn, c, sizeof(c));
    p->turning = p->exact = 1, p->turn_t = 0, p->turn_span = T, p->turn_to = 0, p->turn_try = 0;
}

/* One tick of the rate of time towards `want`: how far time goes, s. */
static double player_rate(player *p, double want)
{
    double before, after, way, left;
    if (!p->exact && (p->turning || p->rate != want)) player_seek(p, want);
    if (!p->turning) return p->rate * p->period;
    before = p->turn_t, after = fmin(before + p->period, p->turn_span), left = before + p->period - after;
    way = player_turned_way(p->turn, after) - player_turned_way(p->turn, before) + left * p->turn_to;
    p->turn_t = after;
    p->rate = fmin(fmax(player_turned(p->turn, after), player_least_rate(p)), 1);
    p->rate_v = p->turn[1] + after * (2 * p->turn[2] + after * 3 * p->turn[3]);
    if (after >= p->turn_span) p->turning = 0, p->rate = p->turn_to, p->rate_v = 0;
    return fmax(way, player_least_rate(p) < 0 ? way : 0);
}

/* --- in step with a spindle ---------------------------------------------------------------------------------------- */

/* Motion from rest begins in step, how, with a spindle that has turned so far; a turn is so long in the time of motion. */
PLAYER_API void player_sync(player *p, int how, double turns, double turn_s)
{
    p->sync = how, p->out = 0, p->spin = turns, p->turn_s = turn_s, p->due = turns * turn_s, p->gone = 0;
}

/* The angle of the spindle at a tick, turns: what noise its counts have is smoothed. */
PLAYER_API void player_spindle(player *p, double turns)
{
    double before = p->spin, off;
    p->spin += p->spin_v * p->period, off = turns - p->spin;
    if (fabs(off) > PLAYER_ANEW) { /* it counts anew */
        p->spin = turns;
        return;
    }
    p->spin += PLAYER_SPIN * off;
    p->spin_v += PLAYER_SPIN * PLAYER_SPIN / (2 - PLAYER_SPIN) * off / p->period;
    p->due += (p->spin - before) * p->turn_s;
}

/* A tap is as deep as it should be: it comes out as the spindle turns back. */
PLAYER_API void player_come_out(player *p) { p->out = 1; }

/* The rate of time that follows it. */
static double player_follow(player *p)
{
    double speed = p->spin_v * p->turn_s;
    double behind = p->due + speed * p->lead - p->gone - p->rate * p->period; /* at the end of this tick */
    if (fabs(behind) > PLAYER_BEHIND && !p->faulty) p->faulty = 3;
    return fmin(fmax(speed + PLAYER_FOLLOW * behind, player_least_rate(p)), 1);
}

/* The newest batch that branches off here, or that begins here at rest, into `found`. */
static int player_find(player *p, unsigned long long *found)
{
    wire *w = p->w;
    unsigned long long k = p->seen;
    int i, late = 0;
    while (k-- > p->next) {
        wire_batch *b = player_batch(p, k);
        if (b->epoch != w->epoch) continue;
        if (!p->moving) {
            late |= !b->from_rest; /* it was to follow what has come to rest */
            if (b->from_rest != 1 && !(b->from_rest && b->after == p->piece)) continue;
            for (i = 0; i < WIRE_AXES; i++)
                if (p->there[i] && fabs(player_piece(p, b->piece)->c[i][0] - p->at[i]) > PLAYER_CLOSE)
                    return player_refuse(p, "a motion that begins elsewhere", i), 0;
        } else {
            if (b->from_rest || b->after > p->piece) continue;
            player_spot s = {k, k + 1, b->piece, 0, 0, 0, 0};
            player_leave(p, &s);
            if (b->after < p->piece || b->at < p->since || (b->rate > 0 && (fabs(b->rate - p->rate) > 1e-6 * b->rate || p->turning))
                || (p->turning && !player_may_both(p, s, p->turn, p->turn_t, p->turn_span)))
                return player_epoch(p, WIRE_WHY_LATE), 0; /* too late, or the override was turned once more */
        }
        *found = k;
        return 1;
    }
    if (late) player_epoch(p, WIRE_WHY_LATE);
    return 0;
}

/* Where it leaves the piece that it plays, s in it: at its end, or before for the newest batch that follows from there. */
static double player_end(player *p)
{
    unsigned long long k = p->seen;
    double span = player_piece(p, p->piece)->span;
    if (p->playing < p->front)
        return p->piece == p->way[p->playing % WIRE_BATCHES].piece ? fmin(span, p->way[p->playing % WIRE_BATCHES].at) : span;
    while (k-- > p->next) {
        wire_batch *b = player_batch(p, k);
        if (b->epoch == p->w->epoch && !b->from_rest && b->after == p->piece) return fmin(span, b->at);
    }
    return span;
}

/* What was played may not be run back over any more. */
PLAYER_API void player_forget(player *p) { p->chain = p->behind = 0; }

/* Go on with that batch, where the one that is played is left at a time in its piece; on the way that it has come, with
   the one that followed. */
static int player_next(player *p, double at)
{
    unsigned long long k, old = p->playing;
    wire_batch *b;
    if (old < p->front) {
        if (p->piece != p->way[old % WIRE_BATCHES].piece) return 0;
        p->playing = p->way[old % WIRE_BATCHES].to, p->piece = player_batch(p, p->playing)->piece, p->piece_i = 0;
        return 1;
    }
    if (!player_find(p, &k)) return 0;
    b = player_batch(p, k);
    p->way[k % WIRE_BATCHES].from = p->chain && (b->rate == 0 || fabs(b->rate - 1) < 1e-9) ? old : k;
    p->way[old % WIRE_BATCHES].to = k, p->way[old % WIRE_BATCHES].piece = p->piece, p->way[old % WIRE_BATCHES].at = at;
    p->chain = 1, p->behind = 0, p->front = k;
    if (p->moving && b->rate > 0) p->rate = 1;
    p->next = k + 1, p->playing = k, p->w->batch_now = k;
    p->piece = b->piece, p->piece_i = 0;
    return 1;
}

static void player_place(player *p)
{
    wire_piece const *g = player_piece(p, p->piece);
    double v[3] = {0};
    int i;
    for (i = 0; i < WIRE_AXES; i++) {
        double x[3];
        if (!p->there[i]) continue;
        player_state(g->c[i], p->t, x);
        p->at[i] = x[0], v[i / 3] += x[1] * x[1];
    }
    p->speed = fabs(p->rate) * sqrt(v[0] > 0 ? v[0] : v[2] > 0 ? v[2] : v[1]);
    p->segment = g->segment;
}

static void player_rest(player *p)
{
    memcpy(p->w->rest, p->at, sizeof(p->at));
    if (p->sync) p->chain = 0; /* nor is that run back over */
    p->behind = 0, p->playing = p->front;
    p->moving = p->stopping = p->turning = p->exact = p->stepped = p->sync = 0, p->turn_try = 0, p->t = p->rate_v = p->speed = 0, p->rate = 1;
    PUBLISH(p->w->state, WIRE_REST);
}

/* Forget every move and all that was planned; it stands. */
PLAYER_API void player_drop(player *p)
{
    player_rest(p);
    player_forget(p);
    p->faulty = p->told = p->back = 0;
    p->w->seg_clear = p->w->seg_done = p->segment = p->w->seg_head;
    player_epoch(p, WIRE_WHY_DROPPED);
}

PLAYER_API void player_set(player *p, double const at[])
{
    memcpy(p->at, at, sizeof(p->at));
    if (p->moving) return;
    player_rest(p);
    player_forget(p);
}

/* Whether it stands in mid-motion because it was told to. */
PLAYER_API int player_held(player *p) { return p->moving && p->rate == 0 && !p->turning; }

/* Run back along what was played, or forward again; 0 while it moves, or is in step with a spindle. */
PLAYER_API int player_turn_about(player *p, int back)
{
    if (p->sync || (p->moving && !player_held(p))) return 0;
    p->back = back;
    if (!back || p->behind || !(p->moving || p->chain)) return 1;
    if (!p->moving) p->moving = 1, p->rate = p->rate_v = 0, p->t = player_piece(p, p->piece)->span;
    p->behind = 1, p->front_piece = p->piece, p->front_t = p->t;
    return 1;
}

/* Limits of joints that are no axes, from the planner, which has read them in the INI file. */
static void player_joints(player *p)
{
    unsigned int k, many = p->w->joints;
    for (k = 0; k < WIRE_JOINTS; k++) {
        int i = WIRE_AXES + k;
        p->vmax[i] = p->w->joint_vmax[k], p->amax[i] = p->w->joint_amax[k];
        p->there[i] = k < many && p->vmax[i] > 0 && p->amax[i] > 0 && p->w->jerk[i] > 0;
    }
    p->columns = WIRE_AXES + (int)(many < WIRE_JOINTS ? many : WIRE_JOINTS);
}

/* 1 where the planner has gone silent or says that it cannot go on: look at `faulty`; 0 elsewhere. elapsed: s since it
   was called last; a long one is a machine that stood still, planner and all, and counts little. */
PLAYER_API int player_listen(player *p, double elapsed)
{
    wire *w = p->w;
    unsigned long long beat = LOOK(w->beat), session = LOOK(w->session), fault = LOOK(w->fault);
    p->silent = beat != p->beat ? 0 : p->silent + fmin(elapsed, 10 * p->period);
    p->beat = beat;
    if (session != p->session) { /* another planner: nothing of the last one counts */
        p->session = session, p->fault = fault, p->seen = p->next = 0, p->part = 0;
        player_joints(p);
        player_forget(p);
        player_epoch(p, WIRE_WHY_LATE);
    }
    if (p->faulty) return p->faulty == 3 && !p->told++;
    if (fault != p->fault) p->fault = fault, p->faulty = 2;
    else if (!p->moving && w->seg_head == w->seg_done) p->silent = 0; /* nothing is to be planned */
    else if (p->silent > PLAYER_SILENT) p->faulty = 1;
    if (p->faulty) player_epoch(p, WIRE_WHY_LATE);
    return p->faulty != 0;
}
PLAYER_API int player_planner_there(player *p) { return p->session != 0 && p->silent <= PLAYER_SILENT; }

/* Whether motion from rest is there to begin, on which move: it then begins at the next player_tick. */
PLAYER_API int player_ready(player *p, unsigned long long *segment)
{
    unsigned long long k;
    player_take(p);
    if (p->moving || !player_find(p, &k)) return 0;
    *segment = player_piece(p, player_batch(p, k)->piece)->segment;
    return 1;
}

/* One tick of motion as it is told to. 1 while it moves, 0 when it has come to its end at rest. */
PLAYER_API int player_tick(player *p, int told, double net_scale, double vlimit)
{
    wire *w = p->w;
    double want, before, end;
    int exact, begins = !p->moving;
    wire_batch *b;
    wire_piece *g;
    if (begins) {
        if (p->back || !player_next(p, INFINITY)) return 0;
        p->moving = 1, p->stopping = 0, p->t = p->rate_v = 0;
        PUBLISH(w->state, WIRE_MOVES);
    } else player_take(p);
    b = player_batch(p, p->playing), g = player_piece(p, p->piece);
    p->stepped &= told == PLAYER_STEP, p->exact &= told == PLAYER_STEP;
    want = told == PLAYER_HOLD || p->stepped || net_scale <= 0 ? 0 : fmin(net_scale / g->scale, 1);
    if (vlimit < b->vlimit) want = fmin(want, fmax(vlimit, 0) / b->vlimit);
    if (p->back) want = player_room(p) ? -want : 0;
    if (p->sync && told != PLAYER_HOLD) told = PLAYER_GO, want = player_follow(p);
    if (begins) p->rate = want; /* it begins at rest: no jump */
    if (told == PLAYER_STEP && !p->stepped && !p->exact && !p->back && p->rate > 0) player_seek_next(p);
    exact = p->exact, before = p->since = p->t;
    p->t += player_rate(p, want), p->gone += p->t - before;
    if (exact && !p->turning) { /* it stands; where the motion was planned anew meanwhile it goes on to the next place */
        p->exact = 0;
        end = player_end(p);
        if (fabs(p->t - end) < PLAYER_NEAR) p->t = end;
        p->stepped = p->t == end || p->t < PLAYER_NEAR;
    }
    while (p->t < 0) { /* a tap comes out, or it runs back */
        player_spot s = player_here(p);
        if (!player_before(p, &s)) {
            p->gone -= p->t, p->t = 0;
            if (!p->sync) p->rate = p->rate_v = 0, p->turning = 0;
            if (!p->out) break;
            player_place(p);
            w->seg_done = b->done;
            player_rest(p);
            return 0;
        }
        p->playing = s.playing, p->piece = s.piece, p->piece_i = s.piece_i, p->t = s.t, p->since = 0;
        b = player_batch(p, p->playing);
    }
    while (p->t >= (end = player_end(p))) {
        double over = p->t - end, rate = p->rate;
        if (p->sync == WIRE_TAP && p->piece_i + 1 == b->n) { /* as deep as it may go */
            p->t -= over, p->gone -= over;
            break;
        }
        if (player_next(p, end)) {
            b = player_batch(p, p->playing), p->stopping = 0;
            p->t = b->rate > 0 && !p->behind ? over / rate : over; /* what is left of the tick, in its time */
            p->since = 0;
            continue;
        }
        if (end < player_piece(p, p->piece)->span) continue; /* that came too late: on with this piece */
        if (p->piece_i + 1 == b->n) { /* it ends here, at rest */
            p->t = player_piece(p, p->piece)->span;
            player_place(p);
            w->seg_done = b->sure == b->n ? b->done : p->segment;
            player_rest(p);
            w->piece_now = p->piece, w->piece_i = p->piece_i, w->piece_t = p->t;
            return 0;
        }
        p->t = over, p->since = 0, p->piece++, p->piece_i++;
        if (p->piece_i == b->sure && !p->behind) w->late++, p->stopping = 1; /* nothing came in time: the stop begins */
    }
    player_place(p);
    if (p->behind && p->playing == p->front && (p->piece > p->front_piece || (p->piece == p->front_piece && p->t >= p->front_t)))
        p->behind = p->back;
    if (p->behind) { /* the planner sees it stand where it turned about */
        w->rate = 0;
        return 1;
    }
    w->seg_done = p->segment;
    w->piece_now = p->piece, w->piece_i = p->piece_i, w->piece_t = p->t, w->rate = p->rate;
    PUBLISH(w->state, p->stopping ? WIRE_STOPS : WIRE_MOVES);
    return 1;
}

/* "2.9..." is what this is written for; NULL, unknown, passes. */
PLAYER_API int player_version_fits(char const *version)
{
    return !version || !*version || (!strncmp(version, "2.9", 3) && !(version[3] >= '0' && version[3] <= '9'));
}
#endif
