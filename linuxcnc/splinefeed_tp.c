/* splinefeed_tp: a trajectory planner module for LinuxCNC 2.9 that hands the moves to a planner process (splinefeed
   linuxcnc planner) and plays what comes back.

   Copyright (C) the splinefeed authors.
   This program is free software; you can redistribute it and/or modify it under the terms of the GNU General Public
   License as published by the Free Software Foundation; either version 2 of the License, or (at your option) any later
   version. It comes WITHOUT ANY WARRANTY; see COPYING in this folder.

   Build: halcompile --install splinefeed_tp.c       Use: [TRAJ] TPMOD = splinefeed_tp

   Written from LinuxCNC's public headers and from what motmod asks of a planner module: 29 tp functions and tcqFull.
   motmod owns the TP_STRUCT and reads its reverse_run and queue; all else of it is kept here. */
#define _GNU_SOURCE /* RTLD_DEFAULT */
#include <dlfcn.h>
#include <stdlib.h>
#include "rtapi.h"
#include "rtapi_app.h"
#include "hal.h"
#include "motion.h"
#include "motion_types.h"
#include "tp.h"
#include "splinefeed_player.h"

MODULE_LICENSE("GPL");
MODULE_DESCRIPTION("plays the motion that splinefeed's planner process computes");

#define MARGIN 24       /* moves: task learns some cycles late that the queue is full */
#define DEPTH 2000      /* moves that task may queue */
#define FASTER 1.2      /* motion per revolution is planned for a spindle so many times as fast as is commanded */
#define LEAD 3          /* ticks from an angle that the module sees until the joints are where it sends them */
#define PAST 10.0       /* turns that the spindle may need to stop at the bottom of a tapped hole */
#define STANDS 0.02     /* turns/s: a spindle that turns no faster stands */
#define STOPS 3.0       /* s that a spindle may take to stop */
#define SAY(...) rtapi_print_msg(RTAPI_MSG_ERR, "splinefeed_tp: " __VA_ARGS__)

typedef struct {
    int id, canon, atspeed, indexer, spindle, sync;
    double per_rev, depth, back; /* of a tapped hole: its depth, and how many times as fast the spindle comes out */
    unsigned char enables;
    EmcPose to;
    struct state_tag_t tag;
    syncdio_t io;
} move_t;
static struct {
    hal_u32_t *late, *refused, *ns, *ns_max;
    hal_float_t *rate;
    hal_bit_t *moving, *fault, *planner;
} *pin;
static emcmot_status_t *stat;
static emcmot_config_t *conf;
static void (*dio_write)(int, char);
static void (*aio_write)(int, double);
static void (*rotary_unlock)(int, int);
static int (*rotary_is_unlocked)(int);
static double (*axis_vmax)(int);
static double (*axis_amax)(int);
static wire *w;
static player me;
static move_t moves[WIRE_SEGMENTS];
static int comp, shm, started, told; /* started: the move `begun` has begun; told: the planner's absence */
static unsigned long long begun;
static unsigned int refused;
static double uu_per_rev;
static double turned; /* 1, or -1 where the spindle turned backwards as the motion began */
static spindle_status_t *indexed; /* a spindle whose encoder was told to begin anew at its index */

static move_t *move(unsigned long long k) { return &moves[k % WIRE_SEGMENTS]; }

