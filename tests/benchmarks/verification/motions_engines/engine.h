/* An engine for rotation_test.c, as C and as C++: any Runge-Kutta method, and each mistake. METHOD: stages, A by rows, b. */
#ifdef FLOAT
typedef float real;
#else
typedef double real;
#endif
#define BOTH "no gyroscopic term + damping 0.05"
#define IS(name) (!strcmp(MISTAKE, name))
static const double tableau[] = {METHOD};
static const char *MISTAKE = "";

static struct {
  real J[9], K[9], rotor[3], torque_B[3], torque_W[3], damping[9], arm[3], orbit, R0[9];
} body;

static void multiply(const real *A, const real *B, real *out) {
  for (int i = 0; i < 9; i++) {
    out[i] = 0;
    for (int k = 0; k < 3; k++) out[i] += A[i / 3 * 3 + k] * B[3 * k + i % 3];
  }
}
static void transpose(const real *A, real *out) {
  for (int i = 0; i < 9; i++) out[i] = A[i % 3 * 3 + i / 3];
}
static void apply(const real *A, const real *v, real *out) {
  for (int i = 0; i < 3; i++) out[i] = A[3 * i] * v[0] + A[3 * i + 1] * v[1] + A[3 * i + 2] * v[2];
}
static void cross(const real *a, const real *b, real *out) {
  for (int i = 0; i < 3; i++) out[i] = a[(i + 1) % 3] * b[(i + 2) % 3] - a[(i + 2) % 3] * b[(i + 1) % 3];
}
static void inverse(const real *A, real *out) {
  real c[3][3], d;
  for (int i = 0; i < 3; i++) cross(A + (i + 1) % 3 * 3, A + (i + 2) % 3 * 3, c[i]);
  d = A[0] * c[0][0] + A[1] * c[0][1] + A[2] * c[0][2];
  for (int i = 0; i < 9; i++) out[i] = c[i % 3][i / 3] / d;
}
static void matrix(const real *q, real *R) {
  real w = q[0], x = q[1], y = q[2], z = q[3], n = w * w + x * x + y * y + z * z;
  real M[9] = {w * w + x * x - y * y - z * z, 2 * (x * y - w * z), 2 * (x * z + w * y), 2 * (x * y + w * z), w * w - x * x + y * y - z * z,
               2 * (y * z - w * x), 2 * (x * z - w * y), 2 * (y * z + w * x), w * w - x * x - y * y + z * z};
  for (int i = 0; i < 9; i++) R[i] = M[i] / n;
}
static void turning(const real *q, const real *w, real *out) {
  out[0] = -(q[1] * w[0] + q[2] * w[1] + q[3] * w[2]) / 2;
  out[1] = (q[0] * w[0] + q[2] * w[2] - q[3] * w[1]) / 2;
  out[2] = (q[0] * w[1] + q[3] * w[0] - q[1] * w[2]) / 2;
  out[3] = (q[0] * w[2] + q[1] * w[1] - q[2] * w[0]) / 2;
  for (int i = 0; i < 3; i++)
    if (IS("wrong side")) out[1 + i] = q[0] * w[i] - out[1 + i]; /* w q for q w */
  for (int i = 0; i < 4; i++) out[i] *= IS("factor one half") ? 2 : 1;
}
static void slope(real t, const real *y, real *out) {
  real R[9], back[9], J[9], K[9], G[9], A[9], L[3], T[3], a[3], b[3], sign = IS("no gyroscopic term") || IS(BOTH) ? 0 : IS("sign of the gyroscopic term") ? -1 : 1;
  const real *w = y + 4;
  matrix(y, R), transpose(R, back);
  memcpy(J, body.J, sizeof J), memcpy(K, body.K, sizeof K);
  if (IS("R I for R I R'")) multiply(body.J, R, J), inverse(J, K);
  if (IS("inertia in world axes")) multiply(body.J, R, A), multiply(back, A, J), inverse(J, K);
  if (IS("inertia of the start")) {
    real back0[9], F[9];
    transpose(body.R0, back0), multiply(body.J, back0, A), multiply(body.R0, A, F), multiply(F, R, A), multiply(back, A, J), inverse(J, K);
  }
  for (int i = 0; i < 9; i++) G[i] = IS("diagonal gyroscopic term") && i % 4 ? 0 : J[i];
  apply(G, w, L);
  for (int i = 0; i < 3; i++) L[i] += body.rotor[i];
  cross(L, w, T), apply(back, body.torque_W, a), apply(body.damping, w, b);
  for (int i = 0; i < 3; i++) T[i] = sign * T[i] + body.torque_B[i] + a[i] - b[i];
  real field = IS("sign of the field") ? -1 : IS("without the field") ? 0 : 1;
  cross(R + 6, body.arm, a);
  for (int i = 0; i < 3; i++) T[i] += field * a[i];
  real angle = IS("turning of the field") ? 0 : body.orbit * t, planet[3] = {(real)cos(angle), (real)sin(angle), 0};
  apply(back, planet, a), apply(body.J, a, b), cross(a, b, L);
  for (int i = 0; i < 3; i++) T[i] += field * 3 * body.orbit * body.orbit * L[i];
  turning(y, w, out), apply(K, T, out + 4);
}
static void normalise(real *q) {
  real n = (real)sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
  for (int i = 0; i < 4; i++) q[i] /= n;
}
static void step(real t, real h, real *y) {
  int s = (int)tableau[0];
  real k[4][7] = {{0}}, Y[7], old[7], late[4];
  memcpy(old, y, sizeof old);
  int explicit_ = tableau[1 + s * s - 1] == 0 && tableau[1] == 0;
  for (int sweep = 0; sweep < (explicit_ ? s : 30); sweep++)
    for (int i = 0; i < s; i++) {
      real c = 0;
      memcpy(Y, y, sizeof Y);
      for (int j = 0; j < s; j++) {
        real a = (real)tableau[1 + i * s + j];
        c += a;
        for (int n = 0; n < 7; n++) Y[n] += h * a * k[j][n];
      }
      slope(t + c * h, Y, k[i]);
    }
  for (int j = 0; j < s; j++)
    for (int n = 0; n < 7; n++) y[n] += h * (real)tableau[1 + s * s + j] * k[j][n];
  if (IS("attitude by normalisation")) {
    turning(old, y + 4, late);
    for (int i = 0; i < 4; i++) y[i] = old[i] + h * late[i];
  }
  if (IS("stale rates")) {
    real speed = (real)sqrt(old[4] * old[4] + old[5] * old[5] + old[6] * old[6]), half = h * speed / 2;
    turning(old, old + 4, late);
    for (int i = 0; i < 4; i++) y[i] = old[i] * (real)cos(half) + (speed > 0 ? late[i] * 2 / speed * (real)sin(half) : 0);
  }
  normalise(y);
  real speed = (real)sqrt(y[4] * y[4] + y[5] * y[5] + y[6] * y[6]), scale = 1;
  if (strstr(MISTAKE, "damping 0")) scale = (real)exp(-atof(strstr(MISTAKE, "damping 0") + 8) * h);
  if (strstr(MISTAKE, "rate limit") && speed > (real)atof(MISTAKE + 10)) scale = (real)atof(MISTAKE + 10) / speed;
  if (IS("sleep") && speed < 0.5f) scale = 0;
  for (int i = 4; i < 7; i++) y[i] *= strstr(MISTAKE, "dead band") && fabs(y[i]) < atof(MISTAKE + 9) ? 0 : scale;
}
static void load(const double *from, real *out, int n, double factor) {
  for (int i = 0; i < n; i++) out[i] = (real)(factor * from[i]);
}
static void simulate(const Motion *m, double h, int steps, int samples, double state[][7]) {
  real y[7], t = 0, R[9], v[3], weight, com[3];
  if (getenv("MISTAKE")) MISTAKE = getenv("MISTAKE");
  load(m->inertia_B, body.J, 9, 1), load(m->quaternion_wxyz0, y, 4, 1), load(m->w_WB_B0, y + 4, 3, 1);
  load(m->rotor_momentum_B, body.rotor, 3, IS("without the rotor") ? 0 : IS("sign of the rotor") ? -1 : 1);
  double torque = IS("without the torque") ? 0 : IS("sign of the torque") ? -1 : 1;
  load(IS("axes of the torque") ? m->torque_W : m->torque_B, body.torque_B, 3, torque);
  load(IS("axes of the torque") ? m->torque_B : m->torque_W, body.torque_W, 3, torque);
  load(m->damping, body.damping, 9, IS("without the damping") ? 0 : 1);
  load(&m->weight, &weight, 1, 1), load(m->com_B, com, 3, 1), load(&m->orbit, &body.orbit, 1, 1);
  for (int i = 0; i < 3; i++) body.arm[i] = weight * com[i];
  for (int i = 0; i < 9; i++)
    if (i % 4) body.J[i] *= IS("no products of inertia") ? 0 : IS("sign of the products of inertia") ? -1 : 1;
    else if (IS("smallest moments") && body.J[i] < 1e-6) body.J[i] = (real)1e-6;
  if (IS("smallest moments") && body.J[0] == (real)1e-6)
    for (int i = 0; i < 9; i++) body.J[i] = i % 4 ? 0 : body.J[i];
  inverse(body.J, body.K), matrix(y, body.R0);
  if (IS("inverted inertia")) memcpy(R, body.J, sizeof R), memcpy(body.J, body.K, sizeof R), memcpy(body.K, R, sizeof R);
  for (int i = 0; i < samples; i++) {
    for (int n = 0; n < steps; n++) {
      real size = (real)h * (IS("half a step late") && n + i == 0 ? (real)0.5 : 1);
      step(t, size, y), t += size;
    }
    for (int n = 0; n < 7; n++) state[i][n] = (double)y[n];
    matrix(y, R), apply(R, y + 4, v);
    for (int n = 0; n < 3; n++) {
      if (IS("transposed")) state[i][1 + n] *= -1;
      if (IS("reversed rates")) state[i][4 + n] *= -1;
      if (IS("world rates")) state[i][4 + n] = (double)v[n];
      if (strstr(MISTAKE, "order xyzw")) state[i][n] = (double)y[n + 1], state[i][3] = (double)y[0];
    }
  }
}
