# Exact motions as a test of your engine: fill in `simulate`, then   julia test.jl *.csv   (CC0). This file has not been run.
using LinearAlgebra

const ORDER = 2      # the order of your integrator: 1, 2 or 4
const ANGLE = 0.01   # |w| h, rad: 0.1, 0.03 or 0.01
const SINGLE = false # single precision
const HAS = ["rotor", "torque", "damping", "fixed point", "orbit"] # motions that need anything else are skipped

# YOUR ENGINE: set up the body of the motion, and return [quaternion; rates] after each `steps` steps of h seconds: the
# quaternion has the scalar first and maps body to world, the rates are in body axes, rad/s.
function simulate(get, h, steps, samples)
    inertia_B = reshape(get("inertia_B"), 3, 3)
    [vcat(get("quaternion_wxyz0"), get("w_WB_B0")) for _ in 1:samples]
end
# END

rotate(q, v) = v + 2 * (q[1] * cross(q[2:4], v) + cross(q[2:4], cross(q[2:4], v)))

function errors(get, exact, y) # attitude, rad; rates, energy and momentum relative to the scales of the motion
    q, w, scale = y[1:4], y[5:7], get("scale")
    L = reshape(get("inertia_B"), 3, 3) * w
    energy = dot(L, w) / 2 + get("weight")[1] * rotate(q, get("com_B")[1:3])[3]
    apart = min(norm(q - exact[11:14]), norm(q + exact[11:14]))
    [4 * asin(min(1, apart / 2)), norm(w - exact[15:17]) / scale[1], abs(energy - exact[21]) / scale[2],
     norm(rotate(q, L + get("rotor_momentum_B")[1:3]) - exact[22:24]) / scale[3]]
end

failed = 0
for file in ARGS
    lines = split.(readlines(file), ",")
    number(x) = something(tryparse(Float64, x), 0.0)
    rows(key) = [number.(line[2:end]) for line in lines if line[1] == key]
    get(key) = isempty(rows(key)) ? zeros(9) : rows(key)[1]
    lacking = setdiff(only(line[2:end] for line in lines if line[1] == "needs"), HAS)
    isempty(lacking) || (println("$file: skipped, it needs $(join(lacking, ", "))"); continue)
    allowed = only(row for row in rows("tolerance") if row[1] == ORDER && row[2] == ANGLE)
    limit, exact = allowed[4:7] .+ SINGLE * get("single")[1], rows("sample")
    states = simulate(get, exact[1][1] / allowed[3], Int(allowed[3]), length(exact))
    worst = reduce((a, b) -> max.(a, b), errors(get, e, y) for (e, y) in zip(exact, states))
    most = argmax(worst ./ limit)
    worst[most] <= limit[most] && continue
    distances = [sum(log.(max.(worst, limit) ./ max.(row[5:8], limit)) .^ 2) for row in rows("catches")]
    names = [line[2] for line in lines if line[1] == "catches"]
    near = argmin(distances)
    advice = distances[near] < 0.5 ? "this is what a program does with: $(names[near])" : "no mistake of the list does this"
    println("$file: $(("attitude", "rates", "energy", "momentum")[most]) error $(worst[most]), tolerance $(limit[most]); $advice")
    global failed += 1
end
println("$failed of $(length(ARGS)) motions failed")
exit(failed > 0 ? 1 : 0)
