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

/* The largest errors with so many steps before each sample. */
static void worst(int steps, double *out) {
  double exact[24], state[20][7], e[4];
  int n, samples = 0;
  while (get("sample", samples, exact)) samples++;
  get("sample", 0, exact), simulate(exact[0] / steps, steps, samples, state);
  memset(out, 0, 4 * sizeof *out);
  for (n = 0; get("sample", n, exact); n++) {
    errors(exact, state[n], e);
    for (int k = 0; k < 4; k++) out[k] = e[k] <= out[k] ? out[k] : isnan(e[k]) ? HUGE_VAL : e[k];
  }
}

#define NEAR 0.8 /* sum of the squares of four logarithms, of errors over those of a mistake that explains them */
static char mistakes[200][48];           /* their names */
static double apart[999][200];           /* of each motion that fails and mistake: the distance, NEAR if it does not explain it */
static double falls[999];                /* the exponent with which the error falls with the step */
static const char *failing[999];
static int known = 0, failed = 0;

static int compare(const void *a, const void *b) { return (*(const double *)a > *(const double *)b) - (*(const double *)a < *(const double *)b); }

/* Print the mistakes that explain most of the failing motions, and the order if it is lower than declared. */
static void summary(void) {
  int left = failed, explained[999] = {0};
  for (int round = 0; round < 3; round++) {
    int best = -1, most = 0;
    double least = 0;
    for (int n = 0; n < known; n++) {
      int votes = 0;
      double sum = 0;
      for (int f = 0; f < failed; f++) if (!explained[f] && apart[f][n] < NEAR) votes++, sum += apart[f][n];
      if (votes > most || (votes && votes == most && sum < least)) best = n, most = votes, least = sum;
    }
    if (best < 0 || 10 * most < failed) break;
    printf("\"%s\" explains %d of them\n", mistakes[best], most), left -= most;
    for (int f = 0; f < failed; f++) explained[f] |= apart[f][best] < NEAR;
  }
  double sorted[999];
  memcpy(sorted, falls, sizeof falls), qsort(sorted, failed, sizeof *sorted, compare);
  double order = sorted[failed / 2];
  if (2 * left > failed && order >= 0.5 && order < ORDER - 0.5) printf("this program has order %.1f, %d was declared\n", order, ORDER);
  if (!left) return;
  printf("%d not explained by a mistake of the list:", left);
  for (int f = 0, n = 0; f < failed && n < 5; f++) if (!explained[f]) printf("%s %s", n++ ? "," : "", failing[f]);
  printf("\n");
}

int main(int argc, char **argv) {
  const char *names[] = {"attitude", "rates", "energy", "momentum"};
  int tested = 0;
  for (int f = 1; f < argc; f++) {
    double allowed[9] = {0}, single, found[4], half[4], values[5];
    FILE *file = fopen(argv[f], "r");
    for (lines = 0; file && fgets(line[lines], sizeof *line, file); lines++) line[lines][strcspn(line[lines], "\r\n")] = 0;
    if (file) fclose(file);
    char features[99], *feature;
    strcpy(features, lines > 3 ? line[3] : "no such file");
    for (strtok(features, ","); (feature = strtok(NULL, ",")) && strstr(HAS, feature);) {}
    if (feature) { printf("%s: skipped, it has %s\n", argv[f], feature); continue; }
    tested++;
    int n, k, most = 0, near = 0, first = 0;
    for (n = 0; get("tolerance", n, allowed) && (allowed[0] != ORDER || allowed[1] != ANGLE); n++) {}
    double *limit = allowed + 3;
    get("single", 0, &single), worst((int)allowed[2], found);
    for (k = 0; k < 4; k++) limit[k] += SINGLE * single, most = found[k] / limit[k] > found[most] / limit[most] ? k : most;
    double ratio = found[most] / limit[most];
    if (ratio <= 1) continue;
    while (first < lines && strncmp(line[first], "catches,", 8)) first++;
    for (n = 0; n < 200; n++) apart[failed][n] = NEAR;
    for (n = 0; get("catches", n, values); n++) {
      char name[48];
      double sum = 0;
      for (k = 0; k < 4; k++) sum += pow(log(fmax(found[k], limit[k]) / fmax(values[1 + k], limit[k])), 2);
      if (sum >= NEAR || known == 200) continue;
      snprintf(name, sizeof name, "%.*s", (int)strcspn(line[first + n] + 8, ","), line[first + n] + 8);
      for (k = 0; k < known && strcmp(mistakes[k], name); k++) {}
      if (k == known) strcpy(mistakes[known++], name);
      apart[failed][k] = sum, near++;
    }
    worst(2 * (int)allowed[2], half);
    falls[failed] = found[most] < HUGE_VAL && half[most] > 0 ? log(found[most] / half[most]) / log(2) : 0;
    printf("%s: %s error %.1e, tolerance %.1e", argv[f], names[most], found[most], limit[most]);
    if (falls[failed] >= ORDER - 0.5 && (ratio <= 2 || !near)) {
      printf(": %.0f %% above the tolerance, falls as h^%.1f: right\n", 100 * (ratio - 1), falls[failed]);
      continue;
    }
    printf("\n"), failing[failed++] = argv[f];
  }
  printf("%d of %d motions failed\n", failed, tested);
  if (failed) summary();
  return failed > 0;
}
