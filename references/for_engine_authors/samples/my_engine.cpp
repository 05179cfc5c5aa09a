#include <chrono> // g++ -O2 -std=c++17 my_engine.cpp -o my_engine
#include <iostream>
#include <sstream>
#include <vector>
static std::vector<double> get(const std::string &line, const std::string &name) { // the numbers of a field
    std::istringstream text(line.substr(line.find("\"" + name + "\": ") + name.size() + 4));
    std::vector<double> numbers;
    for (double number = text.peek() == '[' && text.ignore(); text >> number; text.ignore()) numbers.push_back(number);
    return numbers;
}
static std::string integrate(const std::string &line, double calls, bool answer) { // semi-implicit Euler
    const auto q = get(line, "q0"), w = get(line, "w0"), J = get(line, "moments"), steps = get(line, "steps"), dt = get(line, "dt");
    std::ostringstream Q, W;
    for (Q.precision(17), W.precision(17); calls > 0; calls--) {
        double h = dt[0], a = q[0], b = q[1], c = q[2], d = q[3], x = w[0], y = w[1], z = w[2];
        for (size_t n = 0, sample = 0; sample < steps.size(); n++) {
            if (n == steps[sample] && ++sample && answer)
                Q << (n ? ",[" : "[") << a << "," << b << "," << c << "," << d << "]", W << (n ? ",[" : "[") << x << "," << y << "," << z << "]";
            double u = x + h * (J[1] - J[2]) * y * z / J[0], v = y + h * (J[2] - J[0]) * z * x / J[1];
            z += h * (J[0] - J[1]) * x * y / J[2], x = u, y = v;
            double e = a - h / 2 * (b * x + c * y + d * z), f = b + h / 2 * (a * x + c * z - d * y);
            double g = c + h / 2 * (a * y + d * x - b * z), i = d + h / 2 * (a * z + b * y - c * x);
            double norm = 1.5 - (e * e + f * f + g * g + i * i) / 2; // a step of Newton's method for 1 / sqrt
            a = norm * e, b = norm * f, c = norm * g, d = norm * i;
        }
    }
    return "{\"q\": [" + Q.str() + "], \"w\": [" + W.str() + "]}";
}
int main() {
    std::vector<std::string> runs;
    for (std::string line; std::getline(std::cin, line); std::cout << std::endl) {
        const auto start = std::chrono::steady_clock::now();
        if (line.find("\"hello\"") < line.size()) std::cout << R"({"protocol": 1, "program": "C++", "version": "1", "framing": "lines"})";
        else if (line.find("\"free\": false") < line.size()) std::cout << R"({"error": "unsupported", "message": "only free bodies"})";
        else if (line.find("\"prepare\"") < line.size()) std::cout << "{\"run\": " << runs.size() << "}", runs.push_back(line);
        else if (line.find("\"calls\"") > line.size()) std::cout << integrate(runs[get(line, "run")[0]], 1, true);
        else if (integrate(runs[get(line, "run")[0]], get(line, "calls")[0], false).size())
            std::cout << "{\"seconds\": " << std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count() << "}";
    }
}
