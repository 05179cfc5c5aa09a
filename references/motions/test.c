/* Exact motions as a test of your engine: fill in `simulate`, then   cc -std=c99 test.c -lm && ./a.out *.csv   (CC0) */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#define ORDER 2    /* the order of your integrator: 1, 2 or 4 */
#define ANGLE 0.01 /* |w| h, rad: 0.1, 0.03 or 0.01 */
#define SINGLE 0   /* 1 for single precision */
#define HAS "rotor,torque,damping,fixed point,orbit" /* motions that need anything else are skipped */

static char line[99][2048]; /* the lines of a motion: a key, and its values */
static int lines;

/* Read the values of the n-th line of a key; return 0 if there is none. */
static int get(const char *key, int n, double *out) {
  size_t size = strlen(key);
  for (int i = 0; i < lines; i++)
    if (!strncmp(line[i], key, size) && line[i][size] == ',' && n-- == 0) {
      for (char *at = line[i] + size; at; at = strchr(at + 1, ',')) *out++ = strtod(at + 1, NULL);
      return 1;
    }
  return 0;
}

/* YOUR ENGINE: set up the body of the motion, take `steps` steps of h seconds before each sample, and store there the
   quaternion (scalar first, body to world) and the rates in body axes, rad/s. */
static void simulate(double h, int steps, int samples, double state[][7]) {
  double inertia_B[9], q[4], w[3];
  get("inertia_B", 0, inertia_B), get("quaternion_wxyz0", 0, q), get("w_WB_B0", 0, w);
  for (int i = 0; i < samples; i++) {
    for (int n = 0; n < steps; n++) (void)h; /* one step */
    memcpy(state[i], q, sizeof q), memcpy(state[i] + 4, w, sizeof w);
  }
}
/* END */

/* World components of v. */
static void rotate(const double *q, const double *v, double *out) {
  for (int i = 0; i < 3; i++) {
    int j = (i + 1) % 3, k = (i + 2) % 3;
    double a = q[1 + j] * v[k] - q[1 + k] * v[j], b = q[1 + k] * v[i] - q[1 + i] * v[k], c = q[1 + i] * v[j] - q[1 + j] * v[i];
    out[i] = v[i] + 2 * (q[0] * a + q[1 + j] * c - q[1 + k] * b);
  }
}

/* Errors of attitude (rad), rates, energy and momentum, relative to the scales of the motion. */
static void errors(const double *exact, const double *y, double *e) {
  double J[9], h[3] = {0}, weight = 0, com[3] = {0}, scale[3], L[3], l[3], up[3], E = 0, apart[2] = {0}, dw = 0, dl = 0;
  get("inertia_B", 0, J), get("rotor_momentum_B", 0, h), get("weight", 0, &weight), get("com_B", 0, com), get("scale", 0, scale);
  for (int i = 0; i < 3; i++) {
    L[i] = J[3 * i] * y[4] + J[3 * i + 1] * y[5] + J[3 * i + 2] * y[6];
    E += L[i] * y[4 + i] / 2, L[i] += h[i], dw += pow(y[4 + i] - exact[14 + i], 2);
  }
  rotate(y, L, l), rotate(y, com, up);
  for (int i = 0; i < 3; i++) dl += pow(l[i] - exact[21 + i], 2);
  for (int i = 0; i < 4; i++) apart[0] += pow(y[i] - exact[10 + i], 2), apart[1] += pow(y[i] + exact[10 + i], 2);
  e[0] = 4 * asin(fmin(1, sqrt(fmin(apart[0], apart[1])) / 2)), e[1] = sqrt(dw) / scale[0];
  e[2] = fabs(E + weight * up[2] - exact[20]) / scale[1], e[3] = sqrt(dl) / scale[2];
}

int main(int argc, char **argv) {
  const char *names[] = {"attitude", "rates", "energy", "momentum"};
  int failed = 0, k, n, samples;
  for (int f = 1; f < argc; f++) {
    double allowed[9] = {0}, single, exact[24], state[20][7], e[4], worst[4] = {0}, known[8], best = 0.5;
    const char *mistake = "; no mistake of the list does this", *quote = "";
    FILE *file = fopen(argv[f], "r");
    for (lines = 0; file && fgets(line[lines], sizeof *line, file); lines++) line[lines][strcspn(line[lines], "\r\n")] = 0;
    if (file) fclose(file);
    char needs[99], *need;
    strcpy(needs, lines > 3 ? line[3] : "no such file");
    for (strtok(needs, ","); (need = strtok(NULL, ",")) && strstr(HAS, need);) {}
    if (need) { printf("%s: skipped, it needs %s\n", argv[f], need); continue; }
    for (n = 0; get("tolerance", n, allowed) && (allowed[0] != ORDER || allowed[1] != ANGLE); n++) {}
    for (samples = 0; get("sample", samples, exact); samples++) {}
    get("sample", 0, exact), get("single", 0, &single), simulate(exact[0] / allowed[2], (int)allowed[2], samples, state);
    for (n = 0; get("sample", n, exact); n++)
      for (errors(exact, state[n], e), k = 0; k < 4; k++) worst[k] = e[k] <= worst[k] ? worst[k] : isnan(e[k]) ? HUGE_VAL : e[k];
    double *limit = allowed + 3;
    int most = 0;
    for (k = 0; k < 4; k++) limit[k] += SINGLE * single, most = worst[k] / limit[k] > worst[most] / limit[most] ? k : most;
    if (worst[most] <= limit[most]) continue;
    for (n = 0; get("catches", n, known); n++) {
      double apart = 0;
      for (k = 0; k < 4; k++) apart += pow(log(fmax(worst[k], limit[k]) / fmax(known[4 + k], limit[k])), 2);
      for (k = 0; k < lines && strncmp(line[k], "catches,", 8); k++) {}
      if (apart < best) best = apart, quote = "; this is what a program does with: ", mistake = line[k + n] + 8;
    }
    printf("%s: %s error %.1e, tolerance %.1e%s%.*s\n", argv[f], names[most], worst[most], limit[most], quote,
           *quote ? (int)strcspn(mistake, ",") : 99, mistake);
    failed++;
  }
  printf("%d of %d motions failed\n", failed, argc - 1);
  return failed > 0;
}
