// Exact motions as a test of your engine: fill in `simulate`, then   c++ -std=c++17 test.cpp && ./a.out *.csv   (CC0)
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <map>
#include <sstream>
#include <string>
#include <vector>

const int ORDER = 2;         // the order of your integrator: 1, 2 or 4
const double ANGLE = 0.01;   // |w| h, rad: 0.1, 0.03 or 0.01
const bool SINGLE = false;   // single precision
const std::string HAS = "rotor,torque,damping,fixed point,orbit"; // motions that need anything else are skipped

using Row = std::vector<double>;
using State = std::array<double, 7>; // quaternion, scalar first, body to world; rates in body axes, rad/s
struct Motion {
  std::map<std::string, std::vector<Row>> rows; // the numbers of the lines of each key
  std::vector<std::string> needs, mistakes;
  Row operator()(const std::string &key) const { return rows.count(key) ? rows.at(key)[0] : Row(9, 0.0); }
};

// YOUR ENGINE: set up the body of the motion, and return its state after each `steps` steps of h seconds.
std::vector<State> simulate(const Motion &motion, double h, int steps, int samples) {
  Row inertia_B = motion("inertia_B"), q = motion("quaternion_wxyz0"), w = motion("w_WB_B0");
  std::vector<State> states;
  for (int i = 0; i < samples; i++) {
    for (int n = 0; n < steps; n++) (void)h; // one step
    states.push_back({q[0], q[1], q[2], q[3], w[0], w[1], w[2]});
  }
  return states;
}
// END

Row rotate(const State &q, const Row &v) { // world components of v
  Row out(3);
  for (int i = 0; i < 3; i++) {
    int j = (i + 1) % 3, k = (i + 2) % 3;
    double a = q[1 + j] * v[k] - q[1 + k] * v[j], b = q[1 + i] * v[j] - q[1 + j] * v[i], c = q[1 + k] * v[i] - q[1 + i] * v[k];
    out[i] = v[i] + 2 * (q[0] * a + q[1 + j] * b - q[1 + k] * c);
  }
  return out;
}

Row errors(const Motion &m, const Row &exact, const State &y) { // attitude (rad); rates, energy, momentum: relative to scales
  Row J = m("inertia_B"), h = m("rotor_momentum_B"), scale = m("scale"), L(3);
  double E = 0, plus = 0, minus = 0, dw = 0, dL = 0;
  for (int i = 0; i < 3; i++) {
    L[i] = J[3 * i] * y[4] + J[3 * i + 1] * y[5] + J[3 * i + 2] * y[6];
    E += L[i] * y[4 + i] / 2, L[i] += h[i], dw += std::pow(y[4 + i] - exact[14 + i], 2);
  }
  L = rotate(y, L), E += m("weight")[0] * rotate(y, m("com_B"))[2];
  for (int i = 0; i < 3; i++) dL += std::pow(L[i] - exact[21 + i], 2);
  for (int i = 0; i < 4; i++) minus += std::pow(y[i] - exact[10 + i], 2), plus += std::pow(y[i] + exact[10 + i], 2);
  return {4 * std::asin(std::min(1.0, std::sqrt(std::min(plus, minus)) / 2)), std::sqrt(dw) / scale[0],
          std::abs(E - exact[20]) / scale[1], std::sqrt(dL) / scale[2]};
}

int main(int argc, char **argv) {
  int failed = 0;
  for (int f = 1; f < argc; f++) {
    Motion m;
    std::ifstream file(argv[f]);
    for (std::string line, key, field; std::getline(file, line);) {
      std::istringstream fields(line);
      std::getline(fields, key, ',');
      Row values;
      for (bool first = true; std::getline(fields, field, ','); first = false) {
        if (key == "needs") m.needs.push_back(field);
        if (key == "catches" && first) m.mistakes.push_back(field);
        values.push_back(std::strtod(field.c_str(), nullptr));
      }
      m.rows[key].push_back(values);
    }
    auto missing = std::find_if(m.needs.begin(), m.needs.end(), [](auto &each) { return HAS.find(each) == std::string::npos; });
    if (missing != m.needs.end() || m.rows.empty()) {
      std::printf("%s: skipped, it needs %s\n", argv[f], m.rows.empty() ? "to exist" : missing->c_str());
      continue;
    }
    Row allowed, worst(4, 0.0);
    for (auto &row : m.rows["tolerance"]) if (row[0] == ORDER && row[1] == ANGLE) allowed = row;
    auto &exact = m.rows["sample"];
    auto states = simulate(m, exact[0][0] / allowed[2], (int)allowed[2], (int)exact.size());
    for (size_t i = 0; i < exact.size(); i++)
      for (int k = 0; k < 4; k++) {
        double e = errors(m, exact[i], states[i])[k];
        worst[k] = std::max(worst[k], std::isnan(e) ? HUGE_VAL : e);
      }
    int most = 0;
    for (int k = 0; k < 4; k++) {
      allowed[3 + k] += SINGLE * m("single")[0];
      if (worst[k] / allowed[3 + k] > worst[most] / allowed[3 + most]) most = k;
    }
    if (worst[most] <= allowed[3 + most]) continue;
    std::string advice = "no mistake of the list does this";
    double best = 0.5;
    for (size_t n = 0; n < m.mistakes.size(); n++) {
      double apart = 0;
      for (int k = 0; k < 4; k++)
        apart += std::pow(std::log(std::max(worst[k], allowed[3 + k]) / std::max(m.rows["catches"][n][4 + k], allowed[3 + k])), 2);
      if (apart < best) best = apart, advice = "this is what a program does with: " + m.mistakes[n];
    }
    const char *names[] = {"attitude", "rates", "energy", "momentum"};
    std::printf("%s: %s error %.1e, tolerance %.1e; %s\n", argv[f], names[most], worst[most], allowed[3 + most], advice.c_str());
    failed++;
  }
  std::printf("%d of %d motions failed\n", failed, argc - 1);
  return failed > 0;
}
