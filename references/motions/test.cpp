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
  std::vector<std::string> features, mistakes;
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

Row worst(const Motion &m, int steps) { // the largest errors with so many steps before each sample
  auto &exact = m.rows.at("sample");
  auto states = simulate(m, exact[0][0] / steps, steps, (int)exact.size());
  Row out(4, 0.0);
  for (size_t i = 0; i < exact.size(); i++)
    for (int k = 0; k < 4; k++) {
      double e = errors(m, exact[i], states[i])[k];
      out[k] = std::max(out[k], std::isnan(e) ? HUGE_VAL : e);
    }
  return out;
}

const double NEAR = 0.8; // sum of the squares of four logarithms, of errors over those of a mistake that explains them
struct Failure {
  std::string name;
  std::vector<std::pair<std::string, double>> near; // the mistakes that explain it, and their distances
  double falls;                       // the exponent with which the error falls with the step
};

int main(int argc, char **argv) {
  const char *names[] = {"attitude", "rates", "energy", "momentum"};
  std::vector<Failure> failing;
  int tested = 0;
  for (int f = 1; f < argc; f++) {
    Motion m;
    std::ifstream file(argv[f]);
    for (std::string line, key, field; std::getline(file, line);) {
      std::istringstream fields(line);
      std::getline(fields, key, ',');
      Row values;
      for (bool first = true; std::getline(fields, field, ','); first = false) {
        if (key == "features") m.features.push_back(field);
        if (key == "catches" && first) m.mistakes.push_back(field);
        values.push_back(std::strtod(field.c_str(), nullptr));
      }
      m.rows[key].push_back(values);
    }
    auto missing = std::find_if(m.features.begin(), m.features.end(), [](auto &each) { return HAS.find(each) == std::string::npos; });
    if (missing != m.features.end() || m.rows.empty()) {
      std::printf("%s: skipped, it has %s\n", argv[f], m.rows.empty() ? "no rows" : missing->c_str());
      continue;
    }
    tested++;
    Row allowed;
    for (auto &row : m.rows["tolerance"]) if (row[0] == ORDER && row[1] == ANGLE) allowed = row;
    Row found = worst(m, (int)allowed[2]), limit(allowed.begin() + 3, allowed.end());
    int most = 0;
    for (int k = 0; k < 4; k++) {
      limit[k] += SINGLE * m("single")[0];
      if (found[k] / limit[k] > found[most] / limit[most]) most = k;
    }
    double ratio = found[most] / limit[most];
    if (ratio <= 1) continue;
    Failure failure{argv[f], {}, 0};
    for (size_t n = 0; n < m.mistakes.size(); n++) {
      double apart = 0;
      for (int k = 0; k < 4; k++)
        apart += std::pow(std::log(std::max(found[k], limit[k]) / std::max(m.rows["catches"][n][1 + k], limit[k])), 2);
      if (apart < NEAR) failure.near.push_back({m.mistakes[n], apart});
    }
    double half = worst(m, 2 * (int)allowed[2])[most];
    if (found[most] < HUGE_VAL && half > 0) failure.falls = std::log2(found[most] / half);
    std::printf("%s: %s error %.1e, tolerance %.1e", argv[f], names[most], found[most], limit[most]);
    if (failure.falls >= ORDER - 0.5 && (ratio <= 2 || failure.near.empty())) {
      std::printf(": %.0f %% above the tolerance, falls as h^%.1f: right\n", 100 * (ratio - 1), failure.falls);
      continue;
    }
    std::printf("\n");
    failing.push_back(failure);
  }

  std::printf("%d of %d motions failed\n", (int)failing.size(), tested);
  auto rest = failing;
  for (int n = 0; n < 3; n++) { // the mistakes that explain most of the failing motions
    std::map<std::string, std::pair<int, double>> votes;
    for (auto &each : rest)
      for (auto &[name, apart] : each.near) votes[name].first++, votes[name].second -= apart;
    std::string best; // of two that explain the same, the first of the file
    for (auto &each : rest)
      for (auto &[name, apart] : each.near)
        if (best.empty() || votes[best] < votes[name]) best = name;
    if (best.empty() || 10 * votes[best].first < (int)failing.size()) break;
    std::printf("\"%s\" explains %d of them\n", best.c_str(), votes[best].first);
    auto explained = [&](auto &each) { return std::any_of(each.near.begin(), each.near.end(), [&](auto &one) { return one.first == best; }); };
    rest.erase(std::remove_if(rest.begin(), rest.end(), explained), rest.end());
  }
  if (failing.empty()) return 0;
  Row falls;
  for (auto &each : failing) falls.push_back(each.falls);
  std::sort(falls.begin(), falls.end());
  double order = falls[falls.size() / 2];
  if (2 * rest.size() > falls.size() && order >= 0.5 && order < ORDER - 0.5)
    std::printf("this program has order %.1f, %d was declared\n", order, ORDER);
  if (rest.empty()) return 1;
  std::printf("%d not explained by a mistake of the list:", (int)rest.size());
  for (size_t n = 0; n < std::min<size_t>(5, rest.size()); n++) std::printf("%s %s", n ? "," : "", rest[n].name.c_str());
  std::printf("\n");
  return 1;
}