static void pose_get(EmcPose const *p, double x[WIRE_AXES])
{
    x[0] = p->tran.x, x[1] = p->tran.y, x[2] = p->tran.z;
    x[3] = p->a, x[4] = p->b, x[5] = p->c, x[6] = p->u, x[7] = p->v, x[8] = p->w;
}
static void pose_set(EmcPose *p, double const x[WIRE_AXES])
{
    p->tran.x = x[0], p->tran.y = x[1], p->tran.z = x[2];
    p->a = x[3], p->b = x[4], p->c = x[5], p->u = x[6], p->v = x[7], p->w = x[8];
}
static void sync_clear(syncdio_t *s) { memset(s, 0, sizeof(*s)); }
static void sync_write(syncdio_t *s)
{
    int i;
    if (!s->anychanged) return;
    for (i = 0; i < conf->numDIO; i++)
        if (s->dio_mask & (1ull << i)) dio_write(i, s->dios[i] > 0);
    for (i = 0; i < conf->numAIO; i++)
        if (s->aio_mask & (1ull << i)) aio_write(i, s->aios[i]);
    s->anychanged = 0;
}
static void idle(TP_STRUCT *tp) /* nothing queued, at rest */
{
    tp->done = 1, tp->depth = tp->activeDepth = 0, tp->aborting = tp->pausing = 0, tp->execId = 0, tp->motionType = 0;
    tp->goalPos = tp->currentPos;
    player_forget(&me); /* what the task did meanwhile is not undone by a run back */
    stat->distance_to_go = stat->current_vel = stat->requested_vel = 0;
    stat->enables_queued = stat->enables_new, stat->spindleSync = 0;
}
static void limits(void) /* those that LinuxCNC has now */
{
    int i;
    for (i = 0; i < WIRE_AXES; i++) {
        double v = axis_vmax(i), a = axis_amax(i);
        me.there[i] = v > 0 && a > 0 && w->jerk[i] > 0; /* the planner says which axes there are */
        me.vmax[i] = v, me.amax[i] = a;
        me.pmin[i] = stat->axis_status[i].min_pos_limit, me.pmax[i] = stat->axis_status[i].max_pos_limit;
    }
}

/* Joints that are no axes, as the machine's own kinematics has them now, at the poses that the planner asks for. */
static void ask_kinematics(void)
{
    static int (*inverse)(EmcPose const *, double *, KINEMATICS_INVERSE_FLAGS const *, KINEMATICS_FORWARD_FLAGS *);
    unsigned int i, k;
    if (!w->joints) return;
    if (!inverse) *(void **)&inverse = dlsym(RTLD_DEFAULT, "kinematicsInverse"); /* it is loaded after this module */
    for (i = 0; i < WIRE_PROBES; i++) {
        double joints[EMCMOT_MAX_JOINTS] = {0};
        KINEMATICS_INVERSE_FLAGS from = 0;
        KINEMATICS_FORWARD_FLAGS to = 0;
        EmcPose pose;
        pose_set(&pose, w->probe[i]);
        int bad = !inverse || inverse(&pose, joints, &from, &to);
        for (k = 0; k < WIRE_JOINTS; k++)
            w->answer[i][k] = bad || w->joint[k] >= EMCMOT_MAX_JOINTS ? NAN : joints[w->joint[k]];
    }
    PUBLISH(w->answered, w->session);
}

static void say_faults(void)
{
    static char text[WIRE_TEXT];
    static long long before;
    long long now = rtapi_get_time();
    double elapsed = before ? 1e-9 * (now - before) : 0;
    before = now;
    unsigned long long session = me.session;
    int fault = player_listen(&me, elapsed);
    if (me.session != session) limits(), ask_kinematics(); /* the planner says which axes it knows */
    if (fault) {
        memcpy(text, w->text, WIRE_TEXT - 1);
        if (me.faulty == 1 && !me.session)
            SAY("no planner answers: start it with  splinefeed linuxcnc planner --ini YOUR.ini, and abort\n");
        else if (me.faulty == 1)
            SAY("the planner has been silent for %g s: the machine stops on its path. Abort, and start it again\n", PLAYER_SILENT);
        else if (me.faulty == 3)
            SAY("line %d: the spindle is more than %g times as fast as was commanded: motion cannot follow. Abort\n",
                w->segment[begun % WIRE_SEGMENTS].line, FASTER);
        else SAY("%s. Abort to go on\n", text);
    }
    if (w->refused != refused) {
        refused = w->refused;
        memcpy(text, w->said, WIRE_TEXT - 1);
        SAY("motion from the planner refused, %s\n", text);
    }
}

