/* rigid_step.h as a program for references/PROTOCOL.md, in the framing "lines".

       cc -O2 -o rigid_step references/for_engine_authors/program.c -lm
       conservative engines add ./rigid_step
       conservative run brick_flip --method rigid_step */

#define _POSIX_C_SOURCE 200809L
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "rigid_step.h"

typedef struct { rs_body body; rs_state start; double dt; int single, n_steps, n_samples; long *steps; double *samples; } run;

/* Read the numbers of a field, at most `count`, and return how many there are. */
static int numbers(const char *line, const char *name, double *out, int count) {
  char key[32], *end;
  const char *at;
  int n = 0;
  snprintf(key, sizeof key, "\"%s\":", name);
  if (!(at = strstr(line, key))) return 0;
  for (at += strlen(key); n < count && *at && *at != ']' && *at != '}'; at = end) {
    at += strspn(at, " [,");
    out[n] = strtod(at, &end);
    if (end == at) break;
    n++;
  }
  return n;
}

/* Integrate; samples are q and w, seven numbers each. In float if asked for: only the results are converted. */
#define INTEGRATE(prefix, real)                                                                                                   \
  {                                                                                                                                \
    prefix##_body body;                                                                                                            \
    prefix##_state s;                                                                                                              \
    for (i = 0; i < 3; i++) body.J[i] = (real)r->body.J[i], body.moment[i] = (real)r->body.moment[i];                              \
    for (i = 0; i < 4; i++) s.q[i] = (real)r->start.q[i];                                                                          \
    for (i = 0; i < 3; i++) s.L[i] = (real)r->start.L[i];                                                                          \
    for (n = 0; n <= r->n_steps; n++) {                                                                                            \
      if (sample < r->n_samples && n == r->steps[sample]) {                                                                        \
        for (i = 0; i < 7; i++) r->samples[7 * sample + i] = i < 4 ? s.q[i] : s.L[i - 4] / body.J[i - 4];                          \
        sample++;                                                                                                                  \
      }                                                                                                                            \
      if (n < r->n_steps) prefix##_step(&body, (real)r->dt, &s);                                                                   \
    }                                                                                                                              \
  }

static void integrate(run *r) {
  int i, n, sample = 0;
  if (r->single) INTEGRATE(rsf, float) else INTEGRATE(rs, double)
}

static void print(const char *name, const run *r, int first, int count) {
  int i, k;
  printf("\"%s\": [", name);
  for (k = 0; k < r->n_samples; k++)
    for (i = 0; i < count; i++)
      printf("%s%.17g%s", i ? ", " : k ? ", [" : "[", r->samples[7 * k + first + i], i == count - 1 ? "]" : "");
  printf("]");
}

static double seconds(void) {
  struct timespec t;
  clock_gettime(CLOCK_MONOTONIC, &t);
  return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

int main(void) {
  char *line = NULL;
  size_t size = 0;
  run *runs = NULL;
  int count = 0, i;
  while (getline(&line, &size, stdin) > 0) {
    double x[9] = {0}, start;
    run *r = numbers(line, "run", x, 1) && x[0] >= 1 && x[0] <= count ? &runs[(int)x[0] - 1] : NULL;
    if (strstr(line, "\"do\": \"hello\"")) {
      printf("{\"protocol\": 1, \"program\": \"rigid_step\", \"version\": \"1\", \"framing\": \"lines\", \"engine\": {\"order\": 2,"
             " \"settings\": {\"precision\": \"f64\"}, \"choices\": {\"precision\": [\"f64\", \"f32\"]}, \"fields\":"
             " [\"UniformGravity\"]}}");
    } else if (strstr(line, "\"do\": \"prepare\"")) {
      double mass = 0, gravity = 0, com[3] = {0}, *steps = malloc(line ? (strlen(line) + 1) * sizeof *steps : 0);
      runs = realloc(runs, (size_t)(count + 1) * sizeof *runs);
      r = &runs[count++];
      numbers(line, "moments", r->body.J, 3), numbers(line, "q0", r->start.q, 4), numbers(line, "w0", x, 3);
      for (i = 0; i < 3; i++) r->start.L[i] = r->body.J[i] * x[i];
      numbers(line, "mass", &mass, 1), numbers(line, "gravity", &gravity, 1), numbers(line, "com", com, 3);
      for (i = 0; i < 3; i++) r->body.moment[i] = strstr(line, "\"free\": true") ? 0 : mass * gravity * com[i];
      numbers(line, "dt", &r->dt, 1), numbers(line, "n_steps", x, 1);
      r->n_steps = (int)x[0], r->single = strstr(line, "\"f32\"") != NULL;
      r->n_samples = numbers(line, "steps", steps, (int)strlen(line));
      r->steps = malloc((size_t)r->n_samples * sizeof *r->steps);
      r->samples = malloc(7 * (size_t)r->n_samples * sizeof *r->samples);
      for (i = 0; i < r->n_samples; i++) r->steps[i] = (long)steps[i];
      free(steps);
      printf("{\"run\": %d}", count);
    } else if (strstr(line, "\"do\": \"run\"") && r) {
      integrate(r);
      printf("{"), print("q", r, 0, 4), printf(", "), print("w", r, 4, 3), printf("}");
    } else if (strstr(line, "\"do\": \"time\"") && r && numbers(line, "calls", x, 1)) {
      for (start = seconds(); seconds() - start < 0.02;) integrate(r);
      for (start = seconds(), i = 0; i < (int)x[0]; i++) integrate(r);
      printf("{\"seconds\": %.9g}", seconds() - start);
    } else if (strstr(line, "\"do\": \"check\"")) {
      printf("{}");
    } else {
      printf("{\"error\": \"unsupported\", \"message\": \"one body at a time, in the framing lines\"}");
    }
    printf("\n"), fflush(stdout);
  }
  return 0;
}
