/* rigid_step.h: one step of a rigid body's rotation that conserves energy and momentum, in C99 or C++, in double and float.

   The map of S. Krenk and M. B. Nielsen, Rigid Body Time Integration by Convected Base Vectors with Implicit Constraints, COMPDYN
   2013, equations (22) to (26), in three unknowns: order 2, symmetric in time. For a free body, about its centre of mass, or a body
   about a fixed point in uniform gravity. Body axes are the principal axes of the inertia there. Quaternions have the scalar first
   and rotate body components to world components; the third world axis points up. Units: any consistent ones.

       rs_body body = {{13, 5, 10}, {0, 0, 0}};            double; rsf_body and rsf_state are the same in float
       rs_state state = {{1, 0, 0, 0}, {0, 0.25, 100}};    attitude, and angular momentum L = J w in body axes
       int parts = rs_step(&body, 0.01, &state);

   Copyright 2026 the authors of conservative. SPDX-License-Identifier: MIT */

#ifndef RIGID_STEP_H
#define RIGID_STEP_H
#include <float.h>
#include <math.h>

#define RS_REAL double
#define RS(name) rs_##name
#define RS_LIMIT(name) DBL_##name
#include "rigid_step.h" /* in double, then in float */
#undef RS_REAL
#undef RS
#undef RS_LIMIT
#define RS_REAL float
#define RS(name) rsf_##name
#define RS_LIMIT(name) FLT_##name
#include "rigid_step.h"
#undef RS_REAL
#undef RS
#undef RS_LIMIT
#else

typedef struct { RS_REAL J[3], moment[3]; } RS(body); /* moments of inertia; weight times centre of mass, 0 if free: body axes */
typedef struct { RS_REAL q[4], L[3]; } RS(state);     /* attitude; angular momentum in body axes */

static inline RS_REAL RS(dot)(const RS_REAL *x, const RS_REAL *y) { return x[0] * y[0] + x[1] * y[1] + x[2] * y[2]; }

/* z += s x * y, the cross product; z is neither x nor y. */
static inline void RS(cross)(RS_REAL s, const RS_REAL *x, const RS_REAL *y, RS_REAL *z) {
  z[0] += s * (x[1] * y[2] - x[2] * y[1]);
  z[1] += s * (x[2] * y[0] - x[0] * y[2]);
  z[2] += s * (x[0] * y[1] - x[1] * y[0]);
}

/* The world's upward axis in body components. */
static inline void RS(up)(const RS_REAL *q, RS_REAL *g) {
  g[0] = 2 * (q[1] * q[3] - q[0] * q[2]);
  g[1] = 2 * (q[2] * q[3] + q[0] * q[1]);
  g[2] = q[0] * q[0] - q[1] * q[1] - q[2] * q[2] + q[3] * q[3];
}

/* The equation of the step for a, half of its Cayley vector: r = J a + a x (J a) - h/2 (L + h/2 (T - a x T)), without its terms in
   L and J a if `rest` is 0; T, the mean torque in the axes of the start; and the columns K of the derivative of r. */
static inline void RS(equation)(const RS(body) *body, RS_REAL h, const RS_REAL *g, const RS_REAL *L, const RS_REAL *a, int rest,
                                RS_REAL *r, RS_REAL K[3][3]) {
  const RS_REAL *J = body->J, *m = body->moment, s = 1 / (1 + RS(dot)(a, a)), am = RS(dot)(a, m), f = h * h / 4;
  const RS_REAL Ja[3] = {J[0] * a[0], J[1] * a[1], J[2] * a[2]};
  RS_REAL b[3], c[3], p[3], T[3] = {0, 0, 0};
  int i, k;
  for (i = 0; i < 3; i++) b[i] = a[i] * am - m[i] * RS(dot)(a, a);
  RS(cross)(1, a, m, b);
  for (i = 0; i < 3; i++) c[i] = m[i] + s * b[i]; /* mean of the moment at both ends */
  RS(cross)(1, g, c, T);
  for (i = 0; i < 3; i++) p[i] = Ja[i] + f * T[i], r[i] = (rest ? Ja[i] - h / 2 * L[i] : 0) - f * T[i];
  r[0] += (J[2] - J[1]) * a[1] * a[2], r[1] += (J[0] - J[2]) * a[2] * a[0], r[2] += (J[1] - J[0]) * a[0] * a[1];
  RS(cross)(f, a, T, r);
  for (k = 0; k < 3; k++) {
    RS_REAL e[3] = {0, 0, 0}, dc[3], v[3] = {0, 0, 0}; /* the derivative of f T with respect to a[k] is v */
    e[k] = 1;
    for (i = 0; i < 3; i++) dc[i] = s * (e[i] * am + a[i] * m[k] - 2 * a[k] * m[i]) - 2 * s * s * a[k] * b[i];
    RS(cross)(s, e, m, dc);
    RS(cross)(f, g, dc, v);
    for (i = 0; i < 3; i++) K[k][i] = J[k] * e[i] - v[i], v[i] += J[k] * e[i];
    RS(cross)(1, e, p, K[k]);
    RS(cross)(1, a, v, K[k]);
  }
}

/* x = K^-1 r by Cramer's rule; returns the determinant. */
static inline RS_REAL RS(solve)(RS_REAL K[3][3], const RS_REAL *r, RS_REAL *x) {
  RS_REAL n[3][3] = {{0, 0, 0}, {0, 0, 0}, {0, 0, 0}};
  int k;
  for (k = 0; k < 3; k++) RS(cross)(1, K[(k + 1) % 3], K[(k + 2) % 3], n[k]);
  for (k = 0; k < 3; k++) x[k] = RS(dot)(r, n[k]) / RS(dot)(K[0], n[0]);
  return RS(dot)(K[0], n[0]);
}