/* --- moves ------------------------------------------------------------------------------------------------------ */

/* back, of a tap: how many times as fast it comes out; 0 for another move. */
static int append(TP_STRUCT *tp, wire_segment *g, EmcPose const *end, double back, struct state_tag_t tag)
{
    unsigned long long k = w->seg_head;
    move_t *o = move(k);
    int line = tag.fields[GM_FIELD_LINE_NUMBER], i;
    say_faults();
    if (tp->aborting || me.faulty) return TP_ERR_FAIL;
    double per_rev = tp->synchronized ? fabs(uu_per_rev) : 0, depth = 0;
    g->sync = back > 0 ? WIRE_TAP : tp->synchronized == TC_SYNC_POSITION ? WIRE_THREAD : WIRE_FREE;
    if (per_rev) { /* G95, G33, G76, G33.1 */
        double feed = per_rev * fabs(stat->spindle_status[tp->spindle.spindle_num].speed) / 60 * fmax(back, 1);
        if (!(feed > 0)) {
            SAY("line %d: a feed per revolution, and the spindle does not turn\n", line);
            return TP_ERR_FAIL;
        }
        if (g->sync && !(feed < g->top)) {
            SAY("line %d: in step with the spindle it goes at %g a second, and the axes allow %g\n", line, feed, g->top);
            return TP_ERR_FAIL;
        }
        g->feed = fmin(FASTER * feed, g->top);
    } else if (g->sync) {
        SAY("line %d: motion in step with the spindle without a pitch\n", line);
        return TP_ERR_FAIL;
    }
    if (k - w->seg_done >= WIRE_SEGMENTS - 1) return TP_ERR_FAIL;
    limits();
    g->id = tp->nextId, g->line = line, g->term = tp->termCond, g->tolerance = tp->tolerance;
    pose_get(&tp->goalPos, g->from), pose_get(end, g->to);
    if (g->sync) g->enables &= ~FS_ENABLED; /* its override does not count */
    if (back > 0) { /* as far on as a spindle that stops may go, within the travel */
        double way = 0, most = 1e9;
        for (i = 0; i < 3; i++) depth += (g->to[i] - g->from[i]) * (g->to[i] - g->from[i]);
        depth = sqrt(depth);
        for (i = 0; i < 3; i++) {
            double each = (g->to[i] - g->from[i]) / depth;
            if (each > 0) most = fmin(most, (me.pmax[i] - g->to[i]) / each);
            if (each < 0) most = fmin(most, (me.pmin[i] - g->to[i]) / each);
        }
        way = fmin(PAST * per_rev, fmax(most, 0));
        for (i = 0; i < 3; i++) g->to[i] += way * (g->to[i] - g->from[i]) / depth;
    }
    for (i = 0; i < WIRE_AXES; i++)
        if (me.session && !me.there[i] && fabs(g->to[i] - g->from[i]) > PLAYER_CLOSE) {
            SAY("line %d: the move is along an axis that the planner does not know: %c\n", line, "XYZABCUVW"[i]);
            return TP_ERR_FAIL;
        }
    if (k == w->seg_done) ask_kinematics();
    w->segment[k % WIRE_SEGMENTS] = *g;
    o->id = g->id, o->canon = g->canon, o->atspeed = g->atspeed, o->indexer = g->indexer, o->enables = g->enables;
    o->per_rev = per_rev, o->sync = g->sync, o->depth = depth, o->back = back, o->spindle = tp->spindle.spindle_num;
    o->tag = tag, o->to = *end, o->io = tp->syncdio;
    sync_clear(&tp->syncdio);
    if (!(back > 0)) tp->goalPos = *end; /* a tap ends where it begins */
    tp->done = 0, tp->depth = k + 1 - w->seg_done;
    PUBLISH(w->seg_head, k + 1);
    return 0;
}

