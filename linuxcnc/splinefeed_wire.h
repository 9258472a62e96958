/* SPDX-License-Identifier: MIT
   The shared memory between LinuxCNC's real-time side (splinefeed_tp.c) and the planner process (splinefeed linuxcnc
   planner). It includes nothing. Each field has one writer. 64-bit counters only grow; the place in a ring is the
   counter modulo its size. A counter is stored, with release, after what it counts. All fields are naturally aligned;
   src/splinefeed/live/linuxcnc_wire.py has the same layout. Lengths are machine units, angles degrees, times s. */
#ifndef SPLINEFEED_WIRE_H
#define SPLINEFEED_WIRE_H

#define WIRE_KEY 0x53504c46
#define WIRE_MAGIC 0x53465450
#define WIRE_PROTOCOL 5
#define WIRE_AXES 9      /* x y z a b c u v w */
#define WIRE_JOINTS 6    /* at most that are no axes */
#define WIRE_COLUMNS (WIRE_AXES + WIRE_JOINTS)
#define WIRE_PROBES 12   /* poses at which real time tells these joints */
#define WIRE_SEGMENTS 4096
#define WIRE_PIECES 8192
#define WIRE_BATCHES 512
#define WIRE_TEXT 240

enum { WIRE_LINE = 1, WIRE_ARC = 2 };
enum { WIRE_FREE, WIRE_THREAD, WIRE_TAP }; /* in step with a spindle: G33, G76; G33.1 */
enum { WIRE_WHY_START, WIRE_WHY_LATE, WIRE_WHY_DROPPED, WIRE_WHY_REFUSED };
enum { WIRE_REST, WIRE_MOVES, WIRE_STOPS };

typedef struct {                   /* a move, as tpAddLine or tpAddCircle got it */
    int id, line, kind, canon, turn, enables, atspeed, indexer, term, sync;
    double feed, top, tolerance;   /* asked for; most by the INI file; of G64 P, 0 where none is said */
    double from[WIRE_AXES], to[WIRE_AXES], centre[3], normal[3];
} wire_segment;

typedef struct {                   /* a quintic of each axis over a time */
    double span;                   /* s */
    double scale;                  /* feed or rapid override that it is planned for */
    unsigned long long segment;    /* that it is on */
    double c[WIRE_AXES][6];        /* coefficients of t^0 to t^5 from its start */
} wire_piece;

typedef struct { double c[WIRE_JOINTS][6]; } wire_joints; /* and of each joint that is no axis */

typedef struct {                   /* motion that ends at rest; the next batch branches off behind one of its pieces */
    unsigned long long piece;      /* its first piece */
    unsigned long long after;      /* the piece behind which it follows, unless it begins at rest */
    unsigned long long done;       /* segments that are complete when its last piece ends */
    unsigned int n, sure;          /* pieces; those behind the first `sure` are a stop, to be replaced in time */
    unsigned int epoch, from_rest; /* 0 follows in motion, 1 begins wherever it rests, 2 at rest behind `after` */
    double rate;                   /* rate of time at which it follows and which becomes 1; 0: goes on at any rate */
    double vlimit;                 /* largest feed that it is planned for */
    double at;                     /* time in the piece `after` at which it follows, s: at its end at the latest */
} wire_batch;

typedef struct {
    unsigned int magic, protocol, size, pad0;
    /* written by real time */
    unsigned long long seg_head, seg_clear, seg_done; /* written; dropped by an abort: those before; complete */
    unsigned long long batch_now, batch_seen;         /* played, batches that were looked at */
    unsigned long long piece_now, piece_seen;         /* played, pieces that were copied */
    unsigned int epoch, why, state, piece_i;          /* batches of another epoch are ignored; piece of its batch */
    double period, feed_scale, rapid_scale, vlimit, rate, piece_t; /* piece_t: time in the piece, s */
    double rest[WIRE_AXES];                           /* where it stands */
    double answer[WIRE_PROBES][WIRE_JOINTS];          /* those joints at `probe`, as motion from rest is to begin */
    unsigned long long answered;                      /* session that was answered */
    unsigned int cycles, late, refused, stepping;
    char said[WIRE_TEXT];                             /* why the last batch was refused */
    /* written by the planner */
    unsigned long long batch_head, beat, session;     /* session: another number for each start of a planner, not 0 */
    unsigned long long fault;                         /* counts: the planner cannot go on, and `text` says why */
    double jerk[WIRE_COLUMNS];                        /* limits that it plans under; 0 for an axis that is not there */
    double joint_vmax[WIRE_JOINTS], joint_amax[WIRE_JOINTS]; /* those of joints that are no axes */
    unsigned int joint[WIRE_JOINTS], joints, pad1;    /* their numbers, and how many there are */
    double probe[WIRE_PROBES][WIRE_AXES];
    char text[WIRE_TEXT];
    wire_segment segment[WIRE_SEGMENTS];
    wire_piece piece[WIRE_PIECES];
    wire_batch batch[WIRE_BATCHES];
    wire_joints joints_of[WIRE_PIECES];               /* pieces */
} wire;
#endif