/* Turn the attitude by the rotation whose Cayley vector is 2 a. */
static inline void RS(turn)(RS_REAL *q, const RS_REAL *a) {
  const RS_REAL w = q[0], x = q[1], y = q[2], z = q[3];
  RS_REAL n;
  q[0] = w - x * a[0] - y * a[1] - z * a[2], q[1] = x + w * a[0] + y * a[2] - z * a[1];
  q[2] = y + w * a[1] + z * a[0] - x * a[2], q[3] = z + w * a[2] + x * a[1] - y * a[0];
  n = 1 / (RS_REAL)sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
  q[0] *= n, q[1] *= n, q[2] *= n, q[3] *= n;
}

/* Take the step. If Newton's method does not converge to the solution that is continuous in h, return 0: the state stays. */
static inline int RS(try)(const RS(body) *body, RS_REAL h, RS(state) *s) {
  const RS_REAL *J = body->J, *L = s->L;
  RS_REAL g[3], a[3], w[3], x[3], r[3], K[3][3], far = 0, det = 0, size = 1, limit = 0;
  int i, n;
  RS(up)(s->q, g);
  for (i = 0; i < 3; i++) w[i] = L[i] / J[i], r[i] = L[i];
  RS(cross)(h / 2, L, w, r);
  RS(cross)(h / 2, g, body->moment, r);
  for (i = 0; i < 3; i++) x[i] = a[i] = h / 2 * r[i] / J[i]; /* first guess: half an explicit step */
  for (n = 0; n < 12 && !(size <= limit); n++) {
    RS(equation)(body, h, g, L, a, 1, r, K);
    det = RS(solve)(K, r, w);
    for (i = 0; i < 3; i++) a[i] -= w[i];
    size = RS(dot)(w, w), limit = RS_LIMIT(EPSILON) * RS(dot)(a, a);
  }
  for (i = 0; i < 3; i++) far += (a[i] - x[i]) * (a[i] - x[i]);
  /* An infinite determinant or limit would make any correction look small. */
  if (!(size <= limit && limit <= RS_LIMIT(MAX) && det > 0 && det <= RS_LIMIT(MAX))) return 0;
  if (!(4 * far <= RS(dot)(a, a) + (RS_REAL)1e-4)) return 0;
  /* The last correction solves for the change of L, so that round-off is not that of L itself and has no mean. */
  RS(equation)(body, h, g, L, a, 0, r, K);
  for (i = 0; i < 3; i++) w[i] = 2 / h * a[i], r[i] = 2 / h * r[i] + (x[i] = J[i] * w[i] - L[i]);
  RS(solve)(K, r, w);
  for (i = 0; i < 3; i++) a[i] -= h / 2 * w[i], s->L[i] += 2 * (x[i] - J[i] * w[i]);
  RS(turn)(s->q, a);
  return 1;
}

/* Whether a state is finite, and L, at least in its largest component, has all digits: at rest it is 0. */
static inline int RS(sound)(const RS(state) *s) {
  const RS_REAL size = (RS_REAL)(fabs(s->L[0]) + fabs(s->L[1]) + fabs(s->L[2]));
  const RS_REAL n = s->q[0] * s->q[0] + s->q[1] * s->q[1] + s->q[2] * s->q[2] + s->q[3] * s->q[3];
  return n > (RS_REAL)0.5 && n < 2 && size <= RS_LIMIT(MAX) && (size == 0 || size >= RS_LIMIT(MIN) / RS_LIMIT(EPSILON));
}

/* Take a step h. Returns in how many parts it was taken: 1, or up to 64 if the step is too long for the map. If that is not
   enough, one explicit step follows, which conserves the momentum of a free body, but not energy, and the result is 0. If even
   that leaves the range of the numbers, the state stays. */
static inline int RS(step)(const RS(body) *body, RS_REAL h, RS(state) *state) {
  const RS_REAL J = body->J[0] > body->J[1] ? body->J[0] : body->J[1];
  RS_REAL g[3], a[3];
  RS(state) s = *state;
  int parts, done, i;
  if (h == 0) return 1;
  if ((J < (RS_REAL)1e-9 || J > (RS_REAL)1e9) && J >= RS_LIMIT(MIN) && J <= RS_LIMIT(MAX)) {
    RS(body) b = *body; /* in a unit of moments in which no product leaves the range: a power of two, which rounds nothing */
    RS_REAL unit;
    frexp(J, &i), unit = (RS_REAL)ldexp(1, -i);
    for (i = 0; i < 3; i++) b.J[i] *= unit, b.moment[i] *= unit, s.L[i] *= unit;
    parts = RS(step)(&b, h, &s);
    for (i = 0; i < 3; i++) s.L[i] /= unit;
    if (!RS(sound)(&s)) return 0;
    *state = s;
    return parts;
  }
  for (parts = 1; parts <= 64; parts *= 2, s = *state) {
    for (done = 0; done < parts && RS(try)(body, h / (RS_REAL)parts, &s); done++) {}
    if (done == parts && RS(sound)(&s)) { *state = s; return parts; }
  }
  RS(up)(s.q, g);
  for (i = 0; i < 3; i++) a[i] = h / 2 * s.L[i] / body->J[i];
  RS(cross)(h, g, body->moment, s.L);
  for (i = 0; i < 3; i++) g[i] = a[i] * RS(dot)(a, s.L) - s.L[i] * RS(dot)(a, a); /* L turned back: L + 2 g / (1 + a.a) */
  RS(cross)(-1, a, s.L, g);
  for (i = 0; i < 3; i++) s.L[i] += 2 * g[i] / (1 + RS(dot)(a, a));
  RS(turn)(s.q, a);
  if (RS(sound)(&s)) *state = s;
  return 0;
}
#endif