int tpAddLine(TP_STRUCT *const tp, EmcPose end, int canon, double vel, double top, double acc, unsigned char enables,
              char atspeed, int indexer, struct state_tag_t tag)
{
    wire_segment g = {.kind = WIRE_LINE, .canon = canon, .feed = vel, .top = top, .enables = enables,
                      .atspeed = atspeed, .indexer = indexer};
    double a[WIRE_AXES], b[WIRE_AXES], far = 0;
    int i;
    (void)acc;
    pose_get(&tp->goalPos, a), pose_get(&end, b);
    for (i = 0; i < WIRE_AXES; i++) far = fmax(far, fabs(b[i] - a[i]));
    return far < TP_POS_EPSILON ? TP_ERR_ZERO_LENGTH : append(tp, &g, &end, 0, tag);
}
int tpAddCircle(TP_STRUCT *const tp, EmcPose end, PmCartesian c, PmCartesian n, int turn, int canon, double vel,
                double top, double acc, unsigned char enables, char atspeed, struct state_tag_t tag)
{
    wire_segment g = {.kind = WIRE_ARC, .canon = canon, .turn = turn, .feed = vel, .top = top, .enables = enables,
                      .atspeed = atspeed, .indexer = -1, .centre = {c.x, c.y, c.z}, .normal = {n.x, n.y, n.z}};
    (void)acc;
    return append(tp, &g, &end, 0, tag);
}
int tpAddRigidTap(TP_STRUCT *const tp, EmcPose end, double vel, double top, double acc, unsigned char enables,
                  double scale, struct state_tag_t tag)
{
    wire_segment g = {.kind = WIRE_LINE, .canon = EMC_MOTION_TYPE_FEED, .feed = vel, .top = top, .enables = enables,
                      .indexer = -1};
    EmcPose *from = &tp->goalPos;
    double x = end.tran.x - from->tran.x, y = end.tran.y - from->tran.y, z = end.tran.z - from->tran.z;
    (void)acc;
    if (x * x + y * y + z * z < TP_POS_EPSILON * TP_POS_EPSILON) return TP_ERR_ZERO_LENGTH;
    end.a = from->a, end.b = from->b, end.c = from->c, end.u = from->u, end.v = from->v, end.w = from->w;
    return append(tp, &g, &end, scale > 0 ? scale : 1, tag);
}

/* --- each tick -------------------------------------------------------------------------------------------------- */

static void unindex(void) /* the spindle's index is not waited for any more */
{
    if (indexed) indexed->spindle_index_enable = 0;
    indexed = NULL;
}

static void drop_all(TP_STRUCT *tp) /* at rest: forget every move and all that was planned */
{
    player_drop(&me);
    unindex();
    begun = w->seg_head, started = 0, told = 0, tp->reverse_run = TC_DIR_FORWARD;
    idle(tp);
}

static int may_begin(unsigned long long k) /* 0 while the spindle or an indexer is not ready */
{
    move_t *o = move(k);
    int n;
    if (started && k == begun) return 1;
    if (o->sync || o->indexer != -1) player_forget(&me);
    if (o->atspeed || o->sync)
        for (n = 0; n < conf->numSpindles; n++)
            if (!stat->spindle_status[n].at_speed) return 0;
    if (o->indexer != -1) {
        rotary_unlock(o->indexer, 1);
        if (!rotary_is_unlocked(o->indexer)) return 0;
    }
    if (!o->sync) return 1;
    spindle_status_t *s = &stat->spindle_status[o->spindle];
    if (!indexed) { /* its encoder counts from 0 at the next index */
        indexed = s, s->spindle_index_enable = 1;
        me.spin = s->spindleRevs, me.spin_v = s->speed / 60;
        return 0;
    }
    if (s->spindle_index_enable) {
        player_spindle(&me, s->spindleRevs);
        return 0;
    }
    indexed = NULL;
    turned = s->speed < 0 ? -1 : 1, me.spin_v *= turned;
    player_sync(&me, o->sync, turned * s->spindleRevs, o->per_rev / w->segment[k % WIRE_SEGMENTS].feed);
    me.lead = LEAD * me.period;
    return 1;
}

