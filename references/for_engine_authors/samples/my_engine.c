#include <math.h> /* gcc -O2 my_engine.c -o my_engine -lm */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
static void step(double *y, const double *J, double h) { /* semi-implicit Euler; y is the quaternion and the rates */
    double q[4] = {y[0], y[1], y[2], y[3]}, w[3] = {y[4], y[5], y[6]}, norm = 1;
    for (int i = 0, j = 1, k = 2; i < 3; i++, j = k, k = (k + 1) % 3) y[4 + i] += h * (J[j] - J[k]) * w[j] * w[k] / J[i];
    for (int i = 0, j = 1, k = 2; i < 3; i++, j = k, k = (k + 1) % 3) {
        y[0] -= h / 2 * q[1 + i] * y[4 + i], norm += h * h / 4 * y[4 + i] * y[4 + i];
        y[1 + i] += h / 2 * (q[0] * y[4 + i] + q[1 + j] * y[4 + k] - q[1 + k] * y[4 + j]);
    }
    for (int i = 0; i < 4; i++) y[i] /= sqrt(norm);
}
static void integrate(const char *line, double calls, const char *text, const char *format, int first) {
    double start[8] = {0}, y[8], J[3], dt = atof(strstr(line, "\"dt\"") + 5), n = atof(strstr(line, "\"n_steps\"") + 10);
    sscanf(strstr(line, "\"q0\""), "\"q0\": [%lf, %lf, %lf, %lf", start, start + 1, start + 2, start + 3);
    sscanf(strstr(line, "\"w0\""), "\"w0\": [%lf, %lf, %lf", start + 4, start + 5, start + 6);
    sscanf(strstr(line, "\"moments\""), "\"moments\": [%lf, %lf, %lf", J, J + 1, J + 2);
    for (long every = atol(strstr(line, "\"every\"") + 8), i = printf("%s", text); calls > 0; calls--)
        for (memcpy(y, start, sizeof y), i = 0; i <= n; step(y, J, dt), i++)
            if (i % every == 0 || i == n) printf(format, i ? ", " : "", y[first], y[first + 1], y[first + 2], y[3]);
}
int main(void) {
    char *line = NULL, **runs = calloc(1000000, sizeof *runs);
    for (size_t room = 0, count = 0; getline(&line, &room, stdin) > 0; fflush(stdout)) {
        const char *run = strstr(line, "\"run\":") ? runs[atoi(strstr(line, "\"run\":") + 6)] : NULL;
        struct timespec a, b;
        if (strstr(line, "\"do\": \"hello\"")) puts("{\"protocol\": 1, \"program\": \"C\", \"version\": \"1\", \"framing\": \"lines\"}");
        else if (strstr(line, "\"free\": false")) puts("{\"error\": \"unsupported\", \"message\": \"only free bodies\"}");
        else if (strstr(line, "\"do\": \"prepare\"")) runs[count] = strdup(line), printf("{\"run\": %zu}\n", count++);
        else if (strstr(line, "\"do\": \"run\"")) {
            integrate(run, 1, "{\"q\": [", "%s[%.17g, %.17g, %.17g, %.17g]", 0);
            integrate(run, 1, "], \"w\": [", "%s[%.17g, %.17g, %.17g]", 4), puts("]}");
        } else {
            clock_gettime(CLOCK_MONOTONIC, &a), integrate(run, atof(strstr(line, "\"calls\":") + 8), "", "", 0);
            clock_gettime(CLOCK_MONOTONIC, &b), printf("{\"seconds\": %g}\n", b.tv_sec - a.tv_sec + (b.tv_nsec - a.tv_nsec) * 1e-9);
        }
    }
}
