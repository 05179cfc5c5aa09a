/* Simbody in double precision, with one of its integrators. A free body is on `MobilizedBody::Free`, one about a fixed point on
 * `MobilizedBody::Ball`, both with quaternions. `accuracy` is that of adaptive steps, 1e-3 by Simbody's default; 0 stands for
 * fixed steps of dt. https://simbody.github.io/3.7.0/classSimTK_1_1Integrator.html
 *
 * ENGINE = {
 *   "package": "libsimbody-dev", "module": "simbody", "precision": "f64",
 *   "settings": {"integrator": "RungeKuttaMerson", "accuracy": 0.0},
 *   "orders": {"RungeKuttaMerson": 4, "RungeKuttaFeldberg": 4, "RungeKutta3": 3, "Verlet": 2}, "tolerance": "accuracy",
 *   "method_info": {"variants": ["", "RungeKuttaFeldberg", "Verlet", "accuracy=1e-10"], "as_installed": ["accuracy=1e-3"]}
 * }
 */
#include "../worker/program.hpp"
#include <Simbody.h>

using namespace SimTK;
template <class Kind> Integrator *make(const System &system) { return new Kind(system); }
static const std::map<std::string, Integrator *(*)(const System &)> INTEGRATORS = {
    {"RungeKuttaMerson", make<RungeKuttaMersonIntegrator>}, {"RungeKuttaFeldberg", make<RungeKuttaFeldbergIntegrator>},
    {"RungeKutta3", make<RungeKutta3Integrator>}, {"Verlet", make<VerletIntegrator>}};

struct Bodies : World {
    MultibodySystem system;
    SimbodyMatterSubsystem matter{system};
    GeneralForceSubsystem forces{system};
    MobilizedBody body;
    std::unique_ptr<Integrator> integrator;
    double dt;

    explicit Bodies(const Json &given) : dt(given["dt"]) {
        const std::vector<Numbers> I = given["inertia_com"];
        const Numbers q = given["q0"], c = given["com"], w = given["w0_W"];
        const double mass = given["mass"], gravity = given["gravity"], accuracy = given["accuracy"];
        const Vec3 com(c[0], c[1], c[2]);
        const Inertia inertia = Inertia(Vec3(I[0][0], I[1][1], I[2][2]), Vec3(I[0][1], I[0][2], I[1][2])).shiftFromMassCenter(com, mass);
        const Body::Rigid rigid(MassProperties(mass, com, inertia)); // about the origin of F
        if (gravity != 0) Force::UniformGravity(forces, matter, Vec3(0, 0, -gravity));
        if (given["free"]) body = MobilizedBody::Free(matter.Ground(), rigid);
        else body = MobilizedBody::Ball(matter.Ground(), rigid);
        State state = system.realizeTopology();
        matter.setUseEulerAngles(state, false);
        system.realizeModel(state);
        body.setQToFitRotation(state, Rotation(Quaternion(Vec4(q[0], q[1], q[2], q[3]))));
        system.realize(state, Stage::Position);
        body.setUToFitAngularVelocity(state, Vec3(w[0], w[1], w[2]));
        integrator = std::unique_ptr<Integrator>(INTEGRATORS.at(given["integrator"])(system));
        if (accuracy > 0) integrator->setAccuracy(accuracy), integrator->setMaximumStepSize(dt);
        else integrator->setFixedStepSize(dt);
        integrator->initialize(state);
    }
    void advance(long, long to) override {
        // It returns early at its own steps. A rounding error of the time must not add a tiny step.
        while (integrator->getTime() < (to - 1e-9) * dt) integrator->stepTo(to * dt);
    }
    void read(double *q, double *w_W) override {
        const State &state = integrator->getState();
        system.realize(state, Stage::Velocity);
        Vec4::updAs(q) = body.getBodyRotation(state).convertRotationToQuaternion().asVec4();
        Vec3::updAs(w_W) = body.getBodyAngularVelocity(state);
    }
};

std::unique_ptr<World> build(const Json &given) { return std::make_unique<Bodies>(given); }