/* In step with the spindle: its angle, and where a tapped hole ends the other way round. */
static void follow(TP_STRUCT const *tp)
{
    move_t *o = move(begun);
    spindle_status_t *s = &stat->spindle_status[o->spindle];
    double far = 0, x[WIRE_AXES];
    int i;
    me.turn_s = o->per_rev / w->segment[begun % WIRE_SEGMENTS].feed;
    player_spindle(&me, turned * s->spindleRevs);
    if (o->sync != WIRE_TAP || me.out || tp->aborting || me.faulty == 3) return;
    memcpy(x, w->segment[begun % WIRE_SEGMENTS].from, sizeof(x));
    for (i = 0; i < 3; i++) far += (me.at[i] - x[i]) * (me.at[i] - x[i]);
    if (far >= o->depth * o->depth) player_come_out(&me), s->speed *= -o->back;
}

static void show(TP_STRUCT *tp, move_t const *o) /* which move is under way */
{
    tp->execTag = o->tag, tp->execId = o->id, tp->motionType = o->canon, stat->enables_queued = o->enables;
}

static void begin(TP_STRUCT *tp, unsigned long long k) /* outputs of every move up to this one; none is skipped */
{
    unsigned long long i;
    if (me.behind) { show(tp, move(k)); return; } /* what has begun once does not begin again */
    if (started && k == begun) return;
    for (i = started ? begun + 1 : begun; i <= k; i++) {
        sync_write(&move(i)->io);
        if (started && i > begun && move(i - 1)->indexer != -1) rotary_unlock(move(i - 1)->indexer, 0);
    }
    begun = k, started = 1;
    show(tp, move(k));
}

static void ended(void) /* at the end of motion: the moves that are complete */
{
    unsigned long long i;
    if (w->seg_done <= begun) return; /* it stopped in mid-move */
    for (i = begun + 1; i < w->seg_done; i++) sync_write(&move(i)->io);
    if (started && move(begun)->indexer != -1) rotary_unlock(move(begun)->indexer, 0);
    begun = w->seg_done, started = 0;
}

static double scale(void) /* of what is planned: the override, and for a feed per revolution what the spindle does */
{
    unsigned long long k = me.behind ? me.segment : begun;
    move_t *o = move(k);
    if (!(o->per_rev > 0) || o->sync || !started) return stat->net_feed_scale;
    return stat->net_feed_scale * o->per_rev * fabs(stat->spindle_status[o->spindle].spindleSpeedIn)
        / w->segment[k % WIRE_SEGMENTS].feed;
}

/* Whether it goes on in spite of an abort or a fault. Motion in step with a spindle is known to its end, planner or not.
   A tap is in the hole: where it is to stop, its spindle is stopped, and followed until it stands. */
static int goes_on(TP_STRUCT const *tp)
{
    static double since; /* s that it stops */
    int stops = tp->aborting || me.faulty == 3;
    since = stops && me.moving ? since + me.period : 0;
    if (!me.moving || !me.sync || (stops && me.sync != WIRE_TAP)) return 0;
    if (stops) stat->spindle_status[move(begun)->spindle].speed = 0;
    return !stops || (fabs(me.spin_v) > STANDS && since < STOPS);
}

