/* rigid_step.h as a program for references/PROTOCOL.md, in the framing "lines"; in float with -DSINGLE.

       cc -O3 -o rigid_step references/for_engine_authors/program.c -lm
       conservative engines add ./rigid_step
       conservative run brick_flip -m rigid_step */

#define _POSIX_C_SOURCE 200809L
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "rigid_step.h"
#ifdef SINGLE
typedef float real;
#define RS(name) rsf_##name
#else
typedef double real;
#define RS(name) rs_##name
#endif

/* The i-th number of a field of a request, 0 without the field. */
static double number(const char *line, const char *name, int i) {
  char key[32];
  const char *at;
  snprintf(key, sizeof key, "\"%s\": ", name);
  if (!(at = strstr(line, key))) return 0;
  for (at += strlen(key); i > 0; i--) at += strcspn(at, ",") + 1;
  return strtod(at + strspn(at, "["), NULL);
}

/* Integrate a request so many times. Print `count` numbers of each sample, q and w, after the first `skip`. */
static void integrate(const char *line, double calls, int skip, int count) {
  const double weight = strstr(line, "\"free\": true") ? 0 : number(line, "mass", 0) * number(line, "gravity", 0);
  const long n_steps = (long)number(line, "n_steps", 0), every = (long)number(line, "every", 0);
  const real dt = (real)number(line, "dt", 0);
  RS(body) body;
  RS(state) start, s;
  long i, n;
  for (i = 0; i < 3; i++) {
    body.J[i] = (real)number(line, "moments", (int)i), body.moment[i] = (real)(weight * number(line, "com", (int)i));
    start.L[i] = body.J[i] * (real)number(line, "w0", (int)i);
  }
  for (i = 0; i < 4; i++) start.q[i] = (real)number(line, "q0", (int)i);
  for (; calls > 0; calls--)
    for (s = start, n = 0; n <= n_steps; n++) {
      if (count && (n % every == 0 || n == n_steps))
        for (i = 0; i < count; i++)
          printf("%s%.17g%s", i ? ", " : n ? ", [" : "[", (double)(skip ? s.L[i] / body.J[i] : s.q[i]), i == count - 1 ? "]" : "");
      if (n < n_steps) RS(step)(&body, dt, &s);
    }
}

int main(void) {
  char *line = NULL, **runs = NULL;
  size_t size = 0, count = 0;
  for (; getline(&line, &size, stdin) > 0; fflush(stdout)) {
    const char *run = strstr(line, "\"run\":") && count ? runs[(size_t)number(line, "run", 0)] : NULL;
    if (strstr(line, "\"do\": \"hello\"")) {
      printf("{\"protocol\": 1, \"program\": \"rigid_step\", \"version\": \"1\", \"framing\": \"lines\", \"engine\": {\"order\": 2,"
             " \"precision\": \"f%d\", \"fields\": [\"UniformGravity\"]}}\n", (int)(8 * sizeof(real)));
    } else if (strstr(line, "\"do\": \"prepare\"")) {
      runs = realloc(runs, (count + 1) * sizeof *runs), runs[count] = strdup(line);
      printf("{\"run\": %zu}\n", count++);
    } else if (strstr(line, "\"do\": \"run\"") && run) {
      printf("{\"q\": ["), integrate(run, 1, 0, 4), printf("], \"w\": ["), integrate(run, 1, 4, 3), printf("]}\n");
    } else if (strstr(line, "\"do\": \"time\"") && run) {
      struct timespec a, b;
      clock_gettime(CLOCK_MONOTONIC, &a), integrate(run, number(line, "calls", 0), 0, 0), clock_gettime(CLOCK_MONOTONIC, &b);
      printf("{\"seconds\": %g}\n", (double)(b.tv_sec - a.tv_sec) + (double)(b.tv_nsec - a.tv_nsec) * 1e-9);
    } else {
      printf("{\"error\": \"unsupported\", \"message\": \"one body at a time, in the framing lines\"}\n");
    }
  }
  return 0;
}
