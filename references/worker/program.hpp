/* The program that runs an engine in C++: what program.py is for Python. It speaks the protocol of PROTOCOL.md in lines,
 * for one body per run. An adapter has its data in its first comment (see read_script in environments/adapter.py), includes this
 * file and defines `build`, which returns a world for one call of a run. `given` has the numbers of the run and the settings.
 */
#include <chrono>
#include <fcntl.h>
#include <iostream>
#include <nlohmann/json.hpp>
#include <unistd.h>

using Json = nlohmann::json;
using Numbers = std::vector<double>;

struct World {
    virtual ~World() = default;
    virtual void step() {}
    virtual void advance(long done, long to) { // numbers of steps
        for (; done < to; done++) step();
    }
    virtual void read(double *q, double *w_W) = 0; // attitude of the axes F, and rates in world axes
};
std::unique_ptr<World> build(const Json &given);

struct Prepared {
    Json given;
    std::vector<long> steps;
    std::vector<std::array<double, 4>> q;
    std::vector<std::array<double, 3>> w;
    double spent = 0;

    double call() { // returns its time in seconds
        const auto world = build(given);
        const auto start = std::chrono::steady_clock::now();
        for (size_t i = 0; i < steps.size(); i++) {
            world->advance(i ? steps[i - 1] : 0, steps[i]);
            world->read(q[i].data(), w[i].data());
        }
        const std::chrono::duration<double> time = std::chrono::steady_clock::now() - start;
        spent += time.count();
        return time.count();
    }
};

static Json answer(const Json &request) {
    static std::map<long, Prepared> runs;
    static long count = 0;
    const std::string what = request["do"];
    if (what == "hello") { // `life`, if there, sends a signal that ends this process when the client ends, also in a loop
        fcntl(request.value("life", -1), F_SETOWN, getpid());
        fcntl(request.value("life", -1), F_SETFL, O_ASYNC);
        return {{"protocol", 1}, {"program", "C++"}, {"version", __VERSION__}, {"framing", "lines"}};
    }
    for (const long run : request["forget"]) runs.erase(run);
    if (what == "check") return Json::object();
    if (request.contains("rows")) return {{"error", "unsupported"}, {"message", "many bodies in one run"}};
    if (what == "prepare") {
        Prepared &run = runs[++count];
        (run.given = request).update(request["settings"]);
        run.steps = request["steps"].get<std::vector<long>>();
        run.q.resize(run.steps.size()), run.w.resize(run.steps.size());
        return {{"run", count}};
    }
    Prepared &run = runs.at(request["run"]);
    while (what == "time" && run.spent < 0.02) run.call(); // before a run is measured
    double seconds = 0;
    for (long i = request.value("calls", 1); i > 0; i--) seconds += run.call();
    return what == "time" ? Json{{"seconds", seconds}} : Json{{"q", run.q}, {"w_W", run.w}};
}

int main() {
    FILE *answers = fdopen(dup(1), "w");
    dup2(2, 1); // engines print
    std::ios::sync_with_stdio(false);
    for (std::string line; std::getline(std::cin, line); fflush(answers)) {
        Json message;
        try {
            message = answer(Json::parse(line));
        } catch (const std::exception &error) {
            message = {{"error", "Error"}, {"message", std::string(error.what()).substr(0, 2000)}};
        }
        fputs((message.dump(-1, ' ', false, Json::error_handler_t::replace) + "\n").c_str(), answers);
    }
    _exit(0); // the client is gone
}
