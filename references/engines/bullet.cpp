/* Bullet's `btRigidBody` in double precision, with its three gyroscopic terms: `body` and `world` are implicit.
 * A body about a fixed point has a point constraint to the world. Unless `as_installed`, sleeping and the limit of the explicit
 * torque are off. https://github.com/bulletphysics/bullet3/blob/master/src/BulletDynamics/Dynamics/btRigidBody.h
 *
 * ENGINE = {
 *   "package": "libbullet-dev", "module": "bullet-float64", "precision": "f64",
 *   "settings": {"gyroscopic": "body", "as_installed": false}, "orders": {"body": 1, "world": 1, "explicit": 1},
 *   "method_info": {"variants": ["body", "world", "explicit", "body,as_installed=true"], "as_installed": ["body,as_installed=true"]}
 * }
 */
#include "../worker/program.hpp"
#include <btBulletDynamicsCommon.h>

static btVector3 vector(const Numbers &v) { return {v[0], v[1], v[2]}; }
static btQuaternion quaternion(const Numbers &q) { return {q[1], q[2], q[3], q[0]}; }
static const std::map<std::string, int> FLAGS = {{"body", BT_ENABLE_GYROSCOPIC_FORCE_IMPLICIT_BODY},
    {"world", BT_ENABLE_GYROSCOPIC_FORCE_IMPLICIT_WORLD}, {"explicit", BT_ENABLE_GYROSCOPIC_FORCE_EXPLICIT}};

struct Bodies : World {
    btSphereShape shape{0.05};
    btRigidBody body;
    std::unique_ptr<btPoint2PointConstraint> joint;
    btDefaultCollisionConfiguration configuration;
    btCollisionDispatcher dispatcher{&configuration};
    btDbvtBroadphase phases;
    btSequentialImpulseConstraintSolver solver;
    btDiscreteDynamicsWorld world{&dispatcher, &phases, &solver, &configuration}; // destroyed before the bodies
    btQuaternion axes; // Bullet's are principal at the centre of mass
    double dt;

    explicit Bodies(const Json &given)
        : body(given["mass"], nullptr, &shape, vector(given["moments_com"])), axes(quaternion(given["q_com"])), dt(given["dt"]) {
        world.setGravity({0, 0, -given["gravity"].get<double>()});
        const btTransform start(quaternion(given["q0"]) * axes, vector(given["x0"]));
        body.setCenterOfMassTransform(start);
        body.setAngularVelocity(vector(given["w0_W"]));
        body.setLinearVelocity(vector(given["v0"]));
        body.setFlags(FLAGS.at(given["gyroscopic"]));
        if (!given["as_installed"]) {
            body.setActivationState(DISABLE_DEACTIVATION);
            world.getSolverInfo().m_maxGyroscopicForce = 1e30;
        }
        world.addRigidBody(&body);
        if (given["free"]) return;
        joint = std::make_unique<btPoint2PointConstraint>(body, start.inverse() * btVector3(0, 0, 0));
        world.addConstraint(joint.get());
    }
    void step() override { world.stepSimulation(dt, 0); } // 0: not in steps of 1/60 s
    void read(double *q, double *w_W) override {
        const btQuaternion turn = body.getWorldTransform().getRotation() * axes.inverse();
        for (int i = 0; i < 4; i++) q[i] = turn[(i + 3) % 4];
        std::copy_n(&body.getAngularVelocity()[0], 3, w_W);
    }
};

std::unique_ptr<World> build(const Json &given) { return std::make_unique<Bodies>(given); }
