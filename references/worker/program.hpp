/* The program that runs an engine in C++: what program.py is for Python. It speaks the protocol of PROTOCOL.md in binary
 * framing, for one body per run. An adapter has its data in its first comment (see read_script in environments/adapter.py),
 * includes this file and defines `build`, which returns a world for one call of a run. `given` has the numbers of the run, the
 * settings, and `position` and `velocity`, the start of the centre of mass in the world.
 */
#include <chrono>
#include <fcntl.h>
#include <nlohmann/json.hpp>
#include <unistd.h>

using Json = nlohmann::json;
using Numbers = std::vector<double>;

struct World {
    virtual ~World() = default;
    virtual void advance(long done, long to) = 0;  // numbers of steps
    virtual void read(double *q, double *w_W) = 0; // attitude of the axes F, and rates in world axes
};
std::unique_ptr<World> build(const Json &given);

struct Prepared {
    Json given;
    Numbers q, w;
    double spent;

    double call() { // returns its time in seconds
        const auto world = build(given);
        const Numbers steps = given["steps"];
        const auto start = std::chrono::steady_clock::now();
        for (size_t i = 0; i < steps.size(); i++) {
            world->advance(i ? steps[i - 1] : 0, steps[i]);
            world->read(&q[4 * i], &w[3 * i]);
        }
        const std::chrono::duration<double> time = std::chrono::steady_clock::now() - start;
        spent += time.count();
        return time.count();
    }
};

static const int answers = dup(1);

static std::string receive(size_t size) {
    std::string data(size, 0);
    for (ssize_t done = 0, part; size > 0; size -= part, done += part)
        if ((part = read(0, &data[done], size)) <= 0) _exit(0); // the client is gone
    return data;
}

static void send(const std::string &text) {
    for (size_t done = 0; done < text.size();) done += std::max<ssize_t>(write(answers, &text[done], text.size() - done), 0);
}

static Json request() {
    const std::string sizes = receive(16), text = receive(*reinterpret_cast<const uint32_t *>(&sizes[4]));
    const std::string data = receive(*reinterpret_cast<const uint64_t *>(&sizes[8]));
    Json message = Json::parse(text);
    auto *next = reinterpret_cast<const double *>(data.data());
    for (const Json &array : Json(message["arrays"])) {
        size_t count = 1;
        for (const size_t length : array[2]) count *= length;
        Json &numbers = message[array[0].get<std::string>()] = Json::array();
        for (; count > 0; count--, next++)
            numbers.push_back(array[1] == "<i8" ? *reinterpret_cast<const int64_t *>(next) : *next);
    }
    return message;
}

static void answer(Json values, const Numbers &q = {}, const Numbers &w = {}) {
    values["arrays"] = {{"q", "<f8", {q.size() / 4, 4}}, {"w_W", "<f8", {w.size() / 3, 3}}};
    const std::string text = values.dump(-1, ' ', false, Json::error_handler_t::replace);
    const auto bytes = [](auto *from, size_t count) { return std::string(reinterpret_cast<const char *>(from), count); };
    const uint64_t size = text.size(), length = 8 * (q.size() + w.size()); // the lower half of size is first
    send("cv01" + bytes(&size, 4) + bytes(&length, 8) + text + bytes(q.data(), 8 * q.size()) + bytes(w.data(), 8 * w.size()));
}

static Json complete(Json given) {
    given.update(Json(given["settings"]));
    const Numbers R = given["R0"], c = given["com"], w = given["w0_W"];
    Numbers x(3);
    for (int i = 0; i < 9; i++) x[i / 3] += R[i] * c[i % 3];
    given["position"] = x;
    given["velocity"] = {w[1] * x[2] - w[2] * x[1], w[2] * x[0] - w[0] * x[2], w[0] * x[1] - w[1] * x[0]};
    return given;
}

int main() {
    std::string hello;
    while (hello.empty() || hello.back() != '\n') hello += receive(1);
    const int life = Json::parse(hello)["life"]; // its signal ends this process when the client ends, also in a loop
    fcntl(life, F_SETOWN, getpid());
    fcntl(life, F_SETFL, O_ASYNC);
    dup2(2, 1); // engines print
    send(R"({"protocol": 1, "program": "C++", "version": ")" __VERSION__ "\", \"framing\": \"binary\"}\n");
    std::map<long, Prepared> runs;
    for (long count = 0;;) {
        const Json given = request();
        const std::string what = given["do"];
        try {
            for (const long run : given["forget"]) runs.erase(run);
            if (what == "check") answer(Json::object());
            else if (given.contains("rows")) answer({{"error", "unsupported"}, {"message", "many bodies in one run"}});
            else if (what == "prepare") {
                const size_t n = given["steps"].size();
                runs[++count] = {complete(given), Numbers(4 * n), Numbers(3 * n), 0};
                answer({{"run", count}});
            } else {
                Prepared &run = runs.at(given["run"]);
                while (what == "time" && run.spent < 0.02) run.call(); // before a run is measured
                double seconds = 0;
                for (long i = given.value("calls", 1); i > 0; i--) seconds += run.call();
                what == "time" ? answer({{"seconds", seconds}}) : answer(Json::object(), run.q, run.w);
            }
        } catch (const std::exception &error) {
            answer({{"error", "Error"}, {"message", std::string(error.what()).substr(0, 2000)}});
        }
    }
}