static void run(TP_STRUCT *const tp)
{
    int on = goes_on(tp);
    int told = (tp->pausing || tp->aborting || me.faulty) && !on ? PLAYER_HOLD : stat->stepping && !me.back ? PLAYER_STEP : PLAYER_GO;
    unsigned long long k;
    w->feed_scale = stat->feed_scale, w->rapid_scale = stat->rapid_scale, w->vlimit = tp->vLimit;
    w->stepping = stat->stepping;
    say_faults();
    if (!me.moving) {
        if (tp->aborting) { drop_all(tp); return; }
        if (w->seg_done == w->seg_head) { idle(tp); return; }
        tp->done = 0, tp->depth = w->seg_head - w->seg_done, stat->current_vel = 0;
        if (me.back) return; /* nothing is kept that it could run back over */
        if (!player_ready(&me, &k) || told == PLAYER_HOLD || stat->net_feed_scale <= 0) { unindex(); return; }
        if (!may_begin(k)) return;
        int other = tp->execId && tp->execId != move(k)->id;
        begin(tp, k);
        if (other && told == PLAYER_STEP && !me.sync) return; /* motmod sees another move, and pauses */
    }
    if (tp->aborting && player_held(&me)) { drop_all(tp); return; }
    if (me.faulty && player_held(&me)) { player_rest(&me), player_forget(&me); stat->current_vel = 0; return; }
    if (me.moving && me.sync) follow(tp);
    stat->spindleSync = me.sync != 0;
    int out = me.sync == WIRE_TAP && me.out;
    if (!player_tick(&me, told, scale(), tp->vLimit)) {
        if (out) stat->spindle_status[move(begun)->spindle].speed /= -move(begun)->back;
        pose_set(&tp->currentPos, me.at);
        stat->current_vel = 0, tp->depth = w->seg_head - w->seg_done;
        ended();
        return;
    }
    begin(tp, me.segment);
    pose_set(&tp->currentPos, me.at);
    tp->activeDepth = 1, tp->depth = w->seg_head - w->seg_done;
    EmcPose *to = &move(me.segment)->to;
    double x = to->tran.x - me.at[0], y = to->tran.y - me.at[1], z = to->tran.z - me.at[2];
    stat->current_vel = me.speed;
    stat->requested_vel = w->segment[me.segment % WIRE_SEGMENTS].feed;
    stat->distance_to_go = sqrt(x * x + y * y + z * z);
    stat->dtg.tran.x = x, stat->dtg.tran.y = y, stat->dtg.tran.z = z;
    stat->dtg.a = to->a - me.at[3], stat->dtg.b = to->b - me.at[4], stat->dtg.c = to->c - me.at[5];
    stat->dtg.u = to->u - me.at[6], stat->dtg.v = to->v - me.at[7], stat->dtg.w = to->w - me.at[8];
}

int tpRunCycle(TP_STRUCT *const tp, long period)
{
    long long from = rtapi_get_time();
    (void)period;
    run(tp);
    w->cycles++;
    *pin->rate = me.moving ? me.rate : 0, *pin->moving = me.moving, *pin->late = w->late, *pin->refused = w->refused;
    *pin->fault = me.faulty != 0, *pin->planner = player_planner_there(&me);
    *pin->ns = rtapi_get_time() - from;
    if (me.moving && *pin->ns > *pin->ns_max) *pin->ns_max = *pin->ns;
    return 0;
}

/* --- settings and reports ----------------------------------------------------------------------------------------- */

