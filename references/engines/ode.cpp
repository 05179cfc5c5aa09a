/* ODE, the Open Dynamics Engine, in double precision. Its gyroscopic term is linearly implicit, and on as installed.
 * A body about a fixed point is on a ball joint; `finite` rotation is more accurate there. https://ode.org/wiki/index.php/Manual
 *
 * ENGINE = {
 *   "package": "libode-dev", "module": "ode", "precision": "f64", "settings": {"rotation": "finite"},
 *   "orders": {"finite": 1, "infinitesimal": 1},
 *   "method_info": {"variants": ["finite", "infinitesimal"], "as_installed": ["infinitesimal"]}
 * }
 */
#include "../worker/program.hpp"
#include <ode/ode.h>

static const int started = dInitODE2(0);

struct Bodies : World {
    const dWorldID world = dWorldCreate();
    const dBodyID body = dBodyCreate(world);
    const double dt;

    explicit Bodies(const Json &given) : dt(given["dt"]) {
        const std::vector<Numbers> I = given["inertia_com"];
        const Numbers q = given["q0"], w = given["w0_W"], x = given["x0"], v = given["v0"];
        dWorldSetGravity(world, 0, 0, -given["gravity"].get<double>());
        dMass mass;
        dMassSetParameters(&mass, given["mass"], 0, 0, 0, I[0][0], I[1][1], I[2][2], I[0][1], I[0][2], I[1][2]);
        dBodySetMass(body, &mass);
        dBodySetQuaternion(body, q.data());
        dBodySetAngularVel(body, w[0], w[1], w[2]);
        dBodySetFiniteRotationMode(body, given["rotation"] == "finite");
        if (given["free"]) return;
        dBodySetPosition(body, x[0], x[1], x[2]);
        dBodySetLinearVel(body, v[0], v[1], v[2]);
        const dJointID joint = dJointCreateBall(world, nullptr);
        dJointAttach(joint, body, nullptr);
        dJointSetBallAnchor(joint, 0, 0, 0);
    }
    ~Bodies() override { dWorldDestroy(world); }
    void step() override { dWorldStep(world, dt); }
    void read(double *q, double *w_W) override {
        std::copy_n(dBodyGetQuaternion(body), 4, q);
        std::copy_n(dBodyGetAngularVel(body), 3, w_W);
    }
};

std::unique_ptr<World> build(const Json &given) { return std::make_unique<Bodies>(given); }
