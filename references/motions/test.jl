# Exact motions as a test of your engine: fill in `simulate`, then   julia test.jl *.csv   (CC0). This file has not been run.
using LinearAlgebra, Printf

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

const NEAR = 0.8 # sum of the squares of four logarithms, of errors over those of a mistake that explains them
const failing = [] # of each motion that fails: its name, the mistakes that explain it with their distances, and the exponent of the step
tested = 0
for file in ARGS
    lines = split.(readlines(file), ",")
    number(x) = something(tryparse(Float64, x), 0.0)
    rows(key) = [number.(line[2:end]) for line in lines if line[1] == key]
    get(key) = isempty(rows(key)) ? zeros(9) : rows(key)[1]
    lacking = setdiff(only(line[2:end] for line in lines if line[1] == "features"), HAS)
    isempty(lacking) || (println("$file: skipped, it has $(join(lacking, ", "))"); continue)
    global tested += 1
    allowed = only(row for row in rows("tolerance") if row[1] == ORDER && row[2] == ANGLE)
    limit, exact, steps = allowed[4:7] .+ SINGLE * get("single")[1], rows("sample"), Int(allowed[3])
    function worst(steps) # the largest errors with so many steps before each sample
        states = simulate(get, exact[1][1] / steps, steps, length(exact))
        largest = reduce((a, b) -> max.(a, b), errors(get, e, y) for (e, y) in zip(exact, states))
        [isnan(x) ? Inf : x for x in largest]
    end
    found = worst(steps)
    most = argmax(found ./ limit)
    ratio = found[most] / limit[most]
    ratio <= 1 && continue
    distances = [sum(log.(max.(found, limit) ./ max.(row[2:5], limit)) .^ 2) for row in rows("catches")]
    near = [line[2] => apart for (line, apart) in zip((line for line in lines if line[1] == "catches"), distances) if apart < NEAR]
    half = worst(2 * steps)[most]
    falls = found[most] < Inf && half > 0 ? log2(found[most] / half) : 0.0
    text = @sprintf("%s: %s error %.1e, tolerance %.1e", file, ("attitude", "rates", "energy", "momentum")[most], found[most], limit[most])
    if falls >= ORDER - 0.5 && (ratio <= 2 || isempty(near))
        @printf("%s: %.0f %% above the tolerance, falls as h^%.1f: right\n", text, 100 * (ratio - 1), falls)
        continue
    end
    println(text)
    push!(failing, (name = file, near = near, falls = falls))
end

println("$(length(failing)) of $tested motions failed")
rest = failing
for _ in 1:3 # the mistakes that explain most of the failing motions
    votes = Dict()
    for each in rest, (name, apart) in each.near
        count, sum = get(votes, name, (0, 0.0))
        votes[name] = (count + 1, sum - apart)
    end
    isempty(votes) && break
    best = argmax(name -> votes[name], unique(name for each in rest for (name, _) in each.near)) # of equal ones the first
    vote = votes[best]
    10 * vote[1] < length(failing) && break
    println("\"$best\" explains $(vote[1]) of them")
    global rest = [each for each in rest if all(name != best for (name, _) in each.near)]
end
isempty(failing) && exit(0)
order = sort([each.falls for each in failing])[length(failing) ÷ 2 + 1]
2 * length(rest) > length(failing) && 0.5 <= order < ORDER - 0.5 && @printf("this program has order %.1f, %d was declared\n", order, ORDER)
isempty(rest) || println("$(length(rest)) not explained by a mistake of the list: $(join([each.name for each in first(rest, 5)], ", "))")
exit(1)