void tpMotFunctions(void (*d)(int, char), void (*a)(int, double), void (*u)(int, int), int (*g)(int),
                    double (*v)(int), double (*c)(int))
{
    dio_write = d, aio_write = a, rotary_unlock = u, rotary_is_unlocked = g, axis_vmax = v, axis_amax = c;
}
void tpMotData(emcmot_status_t *s, emcmot_config_t *c) { stat = s, conf = c; }
int tpSetCycleTime(TP_STRUCT *const tp, double s)
{
    if (s <= 0) return TP_ERR_FAIL;
    tp->cycleTime = me.period = w->period = s;
    return 0;
}
int tpSetVmax(TP_STRUCT *const tp, double v, double ini)
{
    if (v <= 0 || ini <= 0) return TP_ERR_FAIL;
    tp->vMax = v, tp->ini_maxvel = ini;
    return 0;
}
int tpSetVlimit(TP_STRUCT *const tp, double v) { tp->vLimit = v < 0 ? 0 : v; return 0; }
int tpSetAmax(TP_STRUCT *const tp, double a) { if (a <= 0) return TP_ERR_FAIL; tp->aMax = a; return 0; }
int tpSetId(TP_STRUCT *const tp, int id) { tp->nextId = id; return 0; }
int tpGetExecId(TP_STRUCT *const tp) { return tp->execId; }
struct state_tag_t tpGetExecTag(TP_STRUCT *const tp) { return tp->execTag; }
int tpSetTermCond(TP_STRUCT *const tp, int c, double tolerance) { tp->termCond = c, tp->tolerance = tolerance; return 0; }
int tpGetPos(TP_STRUCT const *const tp, EmcPose *const p) { *p = tp->currentPos; return 0; }
int tpIsDone(TP_STRUCT *const tp) { return tp->done; }
int tpQueueDepth(TP_STRUCT *const tp) { return tp->depth; }
int tpActiveDepth(TP_STRUCT *const tp) { return tp->activeDepth; }
int tpGetMotionType(TP_STRUCT *const tp) { return tp->motionType; }
int tpPause(TP_STRUCT *const tp) { tp->pausing = 1; return 0; }
int tpResume(TP_STRUCT *const tp) { tp->pausing = 0; return 0; }
int tpAbort(TP_STRUCT *const tp) { tp->aborting = tp->pausing = 1; sync_clear(&tp->syncdio); return 0; }
int tpSetPos(TP_STRUCT *const tp, EmcPose const *const p)
{
    double x[WIRE_AXES];
    tp->currentPos = tp->goalPos = *p;
    pose_get(p, x);
    player_set(&me, x);
    return 0;
}
int tpSetRunDir(TP_STRUCT *const tp, tc_direction_t d)
{
    int back = d == TC_DIR_REVERSE;
    if (back != me.back && !player_turn_about(&me, back)) return TP_ERR_FAIL; /* as stock: at rest only */
    tp->reverse_run = d;
    return 0;
}
int tpSetSpindleSync(TP_STRUCT *const tp, int spindle, double sync, int velocity)
{
    tp->synchronized = sync == 0 ? TC_SYNC_NONE : velocity ? TC_SYNC_VELOCITY : TC_SYNC_POSITION;
    tp->spindle.spindle_num = spindle, uu_per_rev = tp->uu_per_rev = sync;
    return 0;
}
int tpSetAout(TP_STRUCT *const tp, unsigned char i, double start, double end)
{
    (void)end;
    tp->syncdio.anychanged = 1, tp->syncdio.aio_mask |= 1ull << i, tp->syncdio.aios[i] = start;
    return 0;
}
int tpSetDout(TP_STRUCT *const tp, int i, unsigned char start, unsigned char end)
{
    (void)end;
    tp->syncdio.anychanged = 1, tp->syncdio.dio_mask |= 1ull << i, tp->syncdio.dios[i] = start ? 1 : -1;
    return 0;
}
int tcqFull(TC_QUEUE_STRUCT const *const q) { (void)q; return w->seg_head - w->seg_done >= DEPTH - MARGIN; }
int tpClear(TP_STRUCT *const tp)
{
    pose_get(&tp->currentPos, me.at);
    drop_all(tp);
    tp->nextId = 0, tp->termCond = TC_TERM_COND_PARABOLIC, tp->tolerance = 0, tp->synchronized = 0, tp->reverse_run = 0;
    stat->motionFlag |= EMCMOT_MOTION_INPOS_BIT;
    sync_clear(&tp->syncdio);
    return 0;
}
int tpCreate(TP_STRUCT *const tp, int size, int id)
{
    double zero[WIRE_AXES] = {0};
    (void)size, (void)id;
    if (!tp || !stat || !w) return TP_ERR_FAIL;
    pose_set(&tp->currentPos, zero);
    tp->vLimit = 0, tp->reverse_run = TC_DIR_FORWARD;
    tp->spindle.waiting_for_index = tp->spindle.waiting_for_atspeed = MOTION_INVALID_ID; /* later 2.9 looks at these */
    return tpClear(tp);
}

