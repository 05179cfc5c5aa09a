/* Free and heavy bodies by RK4, or semi-implicit Euler with -DEULER, in the framing "lines"; in float with -DREAL=float. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#ifndef REAL
#define REAL double
#endif
typedef REAL real;
static real J1, J2, J3, m1, m2, m3, h;

static void derivative(const real *y, real *k) {
  const real a = y[0], b = y[1], c = y[2], d = y[3], x = y[4], v = y[5], z = y[6];
  const real gx = 2 * (a * c - b * d), gy = -2 * (a * b + c * d), gz = b * b + c * c - a * a - d * d;
  k[0] = -(b * x + c * v + d * z) / 2;
  k[1] = (a * x + c * z - d * v) / 2;
  k[2] = (a * v + d * x - b * z) / 2;
  k[3] = (a * z + b * v - c * x) / 2;
  k[4] = ((J2 - J3) * v * z + m2 * gz - m3 * gy) / J1;
  k[5] = ((J3 - J1) * z * x + m3 * gx - m1 * gz) / J2;
  k[6] = ((J1 - J2) * x * v + m1 * gy - m2 * gx) / J3;
}

static void step(real *y) {
  real k[4][7], u[7], n;
  int i;
  derivative(y, k[0]);
#ifdef EULER
  for (i = 4; i < 7; i++) y[i] = y[i] + h * k[0][i];
  derivative(y, k[1]);
  for (i = 0; i < 4; i++) y[i] = y[i] + h * k[1][i];
#else
  for (i = 0; i < 7; i++) u[i] = y[i] + h / 2 * k[0][i];
  derivative(u, k[1]);
  for (i = 0; i < 7; i++) u[i] = y[i] + h / 2 * k[1][i];
  derivative(u, k[2]);
  for (i = 0; i < 7; i++) u[i] = y[i] + h * k[2][i];
  derivative(u, k[3]);
  for (i = 0; i < 7; i++) y[i] = y[i] + h / 6 * (k[0][i] + 2 * k[1][i] + 2 * k[2][i] + k[3][i]);
#endif
  n = sqrt(y[0] * y[0] + y[1] * y[1] + y[2] * y[2] + y[3] * y[3]);
  for (i = 0; i < 4; i++) y[i] = y[i] / n;
}

static double number(const char *line, const char *name, int i) {
  char key[32];
  const char *at;
  snprintf(key, sizeof key, "\"%s\": ", name);
  for (at = strstr(line, key) + strlen(key); i > 0; i--) at += strcspn(at, ",") + 1;
  return strtod(at + strspn(at, "["), NULL);
}

/* Integrate a request so many times. Print `count` numbers of each sample after the first `skip`. */
static void integrate(const char *line, double calls, int skip, int count) {
  const double weight = number(line, "mass", 0) * number(line, "gravity", 0), n_steps = number(line, "n_steps", 0);
  const long every = (long)number(line, "every", 0);
  real y[7];
  long i, n;
  J1 = number(line, "moments", 0), J2 = number(line, "moments", 1), J3 = number(line, "moments", 2);
  m1 = weight * number(line, "com", 0), m2 = weight * number(line, "com", 1), m3 = weight * number(line, "com", 2);
  for (h = number(line, "dt", 0); calls > 0; calls--) {
    for (i = 0; i < 7; i++) y[i] = i < 4 ? number(line, "q0", i) : number(line, "w0", i - 4);
    for (n = 0; n <= n_steps; n++, step(y))
      for (i = 0; i < count && (n % every == 0 || n == n_steps); i++)
        printf("%s%.17g%s", i ? ", " : n ? ", [" : "[", (double)y[skip + i], i == count - 1 ? "]" : "");
  }
}

int main(void) {
  char *line = NULL, **runs = calloc(100000, sizeof *runs);
  size_t room = 0, count = 0;
  for (; getline(&line, &room, stdin) > 0; fflush(stdout)) {
    const char *run = strstr(line, "\"run\":") ? runs[(size_t)number(line, "run", 0)] : NULL;
    struct timespec a, b;
    if (strstr(line, "\"do\": \"hello\""))
      printf("{\"protocol\": 1, \"program\": \"heavy\", \"version\": \"1\", \"framing\": \"lines\", \"engine\": {\"order\": %d,"
             " \"precision\": \"f%d\", \"fields\": [\"UniformGravity\"]}}\n",
#ifdef EULER
             1,
#else
             4,
#endif
             (int)(8 * sizeof(real)));
    else if (strstr(line, "\"do\": \"prepare\""))
      runs[count] = strdup(line), printf("{\"run\": %zu}\n", count), count++;
    else if (strstr(line, "\"do\": \"run\""))
      printf("{\"q\": ["), integrate(run, 1, 0, 4), printf("], \"w\": ["), integrate(run, 1, 4, 3), puts("]}");
    else
      clock_gettime(CLOCK_MONOTONIC, &a), integrate(run, number(line, "calls", 0), 0, 0), clock_gettime(CLOCK_MONOTONIC, &b),
          printf("{\"seconds\": %g}\n", (double)(b.tv_sec - a.tv_sec) + (double)(b.tv_nsec - a.tv_nsec) * 1e-9);
  }
  return 0;
}
