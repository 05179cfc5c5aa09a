/* Exact rotations as a test of your engine, in C or C++ (CC0). Fill in `simulate`, then
     cc rotation_test.c -lm && ./a.out         or, in C++, with the same file,         c++ rotation_test.cpp && ./a.out
   With ./a.out --record known.txt, today's errors become known errors: a later run fails only if a motion gets worse. */

/* Include your engine here, and GoogleTest, Catch2 or doctest, if you use one: it then runs the test. */
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#ifdef __cplusplus
namespace exact_rotations {
#endif

enum { ORDER = 2, /* the order of your integrator: 1, 2 or 4 (2 for order 3) */
       SINGLE = 0 /* 1 for single precision */ };
static const double ANGLE = 0.01; /* |w| h in rad; 0.03 and 0.1 with the files of all motions */
static const char HAS[] = "";     /* what `simulate` reads of `m`: "rotor, torque, damping, fixed point, orbit"; other motions are skipped */

typedef struct { /* SI units; inertia about the centre of mass or the fixed point; quaternions have the scalar first, body to world */
  double inertia_B[9], quaternion_wxyz0[4], w_WB_B0[3];
  double rotor_momentum_B[3], torque_B[3], torque_W[3], damping[9], weight, com_B[3], orbit;
  char name[48], features[64];
  double scale[3], single, tolerance[9][8], sample[24][8], catches[128][4];
  int tolerances, samples, caught[128]; /* the number of errors in `catches` */
} Motion;

/* YOUR ENGINE: set up the body of the motion, take `steps` steps of h seconds before each sample, and store there the
   quaternion (scalar first, body to world) and the rates in body axes, rad/s. */
static void simulate(const Motion *m, double h, int steps, int samples, double state[][7]) {
  for (int i = 0; i < samples; i++) {
    for (int n = 0; n < steps; n++) (void)h; /* one step */
    for (int k = 0; k < 7; k++) state[i][k] = k < 4 ? m->quaternion_wxyz0[k] : m->w_WB_B0[k - 4];
  }
}
/* END */

#define NEAR_ENOUGH 0.2 /* mean square of logarithms: errors over the errors of a mistake that explains them */
#define LARGE 0.08      /* errors that show two mistakes */
#define LARGEST 1e6     /* instead of errors that are not finite */
#define UNSET 1.2345e300 /* a number that `simulate` has not stored */
#define FEATURES "rotor, torque, damping, fixed point, orbit"
#define HEADER "# Known errors on exact motions. A later run fails if a motion is worse or has another mistake. Written by --record."
enum { MOST = 128 };
typedef struct {
  const Motion *motion;
  double found[4], limit[4], apart[MOST], order, above, falls; /* apart: distances of mistakes, -1 if they do not explain it */
  int most, failed, near, mistake;                             /* the largest error, the number of explanations, the named one or -1 */
  int fresh, same, worse[2], lower[2];                         /* against known errors: fresh for a new failure, same for the mistake */
  struct Known *was;
} Result;
typedef struct Known { char name[48], mistake[48]; double error[2]; int seen, count; } Known;
static Motion motions[MOST];
static Result results[MOST];
static Known known[2 * MOST];
static char mistakes[MOST][48], then[64], now[64];
static int motion_count, result_count, known_count, mistake_count;

static int refuse(const char *format, ...) {
  va_list values;
  va_start(values, format), vprintf(format, values), va_end(values), printf("\n");
  return 0;
}

/* Copy a field of a line, up to one of the characters `ends`; return what follows. */
static const char *copy_field(char *to, size_t size, const char *at, const char *ends) {
  size_t n = strcspn(at, ends), fits = n < size ? n : size - 1;
  memcpy(to, at, fits), to[fits] = 0;
  return at[n] ? at + n + 1 : at + n;
}

/* Whether a list as in `HAS` has a part. */
static int has(const char *list, const char *part) {
  char each[64];
  while (*list) {
    list = copy_field(each, sizeof each, list + strspn(list, " "), ",");
    if (!strcmp(each, part)) return 1;
  }
  return 0;
}

/* Return what follows a key and a comma, or NULL if the line has another key. */
static const char *values_of(const char *line, const char *key) {
  size_t n = strlen(key);
  return !strncmp(line, key, n) && line[n] == ',' ? line + n + 1 : NULL;
}

static int numbers(const char *at, char between, double *out, int most) {
  char *end;
  for (int n = 0; n < most; n++, at = end + 1) {
    out[n] = strtod(at, &end);
    if (end == at) return n;
    if (*end != between) return n + 1;
  }
  return most;
}

static int number_of(const char *name) {
  int n = 0;
  while (n < mistake_count && strcmp(mistakes[n], name)) n++;
  if (n == mistake_count && n < MOST) strcpy(mistakes[mistake_count++], name);
  return n;
}

/* Read a line of motions: a key and its values. */
static int read_line(const char *line) {
  const char *at;
  char name[48];
  double x[32];
  if ((at = values_of(line, "name"))) {
    if (motion_count == MOST) return refuse("more than %d motions", MOST);
    memset(&motions[motion_count], 0, sizeof *motions), copy_field(motions[motion_count++].name, 48, at, ",\r\n");
  }
  if (!motion_count) return 1;
  Motion *m = &motions[motion_count - 1];
  struct { const char *key; double *to; int size; } fields[] = {
      {"inertia_B", m->inertia_B, 9}, {"quaternion_wxyz0", m->quaternion_wxyz0, 4}, {"w_WB_B0", m->w_WB_B0, 3},
      {"rotor_momentum_B", m->rotor_momentum_B, 3}, {"torque_B", m->torque_B, 3}, {"torque_W", m->torque_W, 3},
      {"damping", m->damping, 9}, {"weight", &m->weight, 1}, {"com_B", m->com_B, 3}, {"orbit", &m->orbit, 1},
      {"scale", m->scale, 3}, {"single", &m->single, 1}};
  for (size_t i = 0; i < sizeof fields / sizeof *fields; i++)
    if ((at = values_of(line, fields[i].key))) numbers(at, ',', fields[i].to, fields[i].size);
  if ((at = values_of(line, "features"))) copy_field(m->features, sizeof m->features, at, "\r\n");
  if ((at = values_of(line, "tolerance")) && m->tolerances < 9) numbers(at, ',', m->tolerance[m->tolerances++], 8);
  if ((at = values_of(line, "sample")) && m->samples < 24) { /* files have a matrix before the quaternion, and more after the rates */
    int n = numbers(at, ',', x, 32);
    m->sample[m->samples][0] = x[0], memcpy(m->sample[m->samples++] + 1, x + (n > 8 ? 10 : 1), 7 * sizeof *x);
  }
  if ((at = values_of(line, "catches"))) {
    at = copy_field(name, sizeof name, at, ",");
    int k = number_of(name);
    if (k < MOST) m->caught[k] = numbers(at, ',', m->catches[k], 4);
  }
  if ((at = values_of(line, "mistake"))) { /* a field for each motion */
    at = copy_field(name, sizeof name, at, ",");
    int k = number_of(name);
    for (int i = 0; i < motion_count && k < MOST; i++, at += strcspn(at, ","), at += *at == ',')
      if (*at && *at != ',') motions[i].caught[k] = numbers(at, ' ', motions[i].catches[k], 4);
  }
  return 1;
}

static void rotate_vector(const double *q, const double *v, double *out) {
  for (int i = 0; i < 3; i++) {
    int j = (i + 1) % 3, k = (i + 2) % 3;
    double a = q[1 + j] * v[k] - q[1 + k] * v[j], b = q[1 + k] * v[i] - q[1 + i] * v[k], c = q[1 + i] * v[j] - q[1 + j] * v[i];
    out[i] = v[i] + 2 * (q[0] * a + q[1 + j] * c - q[1 + k] * b);
  }
}

/* The energy, and the momentum in world axes. */
static double invariants(const Motion *m, const double *y, double *momentum) {
  double L[3], up[3], energy = 0;
  for (int i = 0; i < 3; i++) {
    L[i] = m->inertia_B[3 * i] * y[4] + m->inertia_B[3 * i + 1] * y[5] + m->inertia_B[3 * i + 2] * y[6];
    energy += L[i] * y[4 + i] / 2, L[i] += m->rotor_momentum_B[i];
  }
  rotate_vector(y, L, momentum), rotate_vector(y, m->com_B, up);
  return energy + m->weight * up[2];
}

/* The largest errors of attitude (rad), rates, energy and momentum, with so many steps before each sample. */
static int worst(const Motion *m, int steps, double *out) {
  double state[24][7], l[3], l0[3], e[4];
  for (int i = 0; i < 24 * 7; i++) state[i / 7][i % 7] = UNSET;
  simulate(m, m->sample[0][0] / steps, steps, m->samples, state);
  memset(out, 0, 4 * sizeof *out);
  for (int n = 0; n < m->samples; n++) {
    const double *y = state[n], *exact = m->sample[n] + 1;
    if (y[0] == UNSET) return refuse("%s: simulate returned %d states, expected %d", m->name, n, m->samples);
    for (int k = 1; k < 7; k++)
      if (y[k] == UNSET) return refuse("%s: simulate returned another state, expected a quaternion (4) and rates (3)", m->name);
    double near_ = 0, far_ = 0, dw = 0, dl = 0;
    e[2] = fabs(invariants(m, y, l) - invariants(m, exact, l0)) / m->scale[1];
    for (int i = 0; i < 4; i++) near_ += pow(y[i] - exact[i], 2), far_ += pow(y[i] + exact[i], 2);
    for (int i = 0; i < 3; i++) dw += pow(y[4 + i] - exact[4 + i], 2), dl += pow(l[i] - l0[i], 2);
    near_ = sqrt(near_ > far_ ? far_ : near_) / 2;
    e[0] = 4 * asin(near_ > 1 ? 1 : near_), e[1] = sqrt(dw) / m->scale[0], e[3] = sqrt(dl) / m->scale[2];
    for (int k = 0; k < 4; k++) out[k] = !(e[k] < LARGEST) ? LARGEST : e[k] > out[k] ? e[k] : out[k];
  }
  return 1;
}

/* Run a motion: its errors, the mistakes that explain them, and the order (-1 if it is not measured). */
static int check(const Motion *m, Result *r) {
  const double *row = NULL;
  double half[4];
  for (int n = 0; n < m->tolerances; n++)
    if (m->tolerance[n][0] == ORDER && m->tolerance[n][1] == ANGLE) row = m->tolerance[n];
  if (!row) return refuse("%s has no tolerance for order %d and |w| h = %g rad", m->name, (int)ORDER, ANGLE);
  memset(r, 0, sizeof *r);
  if (!worst(m, (int)row[2], r->found)) return 0;
  r->motion = m, r->order = r->mistake = -1;
  for (int k = 0; k < 4; k++) {
    r->limit[k] = row[3 + k] + SINGLE * m->single;
    if (r->found[k] / r->limit[k] > r->found[r->most] / r->limit[r->most]) r->most = k;
  }
  double ratio = r->found[r->most] / r->limit[r->most];
  if (!m->features[0] || ratio > 1) {
    if (!worst(m, 2 * (int)row[2], half)) return 0;
    if (!m->features[0] && r->found[0] < LARGEST && half[0] > (SINGLE ? m->single : 1e-11)) /* above rounding */
      r->order = r->found[0] > half[0] ? log(r->found[0] / half[0]) / log(2) : 0;
    if (r->found[r->most] < LARGEST && half[r->most] > 0) r->falls = log(r->found[r->most] / half[r->most]) / log(2);
  }
  for (int n = 0; n < MOST; n++) {
    r->apart[n] = -1;
    if (ratio <= 1 || !m->caught[n]) continue;
    double apart = 0;
    for (int k = 0; k < m->caught[n]; k++)
      apart += pow(log(fmax(r->found[k], r->limit[k]) / fmax(m->catches[n][k], r->limit[k])), 2) / m->caught[n];
    if (apart >= NEAR_ENOUGH) continue;
    r->apart[n] = apart, r->near++;
    if (r->mistake < 0 || apart < r->apart[r->mistake]) r->mistake = n;
  }
  r->failed = ratio > 1 && !(r->falls >= ORDER - 0.5 && (ratio <= 2 || !r->near));
  int none = r->failed && !r->near; /* a large error of the attitude alone, or of the rates alone, is still there beside another mistake */
  for (int n = 0; none && n < MOST; n++) {
    const double *x = m->catches[n];
    int k = x[0] < x[1];
    if (!m->caught[n] || x[1 - k] != 0 || x[k] <= LARGE || fabs(log(fmax(r->found[k], r->limit[k]) / x[k])) >= 0.03) continue;
    r->apart[n] = NEAR_ENOUGH, r->near++;
    if (r->mistake < 0) r->mistake = n;
  }
  r->above = r->failed || ratio <= 1 ? 0 : 100 * (ratio - 1);
  return 1;
}

/* Whether a motion is one of those to name a mistake of: new failures, or all. */
static int counts(const Result *r, int fresh) { return fresh ? r->fresh : r->failed; }

/* Name the mistake of each motion that fails, those that explain most motions first. Print lines about them, if asked. */
static void summary(int failed, int fresh, int say, double order) {
  int done[MOST] = {0}, rest = failed;
  for (int round = 0; round < 3; round++) {
    int best = -1, most = 0;
    double least = 0;
    for (int n = 0; n < mistake_count; n++) {
      int votes = 0, shown = 0;
      double sum = 0;
      for (int i = 0; i < result_count; i++) {
        shown += results[i].motion->caught[n] > 0;
        if (counts(&results[i], fresh) && !done[i] && results[i].apart[n] >= 0) votes++, sum += results[i].apart[n];
      }
      sum += 1e-9 * shown; /* of two that explain the same, the one that fewer motions show */
      if (votes > most || (votes && votes == most && sum < least)) best = n, most = votes, least = sum;
    }
    if (best < 0 || 10 * most < failed) break;
    if (say && fresh) printf("\"%s\" explains %d of %d new failures\n", mistakes[best], most, failed);
    else if (say) printf("\"%s\" explains %d of them\n", mistakes[best], most);
    for (int i = 0; i < result_count; i++)
      if (counts(&results[i], fresh) && !done[i] && results[i].apart[best] >= 0) done[i] = 1, results[i].mistake = best;
    rest -= most;
  }
  if (say && 2 * rest > failed && order >= 0.5 && order < ORDER - 0.5)
    printf("this program has order %.1f, %d was declared\n", order, (int)ORDER);
  if (!say || !rest) return;
  printf("%d not explained by a mistake:", rest);
  for (int i = 0, n = 0; i < result_count; i++)
    if (counts(&results[i], fresh) && !done[i] && n < 5) printf("%s %s", n++ ? "," : "", results[i].motion->name);
  printf("\nWhat now: references/motions/my_engine_fails.md of conservative-rotation\n");
}

/* A number with so many digits. */
static const char *short_number(double x, int digits, char *out) {
  int fixed = x >= 0.01 && x < 10;
  return sprintf(out, fixed ? "%.*f" : "%.*e", digits - 1 - (fixed ? (int)floor(log10(x)) : 0), x), out;
}

/* An error in two digits of the three that are recorded, so that the same number looks the same. */
static const char *two(double x, const char *unit, char *out) {
  sprintf(out, "%.2e", x);
  return x < LARGEST ? sprintf(out, "%.1e%s", strtod(out, NULL), unit) : sprintf(out, "not finite"), out;
}

static const char *mistake_name(const Result *r) { return r->mistake < 0 ? "no known mistake" : mistakes[r->mistake]; }

static void print_error(const Result *r, int k) {
  const char *names[] = {"attitude", "rates", "energy", "momentum"};
  char text[32];
  printf("%s: %s error %s", r->motion->name, names[k], two(r->found[k], k ? "" : " rad", text));
}

static int compare_numbers(const void *a, const void *b) {
  return (*(const double *)a > *(const double *)b) - (*(const double *)a < *(const double *)b);
}

/* Read a file of known errors. */
static int read_known(const char *path, double *order) {
  char line[512], precision[16];
  const char *at;
  double x[2];
  FILE *file = fopen(path, "r");
  if (!file) return refuse("%s: cannot be read. Write it with --record %s", path, path);
  known_count = 0, then[0] = 0, *order = -1;
  for (int n = 1; fgets(line, sizeof line, file); n++) {
    int good = 1;
    line[strcspn(line, "\r\n")] = 0;
    if ((at = values_of(line, "settings"))) {
      good = numbers(at, ',', x, 2) == 2, at = strchr(at, ','), at = at ? strchr(at + 1, ',') : NULL;
      copy_field(precision, sizeof precision, at ? at + 1 : "", ",");
      sprintf(then, "order %d, %g rad, %s", (int)x[0], x[1], precision);
    } else if ((at = values_of(line, "order"))) {
      good = numbers(at, ',', order, 1) == 1;
    } else if ((at = values_of(line, "motions")) && known_count < 2 * MOST) {
      Known *one = &known[known_count++];
      at = copy_field(one->name, sizeof one->name, at, ","), one->seen = one->count = 0;
      good = numbers(at, ',', one->error, 2) == 2 && (at = strchr(at, ',')) && (at = strchr(at + 1, ',')) && !strchr(at + 1, ',');
      if (good) copy_field(one->mistake, sizeof one->mistake, at + 1, ",");
    } else {
      good = !line[0] || line[0] == '#';
    }
    if (!good) return fclose(file), refuse("%s: line %d is not of this test: %s. Record again: --record %s", path, n, line, path);
  }
  fclose(file);
  if (!then[0]) return refuse("%s: not a file of known errors. Write another one with --record", path);
  return !strcmp(then, now) || refuse("%s: recorded with %s; now %s: record again", path, then, now);
}

static int write_known(const char *path, double order) {
  char line[64] = "", a[32], b[32];
  FILE *file = fopen(path, "r");
  if (file) {
    int same = fgets(line, sizeof line, file) && !strncmp(line, HEADER, 31);
    fclose(file);
    if (!same) return refuse("%s: not a file of known errors, and not replaced. Choose another name", path);
  }
  if (!(file = fopen(path, "wb"))) return refuse("%s: cannot be written", path);
  fprintf(file, "%s\nsettings,%d,%g,%s\n", HEADER, (int)ORDER, ANGLE, SINGLE ? "single" : "double");
  if (order >= 0) fprintf(file, "order,%.2f\n", order);
  for (int i = 0; i < result_count; i++) {
    const Result *r = &results[i];
    short_number(r->found[0], 3, a), short_number(r->found[1], 3, b);
    fprintf(file, "motions,%s,%s,%s,%s\n", r->motion->name, a, b, r->failed && r->mistake >= 0 ? mistakes[r->mistake] : "");
  }
  if (fclose(file)) return refuse("%s: cannot be written", path);
  return 1;
}

/* Compare with the known errors, print what is new, and return the number of motions that are worse; -1 if it is not possible. */
static int compare_known(const char *path, double order) {
  double before, was = 0, is = 0;
  int sum = 0, fresh = 0, worse, shown = 0;
  char a[32], b[32];
  const Result *first = NULL;
  if (!read_known(path, &before)) return -1;
  for (int i = 0; i < result_count; i++) {
    Result *r = &results[i];
    for (int n = 0; n < known_count; n++)
      if (!strcmp(known[n].name, r->motion->name)) r->was = &known[n], known[n].seen = 1;
    const Known *one = r->was;
    for (int k = 0; one && k < 2; k++) {
      double margin = 0.01 * one->error[k] + r->limit[k]; /* recorded numbers have three digits */
      r->worse[k] = r->found[k] > one->error[k] + margin, r->lower[k] = r->found[k] < one->error[k] - margin;
    }
    int no_worse = one && !r->worse[0] && !r->worse[1];
    if (one) r->same = one->mistake[0] ? r->apart[number_of(one->mistake) % MOST] >= 0 : !r->near;
    if (one && !r->motion->features[0]) was = fmax(was, one->error[0]), is = fmax(is, r->found[0]);
    if (!no_worse) r->lower[0] = r->lower[1] = 0;
    r->fresh = r->failed && !(no_worse && (r->same || r->lower[0] || r->lower[1]));
    fresh += r->fresh;
  }
  summary(worse = fresh, 1, 0, order);
  for (int i = 0; i < result_count; i++) {
    const Result *r = &results[i];
    Known *one = r->was;
    int k = one ? r->worse[1] && !r->worse[0] : r->most;
    if (r->fresh && !first) first = r;
    if (r->fresh) print_error(r, k);
    if (r->fresh && !one) printf(", tolerance %s, not recorded; %s\n", two(r->limit[k], "", a), mistake_name(r));
    if (!one) continue;
    const char *recorded = one->mistake[0] ? one->mistake : "no known mistake";
    if (r->fresh) printf(", was %s; %s%s%s\n", two(one->error[k], "", a), mistake_name(r), r->same ? "" : ", was ", r->same ? "" : recorded);
    int other = r->failed && !r->same;
    for (k = 0; k < 2; k++) {
      if (!r->lower[k] || !strcmp(two(one->error[k], "", a), two(r->found[k], "", b))) continue;
      printf("better: %s, %s to %s%s", r->motion->name, a, two(r->found[k], k ? "" : " rad", b), k ? " (rates)" : "");
      printf("%s%s: record again to tighten\n", other ? ", now " : "", other ? mistake_name(r) : "");
      break;
    }
    if (r->failed && !r->fresh) one->count = 1, sum++;
    if (recorded != one->mistake || other) strcpy(one->mistake, other ? mistake_name(r) : recorded);
  }
  for (int n = 0; n < known_count; n++) {
    const char *why = "not there";
    for (int i = 0; i < motion_count; i++) if (!strcmp(motions[i].name, known[n].name)) why = "skipped";
    if (!known[n].seen) printf("%s: was tested, is %s now: record again\n", known[n].name, why), worse++;
  }
  summary(fresh, 1, 1, order);
  printf("known errors of %s: %d", path, sum);
  for (int left = sum; left;) { /* the mistake of most motions first */
    int best = 0, most = 0;
    for (int n = 0; n < known_count; n++) {
      int votes = 0;
      for (int i = 0; known[n].count && i < known_count; i++) votes += known[i].count && !strcmp(known[i].mistake, known[n].mistake);
      if (votes > most) best = n, most = votes;
    }
    printf("%s%s: %d", shown++ ? ", " : " (", known[best].mistake, most);
    for (int n = 0; n < known_count; n++) if (!strcmp(known[n].mistake, known[best].mistake)) known[n].count = 0;
    left -= most;
  }
  printf("%s, new failures: %d\n", sum ? ")" : "", worse);
  int attitude = strcmp(short_number(was, 2, a), short_number(is, 2, b)) && fabs(is - was) > 0.01 * was && fmax(was, is) < LARGEST;
  int orders = before >= 0 && order >= 0 && fabs(before - order) >= 0.2;
  attitude = attitude && (is > was || !worse);
  if (attitude || orders || first) printf("free rotation at your step: ");
  if (attitude) printf("attitude error %s to %s rad", a, b);
  if (orders) printf("%sorder %.1f to %.1f", attitude ? ", " : "", before, order);
  if (first) printf("%sfirst bad motion: %s (%s)", attitude || orders ? "; " : "", first->motion->name, mistake_name(first));
  if (attitude || orders || first) printf("\n");
  return worse;
}

/* BEGIN MOTIONS */
static const char *const embedded[] = {
"name,brick_flip",
"inertia_B,13,0,0,0,5,0,0,0,10",
"quaternion_wxyz0,1,0,0,0",
"w_WB_B0,0,.05,10",
"sample,.04,.980066080285,-7.7260487e-5,.00099432641,.198669282028,-.00773973082,.05092592027,9.99999377004",
"sample,.08,.921059033938,-.000313002448,.001953836648,.389417950989,-.01576610603,.0537379694,9.99997414868",
"sample,.12,.825331324351,-.00071844221,.002839874903,.564641146212,-.02437638132,.05854028038,9.99993820218",
"sample,.16,.696699404582,-.001310044891,.003606267964,.717352924487,-.03388942615,.06551068157,9.99988055599",
"sample,.2,.540291612426,-.002106144642,.004195995668,.841464753461,-.0446575226,.07490727032,9.99979259124",
"scale,10.0002,500.006,100",
"tolerance,1,.01,40,.00022,.00028,1.9e-6,.00015",
"tolerance,2,.01,40,.00017,5.6e-6,1.1e-6,2e-6",
"tolerance,4,.01,40,2.8e-9,1.7e-10,1.1e-10,1.4e-10",
"single,.00035",
"name,golden_4",
"features,fixed point",
"inertia_B,37.569567086791935,0,0,0,24.42047900665016,0,0,0,49.74541379718716",
"quaternion_wxyz0,.080676695026,.243425168124,.406750890403,.87680623376",
"w_WB_B0,-.493501866735,1.039660622419,.000416869186",
"weight,3010",
"com_B,.02361198596771947,-.01514681660749079,.003072647492940911",
"sample,.092,.067689278842,.195298596414,.39279062573,.896098289312,-.406698404626,1.185777743939,-.137063569628",
"sample,.184,.056257799272,.13796008191,.383108854263,.911608293954,-.302613112942,1.352292838003,-.26434224599",
"sample,.276,.045877224471,.070871031907,.377762999676,.922045385644,-.180760141687,1.534728636918,-.378906739634",
"sample,.368,.036109081052,-.006128208929,.376666328191,.925624684485,-.041787400584,1.726675384467,-.477850895476",
"scale,1.79206,42.116,48.4305",
"tolerance,1,.01,20,.022,.017,.051,.026",
"tolerance,2,.01,20,7.2e-5,5.8e-5,.00014,9.3e-5",
"tolerance,4,.01,20,8e-10,6.3e-10,5.7e-10,1.1e-9",
"single,.00013",
"name,golden_9",
"inertia_B,3.330073724153789,0,0,0,1.354784666276132,0,0,0,4.479344421805398",
"quaternion_wxyz0,-.470821233501,-.862831436986,-.037843352356,-.180047655126",
"w_WB_B0,-34.32588597222,21.20929544084,-40.60791817033",
"sample,.0034,-.527739029423,-.822765111727,-.106497802656,-.182228718314,-31.28011371377,25.10961113494,-41.7482365852",
"sample,.0068,-.574569851351,-.776359009178,-.180150498896,-.186230965562,-27.63998986798,28.71238447059,-42.9385064686",
"sample,.0102,-.609868156415,-.724654963895,-.258141186148,-.19052334006,-23.42419341637,31.92228858191,-44.10092148237",
"sample,.0136,-.632536701804,-.668800542901,-.339402991611,-.19341345344,-18.6776624159,34.63677355977,-45.15319950195",
"scale,59.8947,5959.8,216.745",
"tolerance,1,.01,20,.0066,.0087,.0043,.0065",
"tolerance,2,.01,20,8.6e-5,.00015,4.7e-5,6.4e-5",
"tolerance,4,.01,20,2.9e-9,3.8e-9,6.4e-10,2.3e-9",
"single,.00017",
"name,separatrix_turned",
"inertia_B,.8316,-.005554,-.1469,-.005554,.8775,-.0191,-.1469,-.0191,.5895",
"quaternion_wxyz0,.393215738015,.327179507203,.169092772836,-.842462217324",
"w_WB_B0,1.062,.1578,-.1296",
"sample,.092,.370537960828,.350827234519,.132385642469,-.849762268386,1.063966219695,.143831719492,-.12971383988",
"scale,1.08145,.504512,.941297",
"tolerance,1,.01,10,.00065,.0011,.00017,.00064",
"tolerance,2,.01,10,6.6e-5,.00011,1.8e-5,6.5e-5",
"tolerance,4,.01,10,2.7e-10,2.6e-10,1.1e-10,1.6e-10",
"single,3.6e-5",
"name,tiny",
"inertia_B,9.455e-10,0,0,0,9.151e-10,0,0,0,1.048e-9",
"quaternion_wxyz0,.112992486249,.491967285263,-.845943746611,.171988563141",
"w_WB_B0,.5509,-.6398,-.5359",
"sample,.1,.076857449693,.522644337516,-.830603856008,.176162036983,.546063583369,-.643095463524,-.536920557978",
"scale,1.00002,4.81258e-10,9.64116e-10",
"tolerance,1,.01,10,.00057,.00061,6.4e-5,.00055",
"tolerance,2,.01,10,5.7e-5,6.2e-5,7.3e-6,5.6e-5",
"tolerance,4,.01,10,2.4e-10,1.4e-10,1.1e-10,1.1e-10",
"single,3.4e-5",
"name,tiny_fast",
"inertia_B,4.48e-8,5.651e-11,2.137e-9,5.651e-11,4.274e-8,-8.16e-10,2.137e-9,-8.16e-10,5.324e-8",
"quaternion_wxyz0,-.024905367561,-.782168571581,-.416089674908,-.463099806448",
"w_WB_B0,215.5,128.8,-164.2",
"sample,.00033,-.00078849058,-.761066699215,-.453804148479,-.463506906585,216.6216023664,126.641690707,-164.3938800226",
"scale,299.986,.0020557,1.37463e-5",
"tolerance,1,.01,10,.00011,2e-4,1.8e-5,.00012",
"tolerance,2,.01,10,1.5e-5,2.1e-5,2.7e-6,1.3e-5",
"tolerance,4,.01,10,2.4e-10,1.4e-10,1.1e-10,1.2e-10",
"single,3.4e-5",
"name,walking_pace",
"inertia_B,.8099,-.00586,-.01041,-.00586,.8089,.00958,-.01041,.00958,.8239",
"quaternion_wxyz0,-.775127906658,-.185030532557,.286047201683,-.532087801732",
"w_WB_B0,.02244,.04795,.08484",
"sample,1,-.756401363967,-.168592678297,.268959227751,-.571921689762,.0224224698228,.0481121522205,.0847527934615",
"scale,.100003,.00411182,.0822474",
"tolerance,1,.01,10,.00051,5e-4,1.2e-5,.00051",
"tolerance,2,.01,10,5.2e-5,5.1e-5,2.1e-6,5.2e-5",
"tolerance,4,.01,10,2.4e-10,1.5e-10,1.1e-10,1.1e-10",
"single,3.3e-5",
"name,fast",
"inertia_B,.8812,-.0299,.109,-.0299,.9868,.1588,.109,.1588,1.207",
"quaternion_wxyz0,-.748155258326,.58612163286,.282058533219,-.131027190963",
"w_WB_B0,-326,908.1,-262.8",
"sample,1e-4,-.752123997076,.599878943248,.257661233843,-.089807767175,-330.0531090618,906.0350244243,-264.6289699644",
"scale,999.993,475678,952.836",
"tolerance,1,.01,10,.00017,.00021,1.3e-5,.00017",
"tolerance,2,.01,10,2e-5,2.2e-5,2.1e-6,1.8e-5",
"tolerance,4,.01,10,2.4e-10,1.3e-10,1.1e-10,1.3e-10",
"single,3.4e-5",
"name,half_turn_slow",
"inertia_B,.8868,.09572,.03171,.09572,1.127,.2494,.03171,.2494,1.132",
"quaternion_wxyz0,.054096488981,.264982801849,.646958010553,-.71295372724",
"w_WB_B0,.005301,.01296,-.01428",
"sample,5,.004123912615,.265435626072,.64790674323,-.713963426117,.00529663916983,.01300048427984,-.01424508416235",
"sample,10,-.045859203428,.265354494612,.647223701313,-.713151741293,.00528941417733,.0130418683854,-.01421027297955",
"sample,15,-.095727662301,.264741949711,.644910498133,-.710519784476,.00527932133719,.01308415605275,-.01417555321288",
"sample,20,-.145356520806,.263602261347,.640972580665,-.706073282675,.00526635597919,.01312735022887,-.01414091067625",
"scale,.0200007,.000180543,.0180695",
"tolerance,1,.01,10,.0022,.0021,8.6e-5,.0022",
"tolerance,2,.01,10,6e-5,5.5e-5,3.6e-6,5.6e-5",
"tolerance,4,.01,10,6.4e-10,1.8e-10,1.1e-10,1.6e-10",
"single,7.5e-5",
"name,torque_and_rotor",
"features,rotor,torque",
"inertia_B,.7859,-.2539,-.175,-.2539,.8081,.01264,-.175,.01264,1.181",
"quaternion_wxyz0,-.707928824874,.085291424805,-.209978888734,-.668932745538",
"w_WB_B0,-.3308,.6182,-.7131",
"rotor_momentum_B,-.102,.0889,.47",
"torque_B,.415,-.334,.578",
"sample,.1,-.722566984008,.123621717508,-.216671594833,-.644723230987,-.321777720106,.557187444228,-.663801945577",
"scale,1.00006,.502762,.830319",
"tolerance,1,.01,10,.0013,.00094,.00065,.0011",
"tolerance,2,.01,10,8.2e-5,5.5e-5,2e-5,8.2e-5",
"tolerance,4,.01,10,3.1e-10,2.4e-10,1.9e-10,3.1e-10",
"single,3.5e-5",
"name,damped",
"features,damping",
"inertia_B,.3919,0,0,0,.6702,0,0,0,.3418",
"quaternion_wxyz0,-.703884220568,-.509916125695,-.336944577175,.36194046569",
"w_WB_B0,.7249,-.6706,.1575",
"damping,.087,0,0,0,.0821,0,0,0,.0739",
"sample,.2,-.694208072664,-.53896732184,-.253645539906,.404046182908,.6725306120189,-.6563486944512,.2247339429246",
"sample,.4,-.683130717889,-.56136133328,-.167784848617,.435951970232,.6162510995068,-.6428799957858,.281943256633",
"sample,.6,-.671374170726,-.576391227855,-.080927296902,.458781699669,.5575043008933,-.6299750719911,.3295339541524",
"sample,.8,-.659420129594,-.583672711928,.005496016773,.473773207174,.4975540271041,-.6174486138359,.3680137969515",
"scale,.999995,.257903,.534413",
"tolerance,1,.01,20,.0058,.0072,.0021,.0037",
"tolerance,2,.01,20,.00011,.00011,2.8e-5,6.7e-5",
"tolerance,4,.01,20,1.7e-9,1.5e-9,2.5e-10,1.3e-9",
"single,.00014",
"name,orbit_flat",
"features,orbit",
"inertia_B,104.1,1.335,20.02,1.335,76.02,42.43,20.02,42.43,97.28",
"quaternion_wxyz0,-.720623572499,-.295845461109,-.611680480402,-.137927951463",
"w_WB_B0,-.001075,.0008884,.0005521",
"orbit,.00105",
"sample,148,-.694082227649,-.248358277242,-.631339741757,-.240786540042,-.001273515980661,.000938316138226,.000609189917618",
"sample,296,-.656902752666,-.188432003709,-.638726835542,-.353553649501,-.001489004095649,.000988056039612,.000679054139937",
"sample,444,-.605308317068,-.116451664536,-.628716422745,-.474084919488,-.00171701448256,.001033393421464,.000767229301881",
"sample,592,-.535115395503,-.034671454685,-.595876556406,-.597813125694,-.001938955150609,.001065491586751,.000877124747801",
"scale,.00237995,.000279105,.23499",
"tolerance,1,.01,40,.0054,.0057,.0013,.0035",
"tolerance,2,.01,40,8.1e-5,8.3e-5,9.5e-5,6.9e-5",
"tolerance,4,.01,40,7.8e-10,7.9e-10,9.3e-10,6.4e-10",
"single,.00031",
"mistake,inertia about the centre of mass,,.0014 .0046,,,,,,,,,,",
"mistake,sign of the torque,,,,,,,,,,.0086 .17,,",
"mistake,axes of the torque,,,,,,,,,,.0078 .16,,",
"mistake,without the torque,,,,,,,,,,.0043 .086,,",
"mistake,sign of the rotor,,,,,,,,,,.0078 .15,,",
"mistake,without the rotor,,,,,,,,,,.0039 .077,,",
"mistake,size of the rotor 0.98,,,,,,,,,,7.8e-5 .0015,,",
"mistake,sign of the damping,,,,,,,,,,,.12 .3,",
"mistake,without the damping,,,,,,,,,,,.055 .14,",
"mistake,turning of the field,,,,,,,,,,,,.024 .093",
"mistake,dead band 0.001,.0042 .0051,,,,,,,,,,,.7 .59",
"mistake,sign of the field,,.33 1,,,,,,,,,,.51 .74",
"mistake,without the field,,.16 .51,,,,,,,,,,.26 .39",
"mistake,smallest moments,,,,,3e-4 .0059,4e-4 .0081,,,,,,",
"mistake,rate limit 100,,,,,,.059 .67,,.081 .9,,,,",
"mistake,rate limit 47,,,.16 .22,,,.075 .84,,.086 .95,,,,",
"mistake,rate limit 7,.6 .3,,.69 .89,,,.087 .98,,.089 .99,,,,",
"mistake,dead band 0.01,.0042 .0051,.093 .27,,,,,,,.1 .26,,,1.1 1",
"mistake,attitude by normalisation,3e-5 0,.0022 0,.0017 0,,,4e-5 0,,,,4e-4 0,.0015 0,.0017 0",
"mistake,stale rates,2.4e-5 0,.0022 0,.0017 0,,,4e-5 0,,,,.00039 0,.0015 0,.0017 0",
"mistake,sign of the products of inertia,,,,.0016 .033,,.00026 .0053,.00017 .0033,.0013 .027,.017 .083,.0024 .047,,.54 .77",
"mistake,no products of inertia,,,,.00081 .016,,.00012 .0025,8.3e-5 .0017,6e-4 .012,.0066 .033,.001 .02,,.28 .41",
"mistake,diagonal gyroscopic term,,,,.00081 .016,,.00011 .0023,8.3e-5 .0017,.00058 .012,.0059 .03,.00091 .018,,.23 .4",
"mistake,damping 0.02,.004 .004,.0018 .0059,.00011 .00028,9.1e-5 .0018,1e-4 .002,3.3e-7 6.6e-6,.00099 .02,,.07 .33,9.7e-5 .0019,.0058 .014,1 1",
"mistake,inertia of the start,.003 .005,.0088 .043,.037 .14,2.2e-5 .00065,9.9e-6 3e-4,1.3e-5 4e-4,,8.2e-6 .00024,.00029 .0022,2.4e-5 .00071,.028 .098,.048 .11",
"mistake,damping 0.01,.002 .002,9e-4 .003,5.5e-5 .00014,4.6e-5 .00092,5e-5 .001,1.6e-7 3.3e-6,5e-4 .01,,.037 .18,4.9e-5 .00096,.0029 .0071,.94 .98",
"mistake,rates half a step late,0 2e-5,0 .0036,0 .0024,0 .00065,0 3e-4,0 .00041,,0 .00024,0 .00014,0 .0039,0 .0021,0 .0013",
"mistake,rates half a step early,0 2e-5,0 .0036,0 .0024,0 .00065,0 3e-4,0 .00041,,0 .00024,0 .00014,0 .0039,0 .0021,0 .0013",
"mistake,start in world rates,,.83 1.3,1.1 1.5,.16 1.6,.14 1.4,.17 1.7,.1 1,.13 1.3,.00027 .00068,.13 1.3,.99 1.3,1.5 1.4",
"mistake,inertia in world axes,,.073 .25,.21 .53,.0014 .028,3.6e-5 .00079,.00057 .012,.00018 .0036,.00088 .018,.0043 .022,.0033 .067,.16 .4,.31 .49",
"mistake,start transposed,,.32 .0059,2 0,1.6 0,.45 0,.1 0,2.7 0,2.9 0,.22 0,3.1 0,3.1 0,3.1 .63",
"mistake,rates in degrees,0 56,0 56,0 56,0 56,0 56,0 56,0 56,0 56,0 56,0 52,0 54,0 56",
"mistake,transposed,3.1 0,.27 0,2.7 0,1.5 0,.31 0,.0032 0,2.9 0,2.9 0,.58 0,3.1 0,3.1 0,3.1 0",
"mistake,start in order xyzw,3.1 0,2 .29,2 0,2.6 0,2.1 0,2 0,2.4 0,2.7 0,2.5 0,2 0,2.8 0,1.9 .16",
"mistake,start in order wxyz,3.1 0,2 .99,2 0,2.6 0,2.1 0,2 0,2.4 0,2.7 0,2.5 0,2 0,2.8 0,1.9 .4",
"mistake,order xyzw,2.7 0,2.4 0,1.8 0,2.6 0,2 0,2 0,2.4 0,2.6 0,2.7 0,2.1 0,3 0,1.7 0",
"mistake,axes y up,2.5 1.4,3.1 1.4,1.1 1.3,2.6 .25,2.6 1.2,1.9 .98,1.9 1.4,.78 1.3,3 1.4,2 1.2,1.4 1,2.6 .82",
"mistake,reversed rates,0 2,0 2,0 2,0 2,0 2,0 2,0 2,0 2,0 2,0 1.8,0 1.9,0 2",
"mistake,start in degrees,2 .98,.43 .69,.78 .98,.098 .98,.098 .98,.097 .98,.098 .98,.098 .98,.39 .98,.098 .98,.73 .95,.97 .82",
"mistake,factor one half,2 0,.54 .065,.79 0,.099 0,.1 0,.099 0,.1 0,.1 0,.4 0,.096 0,.75 0,1 .2",
"mistake,sleep,2 1,.52 1,.79 1,.099 1,.1 1,.099 1,.1 1,.1 1,.4 1,.096 .92,.75 .97,1.1 1",
"mistake,frozen motion,2 .0051,.52 .53,.79 .35,.099 .013,.1 .0059,.099 .0081,.1 .0018,.1 .0049,.4 .011,.096 .079,.75 .31,1.1 .39",
"mistake,world y up,1.6 0,1.6 0,1.6 0,1.6 0,1.6 0,1.6 0,1.6 0,1.6 0,1.6 0,1.6 0,1.6 0,1.6 0",
"mistake,world turned the wrong way,1.6 0,1.6 0,1.6 0,1.6 0,1.6 0,1.6 0,1.6 0,1.6 0,1.6 0,1.6 0,1.6 0,1.6 0",
"mistake,start in a world with y up,1.6 0,1.6 .44,1.6 0,1.6 0,1.6 0,1.6 0,1.6 0,1.6 0,1.6 0,1.6 0,1.6 0,1.6 .18",
"mistake,damping 0.2,.039 .039,.018 .057,.0011 .0028,.00091 .018,.00099 .02,3.3e-6 6.6e-5,.0094 .18,1e-6 2e-5,.3 .98,.00097 .019,.056 .13,1.1 1",
"mistake,damping 0.1,.02 .02,.0089 .029,.00055 .0014,.00046 .0092,5e-4 .01,1.6e-6 3.3e-5,.0048 .095,5e-7 1e-5,.23 .86,.00049 .0096,.029 .068,1.1 1",
"mistake,R I for R I R',.0082 .02,.28 .89,.6 1.2,.0052 .1,.0051 .1,.0048 .098,.0045 .09,.0078 .16,.0044 .022,.0051 .1,.23 .52,1.1 1.4",
"mistake,damping 0.05,.01 .01,.0045 .015,.00028 7e-4,.00023 .0046,.00025 .005,8.2e-7 1.6e-5,.0025 .049,2.5e-7 5e-6,.15 .63,.00024 .0048,.014 .035,1.1 1",
"mistake,no gyroscopic term + damping 0.05,.011 .011,.014 .057,.14 .35,.00069 .014,.00039 .0078,4e-4 .0081,.0025 .049,.00025 .0049,.15 .63,.0031 .062,.11 .26,1.1 1",
"mistake,inverted inertia,.016 .019,2.7 36,.29 .72,.0017 .035,.00057 .011,.00072 .015,.00018 .0036,6e-4 .012,.0073 .037,.001 .019,.17 .42,1.1 65",
"mistake,a step late,.01 3.9e-5,.0082 .0072,.01 .0047,.0099 .0013,.01 .00059,.0099 .00081,.01 .00018,.01 .00048,.01 .00029,.0093 .0079,.0097 .0042,.0088 .0027",
"mistake,a step early,.01 3.9e-5,.0083 .0072,.01 .0047,.0099 .0013,.01 .00059,.0099 .00081,.01 .00018,.01 .00048,.01 .00029,.0092 .0079,.0097 .0042,.0088 .0027",
"mistake,sign of the gyroscopic term,.0074 .0089,.026 .1,.26 .64,.0013 .026,.00059 .012,.00081 .016,.00018 .0037,5e-4 .0099,.0042 .021,.0062 .12,.22 .5,.24 .4",
"mistake,world rates,0 .0054,0 2,0 1.5,0 1.6,0 1.4,0 1.7,0 1,0 1.3,0 .022,0 1.2,0 1.4,0 1.4",
"mistake,no gyroscopic term,.0042 .0051,.014 .056,.14 .35,.00065 .013,3e-4 .0059,4e-4 .0081,9.2e-5 .0018,.00025 .0049,.0022 .011,.0031 .062,.11 .26,.11 .18",
"mistake,half a step late,.005 2e-5,.0041 .0036,.0051 .0024,.005 .00065,.005 3e-4,.0049 .00041,.005 9.2e-5,.005 .00024,.005 .00014,.0046 .0039,.0048 .0021,.0044 .0013",
"mistake,half a step early,.005 2e-5,.0041 .0036,.0051 .0024,.005 .00065,.005 3e-4,.0049 .00041,.005 9.2e-5,.005 .00024,.005 .00014,.0046 .0039,.0048 .0021,.0044 .0013",
"mistake,wrong side,.003 0,.99 .21,1.1 0,.16 0,.14 0,.17 0,.1 0,.13 0,.0044 0,.12 0,1.1 0,1.5 .31",
NULL};
/* END MOTIONS */

/* Test the motions and return the exit code: 0, 1 if a motion fails, 2 if the test is not possible. */
static int run(int argc, char **argv) {
  const char *record = getenv("ROTATION_RECORD"), *compare = getenv("ROTATION_KNOWN");
  char line[2048], feature[64], unit[32];
  int failed = 0, orders = 0, files = 0;
  double order[MOST];
  FILE *file;
  motion_count = result_count = mistake_count = 0;
  for (const char *at = HAS; *at;) {
    at = copy_field(feature, sizeof feature, at + strspn(at, " "), ",");
    if (feature[0] && !has(FEATURES, feature)) return refuse("HAS: got %s; allowed: %s", feature, FEATURES), 2;
  }
  for (int i = 1; i < argc; i++) {
    int to_record = !strcmp(argv[i], "--record");
    if (to_record || !strcmp(argv[i], "--known")) {
      if (i + 1 == argc) return refuse("%s: expected the name of a file", argv[i]), 2;
      *(to_record ? &record : &compare) = argv[i + 1], i++;
      continue;
    }
    int before = motion_count;
    if (argv[i][0] == '-' || !(file = fopen(argv[i], "r")))
      return refuse("%s: expected --record FILE, --known FILE or CSV files of motions", argv[i]), 2;
    while (fgets(line, sizeof line, file))
      if (!read_line(line)) return fclose(file), 2;
    fclose(file), files++;
    if (motion_count == before) return refuse("%s: a file without a motion", argv[i]), 2;
  }
  if (record && !*record) record = NULL;
  if (compare && !*compare) compare = NULL;
  if (record && compare) return refuse("record and known are both given: give one of them"), 2;
  if (!record && !compare && (file = fopen("known.txt", "r"))) fclose(file), compare = "known.txt";
  for (int i = 0; !files && embedded[i]; i++) read_line(embedded[i]);
  sprintf(now, "order %d, %g rad, %s", (int)ORDER, ANGLE, SINGLE ? "single" : "double");
  for (int i = 0; i < motion_count; i++) {
    const char *at = motions[i].features;
    for (feature[0] = 0; *at && (!feature[0] || has(HAS, feature));) at = copy_field(feature, sizeof feature, at, ",");
    if (feature[0] && !has(HAS, feature)) {
      printf("%s: skipped, it has %s\n", motions[i].name, feature);
      continue;
    }
    if (!check(&motions[i], &results[result_count])) return 2;
    failed += results[result_count].failed;
    if (results[result_count].order >= 0) order[orders++] = results[result_count].order;
    result_count++;
  }
  qsort(order, (size_t)orders, sizeof *order, compare_numbers);
  double median = orders ? order[orders / 2] : -1;
  summary(failed, 0, 0, median);
  for (int i = 0; i < result_count; i++) {
    const Result *r = &results[i];
    if (r->above <= 0 && (!r->failed || compare)) continue;
    print_error(r, r->most), printf(", tolerance %s", two(r->limit[r->most], "", unit));
    if (r->failed) printf("; %s\n", mistake_name(r));
    else printf(": %.0f %% above the tolerance, falls as h^%.1f: right\n", r->above, r->falls);
  }
  if (compare) {
    int worse = compare_known(compare, median);
    return worse < 0 ? 2 : worse > 0;
  }
  printf("%d of %d motions failed\n", failed, result_count);
  summary(failed, 0, 1, median);
  if (record) {
    if (!write_known(record, median)) return 2;
    printf("%s: %d motions recorded, %d known errors", record, result_count, failed);
    if (strcmp(record, "known.txt")) printf(". The next run needs --known %s (or ROTATION_KNOWN)", record);
    printf("\n");
    return 0;
  }
  if (failed) printf("Known and accepted? --record known.txt (or ROTATION_RECORD=known.txt): then only new failures fail\n");
  return failed > 0;
}

#ifdef __cplusplus
} /* namespace */
#if defined(GTEST_TEST)
TEST(ExactRotations, Motions) { EXPECT_EQ(0, exact_rotations::run(0, NULL)) << "The reasons are above."; }
#elif defined(TEST_CASE)
TEST_CASE("exact rotations") { CHECK(0 == exact_rotations::run(0, NULL)); } /* the reasons are printed above */
#else
int main(int argc, char **argv) { return exact_rotations::run(argc, argv); }
#endif
#else
int main(int argc, char **argv) { return run(argc, argv); }
#endif