int rtapi_app_main(void)
{
    char const *version = getenv("LINUXCNCVERSION");
    int bad = 0;
    if (!version) version = getenv("EMC2VERSION");
    if (!player_version_fits(version)) {
        SAY("made for LinuxCNC 2.9, and this is %s: its planner functions take other arguments\n", version);
        return -1;
    }
    if ((comp = hal_init("splinefeed_tp")) < 0) return comp;
    if ((shm = rtapi_shmem_new(WIRE_KEY, comp, sizeof(wire))) < 0 || rtapi_shmem_getptr(shm, (void **)&w) < 0) {
        SAY("no shared memory of %lu bytes: another program holds key 0x%x; see ipcs -m\n", (unsigned long)sizeof(wire), WIRE_KEY);
        goto fail;
    }
    player_begin(&me, w, 1e-3);
    if (!(pin = hal_malloc(sizeof(*pin)))) goto fail;
    bad |= hal_pin_u32_newf(HAL_OUT, &pin->late, comp, "splinefeed-tp.late");
    bad |= hal_pin_u32_newf(HAL_OUT, &pin->refused, comp, "splinefeed-tp.refused");
    bad |= hal_pin_u32_newf(HAL_OUT, &pin->ns, comp, "splinefeed-tp.ns");
    bad |= hal_pin_u32_newf(HAL_OUT, &pin->ns_max, comp, "splinefeed-tp.ns-max");
    bad |= hal_pin_float_newf(HAL_OUT, &pin->rate, comp, "splinefeed-tp.rate");
    bad |= hal_pin_bit_newf(HAL_OUT, &pin->moving, comp, "splinefeed-tp.moving");
    bad |= hal_pin_bit_newf(HAL_OUT, &pin->fault, comp, "splinefeed-tp.fault");
    bad |= hal_pin_bit_newf(HAL_OUT, &pin->planner, comp, "splinefeed-tp.planner");
    if (bad) goto fail;
    return hal_ready(comp);
fail:
    hal_exit(comp);
    return -1;
}
void rtapi_app_exit(void)
{
    w->magic = 0;
    rtapi_shmem_delete(shm, comp);
    hal_exit(comp);
}
EXPORT_SYMBOL(tpMotFunctions); EXPORT_SYMBOL(tpMotData); EXPORT_SYMBOL(tpAbort); EXPORT_SYMBOL(tpActiveDepth);
EXPORT_SYMBOL(tpAddCircle); EXPORT_SYMBOL(tpAddLine); EXPORT_SYMBOL(tpAddRigidTap); EXPORT_SYMBOL(tpClear);
EXPORT_SYMBOL(tpCreate); EXPORT_SYMBOL(tpGetExecId); EXPORT_SYMBOL(tpGetExecTag); EXPORT_SYMBOL(tpGetMotionType);
EXPORT_SYMBOL(tpGetPos); EXPORT_SYMBOL(tpIsDone); EXPORT_SYMBOL(tpPause); EXPORT_SYMBOL(tpQueueDepth);
EXPORT_SYMBOL(tpResume); EXPORT_SYMBOL(tpRunCycle); EXPORT_SYMBOL(tpSetAmax); EXPORT_SYMBOL(tpSetAout);
EXPORT_SYMBOL(tpSetCycleTime); EXPORT_SYMBOL(tpSetDout); EXPORT_SYMBOL(tpSetId); EXPORT_SYMBOL(tpSetPos);
EXPORT_SYMBOL(tpSetRunDir); EXPORT_SYMBOL(tpSetSpindleSync); EXPORT_SYMBOL(tpSetTermCond);
EXPORT_SYMBOL(tpSetVlimit); EXPORT_SYMBOL(tpSetVmax); EXPORT_SYMBOL(tcqFull);
